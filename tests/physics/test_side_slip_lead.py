"""A lead of the side slip moves the place about which a robot turns, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.identification.fitted_values import with_values
from ddagr_gym.parameters import Numerics, Sensors
from ddagr_gym.physics import layout
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import Simulator, build_row, simulate

ROBOT, SOIL = get_robot("ddagr"), get_soil("thesis_a1")
LEAD = 0.02


def turning(lead: float, right: float, left: float) -> tuple[float, float, float]:
    """Steady v_x, yaw rate, and how far ahead of the centre the robot turns."""
    columns = simulate(replace(ROBOT, side_slip_lead=lead), SOIL, np.tile([right, left], (500, 1)))
    v_x, v_y, rate = (columns[f"true_{name}"][-50:].mean() for name in ("v_x", "v_y", "yaw_rate"))
    return float(v_x), float(rate), float(-v_y / rate)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_the_turning_centre_moves_by_the_lead_in_the_direction_of_travel(direction: float) -> None:
    nominal = turning(0.0, 1.3 * direction, 0.5 * direction)
    moved = turning(LEAD, 1.3 * direction, 0.5 * direction)
    assert moved[2] - nominal[2] == pytest.approx(direction * LEAD, rel=0.03)
    assert moved[:2] == pytest.approx(nominal[:2], rel=2e-3)


def test_on_the_spot_both_sides_cancel() -> None:
    assert turning(LEAD, 0.6, -0.6)[2] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("lead", [-0.2, 0.2])
@pytest.mark.parametrize("seed", range(4))
def test_the_ground_gives_no_energy_to_locked_wheels(lead: float, seed: int) -> None:
    """Each wheel alone may gain some, four together lose: passive for leads below the wheelbase."""
    robot = replace(ROBOT, side_slip_lead=lead * ROBOT.outer_radius)
    v_x, v_y, rate = np.random.default_rng(seed).uniform(-1.0, 1.0, 3) * (0.3, 0.3, 1.0)
    start = {"v_x": v_x, "v_y": v_y, "yaw_rate": rate, "omega_right": 0.0, "omega_left": 0.0}
    drive = simulate(robot, SOIL, np.zeros((100, 2)), initial_state=start)
    energy = 0.5 * (
        robot.mass * (drive["true_v_x"] ** 2 + drive["true_v_y"] ** 2) + robot.yaw_inertia * drive["true_yaw_rate"] ** 2
    )
    assert (np.diff(energy) < 1e-9 * energy[0]).all()
    assert energy[-1] < 1e-3 * energy[0]


def test_where_the_side_slip_counts_is_kept_with_a_fit() -> None:
    robot, _ = with_values(replace(ROBOT, side_slip_lead=0.01), SOIL, {"side_slip_lead": 0.015})
    assert robot.side_slip_lead == pytest.approx(0.025)
    assert build_row(robot, SOIL, Sensors())[layout.SIDE_SLIP_LEAD] == pytest.approx(0.025)


def test_long_steps_of_the_integrator_agree_with_short_ones() -> None:
    """Extrapolated forces and the linear system know where the side slip counts."""
    robot = replace(ROBOT, side_slip_lead=0.05)
    commands = np.tile([1.2, -0.2], (1, 120, 1))
    ends = []
    for step in (0.01, 0.001):
        simulator = Simulator(1, numerics=replace(Numerics(), maximum_step=step))
        simulator.rows[:] = build_row(robot, SOIL, Sensors())
        simulator.reset()
        for k in range(commands.shape[1]):
            simulator.step(commands[:, k])
        ends.append(simulator.rows[0, layout.X : layout.OMEGA + 2].copy())
        simulator.close()
    np.testing.assert_allclose(ends[0], ends[1], atol=2e-4)
