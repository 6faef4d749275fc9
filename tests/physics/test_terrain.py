"""Soil by place: interpolation of the grid, its edge, and what the wheels then feel."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Soil
from ddagr_gym.physics import layout
from ddagr_gym.physics.terrain import SoilField, SoilGrids, sample_soil
from ddagr_gym.physics.wheel_forces import soil_vector
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import Simulator, simulate

SOIL = get_soil("thesis_a1")


def _plane(x: float, y: float) -> Soil:
    """Cohesion that is linear in place."""
    return SOIL.with_values(cohesion=4000.0 + 300.0 * x - 200.0 * y)


def _cohesion_at(field, x, y):
    row = np.zeros(layout.SIZE)
    row[layout.WHEEL_X : layout.WHEEL_X + 4] = x
    row[layout.WHEEL_Y : layout.WHEEL_Y + 4] = y
    geometry = np.array([[*field.origin, *field.spacing]])
    sample_soil(row, SoilGrids(field.values[None], geometry, np.zeros(1, dtype=np.int64)), 0)
    return row[layout.SOIL : layout.SOIL + 36 : 9]


FIELD = SoilField.sample(_plane, np.linspace(-2.0, 3.0, 11), np.linspace(-1.0, 2.0, 7))


@given(st.floats(-2.0, 3.0), st.floats(-1.0, 2.0))
def test_interpolation_is_exact_for_a_linear_field(x, y):
    np.testing.assert_allclose(_cohesion_at(FIELD, x, y), 4000.0 + 300.0 * x - 200.0 * y, rtol=1e-12)


@given(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0))
def test_soil_is_constant_beyond_the_edge(x, y):
    inside = 4000.0 + 300.0 * np.clip(x, -2.0, 3.0) - 200.0 * np.clip(y, -1.0, 2.0)
    np.testing.assert_allclose(_cohesion_at(FIELD, x, y), inside, rtol=1e-12)


def test_each_wheel_is_sampled_at_its_own_hub():
    cohesion = _cohesion_at(FIELD, [0.0, 1.0, 2.0, 3.0], [0.0, 0.5, 1.0, -1.0])
    np.testing.assert_allclose(cohesion, [4000.0, 4200.0, 4400.0, 5100.0], rtol=1e-12)


def test_nodes_hold_the_soils_that_were_given():
    field = SoilField.sample(lambda x, y: get_soil("thesis_a1") if x < 1 else get_soil("firm_ground"), [0, 2], [0, 1])
    np.testing.assert_array_equal(field.values[0, 0], soil_vector(get_soil("thesis_a1")))
    np.testing.assert_array_equal(field.values[1, 1], soil_vector(get_soil("firm_ground")))


def test_uniform_field_is_the_soil_itself_to_the_bit():
    robot, commands = get_robot("ddagr"), np.tile([0.2, 1.0], (100, 1))
    field = SoilField.sample(lambda x, y: SOIL, [-1.0, 1.0], [-1.0, 1.0])
    plain = simulate(robot, SOIL, commands, seed=4)
    placed = simulate(robot, get_soil("firm_ground"), commands, field=field, seed=4)
    for name, values in plain.items():
        np.testing.assert_array_equal(placed[name], values, err_msg=name)


def test_robot_slows_down_where_the_soil_gets_soft():
    robot, soft = get_robot("ddagr"), get_soil("dry_sand_lll_0")
    field = SoilField.sample(lambda x, y: SOIL if x < 1.0 else soft, np.linspace(-1, 5, 61), [-2.0, 2.0])
    drive = simulate(robot, SOIL, np.tile([0.7, 0.7], (1500, 1)), field=field)
    front_on_soft = np.searchsorted(drive["true_x"], 1.5)
    before = np.searchsorted(drive["true_x"], 0.5)
    assert drive["true_sinkage_1"][front_on_soft] > 1.2 * drive["true_sinkage_1"][before]
    assert drive["true_v_x"][front_on_soft] < 0.99 * drive["true_v_x"][before]


def test_fields_of_a_batch_are_kept_apart():
    robot, commands = get_robot("ddagr"), np.tile([0.3, 0.9], (3, 50, 1))
    fields = [SoilField.sample(lambda x, y, s=s: get_soil(s), [0, 1], [0, 1]) for s in ("thesis_a1", "lunar_nominal")]
    batch = Simulator(3, fields=fields)
    for i, index in enumerate((0, 1, -1)):
        batch.configure(i, robot, get_soil("lete_sand_wong"))
        batch.field_index[i] = index
    batch.reset()
    _, record = batch.step(commands, recorded=[layout.V_X, layout.SINKAGE])
    for i, name in enumerate(("thesis_a1", "lunar_nominal", "lete_sand_wong")):
        alone = simulate(robot, get_soil(name), commands[0])
        np.testing.assert_array_equal(record[i, :, 0], alone["true_v_x"])
        np.testing.assert_array_equal(record[i, :, 1], alone["true_sinkage_1"])


GRID = np.ones((3, 3, 9))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: SoilField((0, 0), (1, 1), np.ones((1, 3, 9))), "(1, 3, 9)"),
        (lambda: SoilField((0, 0), (1, 1), np.ones((3, 3, 8))), "(3, 3, 8)"),
        (lambda: SoilField((0, 0), (1, 1), np.full((3, 3, 9), np.nan)), "NaN"),
        (lambda: SoilField((0, 0), (1, -1), GRID), "(1, -1)"),
        (lambda: SoilField((0, 0), (1, np.nan), GRID), "nan"),
        (lambda: SoilField((np.inf, 0), (1, 1), GRID), "inf"),
        (lambda: SoilField.sample(_plane, [0.0], [0.0, 1.0]), "1 x 2"),
        (lambda: SoilField.sample(_plane, [0.0, 1.0, 5.0], [0.0, 1.0]), "evenly"),
        (lambda: Simulator(2, fields=[FIELD, SoilField((0, 0), (1, 1), GRID)]), "same shape"),
    ],
)
def test_bad_grids_are_one_sentence(make, words):
    with pytest.raises(InputError) as error:
        make()
    assert words in str(error.value)
    assert str(error.value).endswith(".")
