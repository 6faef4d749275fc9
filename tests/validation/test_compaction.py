"""The what-if without compaction resistance: what it takes away, and that it takes nothing else."""

import numpy as np
import pytest

from ddagr_gym.parameters import Numerics
from ddagr_gym.physics import layout, wheel_force
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import Simulator, simulate
from ddagr_gym.validation.compaction import NoCompactionResistance

ROBOT, SOIL = get_robot("ddagr"), get_soil("dry_sand_lll_0")
MOTION = {"v_x": 0.2, "v_y": -0.02, "yaw_rate": 0.2, "omega_right": 1.1, "omega_left": 0.6}


def _row(effects):
    simulator = Simulator(1, numerics=Numerics(), effects=effects)
    simulator.configure(0, ROBOT, SOIL)
    simulator.reset(state=MOTION)
    return simulator.rows[0]


@pytest.mark.parametrize("share", [0.4, 1.0])
def test_horizontal_pressure_is_cancelled_and_nothing_else(share):
    plain, without = _row(()), _row((NoCompactionResistance(share),))
    slick = SOIL.with_values(cohesion=0.0, friction_angle=0.0)
    for i in range(4):
        motion = [plain[at + i] for at in (layout.WHEEL_V_X, layout.WHEEL_V_Y, layout.WHEEL_OMEGA)]
        pressure = wheel_force(ROBOT.wheels[i], slick, *motion, MOTION["yaw_rate"], plain[layout.SINKAGE + i]).force[0]
        assert pressure < -1.0
        change = without[layout.FORCE_X + i] - plain[layout.FORCE_X + i]
        assert change == pytest.approx(-share * pressure, rel=1e-9)
    for block in (layout.FORCE_Y, layout.FORCE_Z, layout.YAW_MOMENT, layout.AXLE_TORQUE, layout.SINKAGE):
        np.testing.assert_array_equal(without[block : block + 4], plain[block : block + 4])


def test_robot_then_drives_almost_without_slip():
    commands = np.tile([0.7, 0.7], (500, 1))
    rim = 0.7 * ROBOT.wheels[0].outer_radius
    assert simulate(ROBOT, SOIL, commands)["true_v_x"][-1] < 0.95 * rim
    free = simulate(ROBOT, SOIL, commands, effects=[NoCompactionResistance()])
    assert free["true_v_x"][-1] == pytest.approx(rim, rel=0.02)
