import math

import numpy as np
import pytest

from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.costs import (
    count_robot_stalls,
    count_stalls,
    headland_depth,
    slip_energy,
    wheel_quantities,
    wheel_speed_variation,
)
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import simulate

ROBOT = get_robot("ddagr")


def test_headland_depth_is_the_farthest_tyre_corner():
    """Turning on the circle, the outer front tyre's corner (0.33 + 0.2794, 0.58 + 0.1016) sweeps the farthest."""
    turn = RowTurn()
    outer = math.hypot(0.33 + 0.2794, 0.8 + 0.58 + 0.1016)
    path = turn.sample(0.01)
    assert headland_depth(path.x, path.y, path.yaw, ROBOT) == pytest.approx(outer, abs=1e-3)
    assert headland_depth([-5.0], [0.0], [0.0], ROBOT) == 0.0


def test_slip_energy_of_a_dragged_locked_wheel():
    t = np.linspace(0.0, 2.0, 51)
    wheel = {name: np.zeros((51, 4)) for name in ("force_y", "v_y", "yaw_moment", "yaw_rate", "axle_torque", "omega")}
    wheel["force_x"] = np.full((51, 4), -100.0)
    wheel["v_x"] = np.full((51, 4), 0.2)
    assert slip_energy(t, wheel) == pytest.approx(4 * 100.0 * 0.2 * 2.0)
    wheel["axle_torque"], wheel["omega"] = np.full((51, 4), 10.0), np.full((51, 4), 1.0)
    assert slip_energy(t, wheel) == pytest.approx(4 * (20.0 - 10.0) * 2.0)
    del wheel["omega"]
    with pytest.raises(InputError, match="wheel quantity 'omega' is missing"):
        slip_energy(t, wheel)


def test_wheel_speed_variation_of_a_triangle():
    t = np.linspace(0.0, 4.0, 401)
    assert wheel_speed_variation(t, np.abs(t - 2.0), np.ones_like(t)) == pytest.approx(1.0)


def test_stalls_are_counted_by_duration():
    t = np.arange(0.0, 10.0, 0.01)
    command = np.where(t < 8.0, 1.0, 0.05)
    speed = np.where((t > 1) & (t < 2), 0.05, 1.0) * np.where((t > 3) & (t < 3.4), 0.0, 1.0)
    speed = np.where((t > 5) & (t < 6), -1.0, speed)
    speed = np.where(t >= 8, 0.0, speed)
    assert count_stalls(t, command, speed, minimum_expected=0.1) == 2
    assert count_stalls(t, -command, -speed, minimum_expected=0.1) == 2
    assert count_stalls(t, command, speed, minimum_expected=0.01) == 3


def test_turning_on_the_spot_is_no_stall_but_spinning_wheels_are():
    t = np.arange(0.0, 5.0, 0.01)
    still = np.zeros_like(t)
    wheels = {"true_omega_right": still + 1.0, "true_omega_left": still - 1.0, "true_v_x": still, "true_v_y": still}
    assert count_robot_stalls(t, wheels | {"true_yaw_rate": still + 0.3}, ROBOT) == 0
    assert count_robot_stalls(t, wheels | {"true_yaw_rate": np.where(t < 2, 0.3, 0.001)}, ROBOT) == 1


def test_wheel_quantities_follow_the_body():
    still = np.zeros(3)
    columns = {"true_v_x": still + 0.2, "true_v_y": still, "true_yaw_rate": still + 0.5}
    columns |= {"true_omega_right": still + 1.0, "true_omega_left": still + 2.0}
    assert wheel_quantities(columns, ROBOT) is None
    names = ("force_x", "force_y", "yaw_moment", "axle_torque")
    columns |= {f"true_{name}_{wheel}": still + wheel for name in names for wheel in (1, 2, 3, 4)}
    wheels = wheel_quantities(columns, ROBOT)
    np.testing.assert_allclose(wheels["v_x"][0], [0.49, -0.09, 0.49, -0.09])
    np.testing.assert_allclose(wheels["v_y"][0], [0.165, 0.165, -0.165, -0.165])
    np.testing.assert_allclose(wheels["omega"][0], [1.0, 2.0, 1.0, 2.0])
    np.testing.assert_allclose(wheels["axle_torque"], np.tile([1.0, 2.0, 3.0, 4.0], (3, 1)))


def test_motors_pay_for_the_slip_energy_of_a_steady_simulated_turn():
    """At constant speed the soil takes all the power the axles bring: torque times speed, nothing to the body."""
    columns = simulate(ROBOT, get_soil("thesis_a1"), np.tile([1.2, 0.4], (900, 1)))
    steady = {name: values[600:] for name, values in columns.items()}
    wheels = wheel_quantities(steady, ROBOT)
    motors = -np.sum(wheels["axle_torque"] * wheels["omega"], axis=1)
    lost = slip_energy(steady["t"], wheels)
    assert lost > 0.0
    assert lost == pytest.approx(np.trapezoid(motors, steady["t"]), rel=1e-3)
