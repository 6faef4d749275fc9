"""The entry points of a single wheel against reference values, and their shapes and errors."""

import csv
import math

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Numerics, Soil, TorusWheel
from ddagr_gym.physics import SinkageStatus, equilibrium_sinkage, wheel_force

# At almost no lateral sliding |V| has a kink inside the patch; any fixed rule converges slowly there.
# Theory: wheel model, section 5.
KINKED = {"driven_straight": (4e-3, 5e-4), "yawing_at_rest": (5e-2, 2e-3)}
# Sunk to the limit, in soil with n = 1.6, or with a stress that turns round, the default rule errs by more than 1e-3.
COARSE = {"sunk_to_the_limit": 3e-3, "braked_in_snow": 2e-3, "counter_rotating_backwards": 3e-3}


def _read(path):
    with path.open(newline="") as handle:
        return [
            {k: v if k == "case" else float(v) for k, v in row.items()} for row in csv.DictReader(handle)
        ]  # fmt: skip


def _errors(result, row, outer_radius):
    """Errors of force and moments as shares of the force's size (times the radius)."""
    force = np.array([row["F_x"], row["F_y"], row["F_z"]])
    size = np.linalg.norm(force)
    moments = (result.yaw_moment - row["M_z"], result.axle_torque - row["axle_torque"])
    return max(np.linalg.norm(result.force - force), *(abs(m) / outer_radius for m in moments)) / size


@pytest.fixture(scope="module")
def shared_rows(shared_dir):
    """Wheel, soil and values of ``reference/wheel_forces.csv``."""
    cases = []
    for row in _read(shared_dir / "reference" / "wheel_forces.csv"):
        wheel = TorusWheel(row["minor_radius"], row["half_width"], row["major_radius"])
        friction = math.radians(row["friction_angle_deg"])
        stress = [row[k] for k in ("n", "k_c", "k_phi", "K", "a0", "a1", "lambda_theta")]
        cases.append((wheel, Soil(row["cohesion"], friction, *stress), row))
    assert len(cases) == 24
    return cases


@pytest.mark.parametrize(
    ("numerics", "nine_in_ten", "largest"), [(Numerics(), 1e-3, 4e-3), (Numerics.finest(), 1e-6, 1e-6)]
)
def test_every_reference_row(shared_rows, numerics, nine_in_ten, largest):
    errors = []
    for wheel, soil, row in shared_rows:
        state = [row[k] for k in ("v_x", "v_y", "omega", "yaw_rate", "sinkage")]
        result = wheel_force(wheel, soil, *state, numerics=numerics)
        errors.append(_errors(result, row, wheel.outer_radius))
        assert result.slip_ratio == pytest.approx(row["slip_ratio"], abs=1e-12)
    assert np.quantile(errors, 0.9) <= nine_in_ten
    assert max(errors) <= largest


@pytest.mark.parametrize(("numerics", "bound"), [(Numerics(), 1e-3), (Numerics.finest(), 1e-6)])
def test_equilibrium_sinkage_of_every_reference_row(shared_rows, numerics, bound):
    for wheel, soil, row in shared_rows:
        state = [row[k] for k in ("v_x", "v_y", "omega", "yaw_rate", "load")]
        sinkage, status = equilibrium_sinkage(wheel, soil, *state, numerics=numerics)
        assert status is SinkageStatus.FOUND
        assert sinkage == pytest.approx(row["sinkage"], rel=bound)


@pytest.mark.parametrize("finest", [False, True])
def test_every_golden_state(golden, reference, finest):
    rows = _read(golden / "wheel_forces.csv")
    assert [row["case"] for row in rows] == list(reference.CASES)
    for row in rows:
        wheel = TorusWheel(*(row[k] for k in reference.Wheel._fields))
        soil = Soil(*(row[k] for k in reference.Soil._fields))
        state = [row[k] for k in reference.State._fields]
        result = wheel_force(wheel, soil, *state, numerics=Numerics.finest() if finest else Numerics())
        default, fine = KINKED.get(row["case"], (COARSE.get(row["case"], 1e-3), 1e-6))
        assert _errors(result, row, wheel.outer_radius) <= (fine if finest else default), row["case"]


@pytest.mark.parametrize("case", ["spinning_on_the_spot", "outer_wheel_of_table_6_2"])
def test_golden_file_is_what_its_script_computes(golden, reference, case):
    row = next(row for row in _read(golden / "wheel_forces.csv") if row["case"] == case)
    wheel, soil, state = reference.CASES[case]
    assert [row[k] for k in (*wheel._fields, *soil._fields, *state._fields)] == [*wheel, *soil, *state]
    wrench = reference.wheel_wrench(wheel, soil, state, panels=5, order=6)
    np.testing.assert_allclose(wrench, [row[k] for k in reference.COLUMNS], rtol=1e-4, atol=1e-3)


def test_arguments_broadcast_and_single_states_give_the_same_bits(wheel, soil):
    v_x, omega = np.linspace(-0.4, 0.4, 5)[:, None], np.linspace(-1.5, 1.5, 3)
    result = wheel_force(wheel, soil, v_x, 0.05, omega, 0.1, 0.01)
    assert result.force.shape == (5, 3, 3)
    assert result.yaw_moment.shape == result.axle_torque.shape == result.slip_ratio.shape == (5, 3)
    for i in range(5):
        for j in range(3):
            single = wheel_force(wheel, soil, v_x[i, 0], 0.05, omega[j], 0.1, 0.01)
            assert single.force.shape == (3,)
            assert (single.force == result.force[i, j]).all()
            assert single.axle_torque == result.axle_torque[i, j]


def test_sinkages_broadcast_and_carry_the_load(wheel, soil):
    load = np.array([100.0, 400.0, 1600.0])
    v_x = np.array([[0.1], [0.3]])
    sinkage, status = equilibrium_sinkage(wheel, soil, v_x, 0.02, 0.9, 0.1, load)
    assert sinkage.shape == status.shape == (2, 3)
    assert (status == SinkageStatus.FOUND).all()
    carried = wheel_force(wheel, soil, v_x, 0.02, 0.9, 0.1, sinkage).force[..., 2]
    np.testing.assert_allclose(carried, np.broadcast_to(load, (2, 3)), rtol=2e-6)


def test_empty_arrays_pass_through(wheel, soil):
    assert wheel_force(wheel, soil, [], 0.0, 1.0, 0.0, 0.01).force.shape == (0, 3)
    assert equilibrium_sinkage(wheel, soil, [], 0.0, 1.0, 0.0, 100.0)[0].shape == (0,)


def test_scalars_give_a_float_and_a_status(wheel, soil):
    sinkage, status = equilibrium_sinkage(wheel, soil, 0.2, 0.0, 0.7, 0.0, 412.0)
    assert isinstance(sinkage, float)
    assert isinstance(status, SinkageStatus)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"v_x": math.nan}, ("v_x", "nan", "finite")),
        ({"omega": math.inf}, ("omega", "inf", "finite")),
        ({"v_y": "fast"}, ("v_y", "'fast'", "numbers")),
        ({"v_y": [[1.0], [1.0, 2.0]]}, ("v_y", "regular shape")),
        ({"v_x": [1.0, 2.0], "v_y": [1.0, 2.0, 3.0]}, ("broadcast", "(2,)", "(3,)")),
        ({"sinkage": 0.0}, ("sinkage is 0 m", "0.05", "equilibrium_sinkage")),
        ({"sinkage": -0.01}, ("sinkage is -0.01 m",)),
        ({"sinkage": [0.01, 0.06]}, ("sinkage is 0.06 m",)),
    ],
)
def test_bad_input_is_one_sentence(wheel, soil, changes, words):
    arguments = {"v_x": 0.2, "v_y": 0.0, "omega": 0.7, "yaw_rate": 0.0, "sinkage": 0.01} | changes
    with pytest.raises(InputError) as error:
        wheel_force(wheel, soil, **arguments)
    assert all(word in str(error.value) for word in words)
    assert str(error.value).endswith(".")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("load", [math.nan, math.inf, "heavy"])
def test_bad_load_is_one_sentence(wheel, soil, load):
    with pytest.raises(InputError, match=r"load .*give"):
        equilibrium_sinkage(wheel, soil, 0.2, 0.0, 0.7, 0.0, load)
