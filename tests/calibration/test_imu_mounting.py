"""How an IMU is mounted is found from its accelerometer, and not where there is nothing to find."""

from dataclasses import replace

import numpy as np
import pytest

import ddagr_gym
from ddagr_gym.calibration.imu_mounting import LEAST, Readings, mounting_from
from ddagr_gym.calibration.simulator_values import mounting_effects
from ddagr_gym.parameters import STANDARD_GRAVITY
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects.imu_lever_arm import ImuLeverArm
from ddagr_gym.physics.effects.imu_misalignment import ImuMisalignment
from ddagr_gym.physics.effects.imu_tilt import ImuTilt
from ddagr_gym.presets import get_robot, get_soil

BIASES = {0: (0.05, -0.1), 1: (-0.15, 0.1), 2: (0.1, 0.02), 3: (-0.02, 0.05)}
"""Of the drives [m/s^2]."""

NOISE = 0.1
"""Of a mean over a quarter of a second on rough ground [m/s^2]."""


COUNT = 200
"""Readings of a drive: 50 s."""


def motions(rng, count):
    """(N, 4) specific force, yaw acceleration and yaw rate of a robot that starts, stops and turns."""
    rate = rng.normal(0.0, 0.5, count)
    return np.stack([rng.normal(0.0, 0.4, count), 0.4 * rate, rng.normal(0.0, 0.8, count), rate], axis=1)


def readings(effects=(), tilt=0.0, drives=4):
    """Of effects of the library on the motion, by the simulator's own kernels."""
    rng = np.random.default_rng(3)
    motion, group = motions(rng, COUNT * drives), np.repeat(np.arange(drives), COUNT)
    measured = motion[:, :2] + rng.normal(0.0, NOISE, (len(motion), 2)) - tilt * np.array([STANDARD_GRAVITY, 0.0])
    measured += np.array([BIASES[g] for g in group.tolist()])
    row = np.zeros(layout.SIZE)
    row[layout.ACCELEROMETER_SCALE : layout.ACCELEROMETER_SCALE + 2] = 1.0
    for number, (force_x, force_y, change, rate) in enumerate(motion):
        row[layout.YAW_RATE], row[layout.MEAN_YAW_ACCELERATION] = rate, change
        row[layout.READING : layout.READING + 2] = force_x, force_y
        for effect in effects:
            for _, action in effect.acting:
                action(row, effect.vector(), np.zeros(8))
        measured[number] += row[layout.READING : layout.READING + 2] - motion[number, :2]
    return Readings(measured, motion, group)


def sizes(found):
    return {item.name: item for item in found.sizes}


def test_what_effects_of_the_library_do_is_found():
    truth = (ImuLeverArm(0.6, -0.3), ImuMisalignment(0.2))
    found = mounting_from(readings(truth), 4)
    named = sizes(found)
    for name, true in {"imu_x": 0.6, "imu_y": -0.3, "imu_yaw": 0.2}.items():
        item = named[name]
        assert item.kept
        half = 0.5 * (item.interval[1] - item.interval[0])
        # one in a hundred normal errors is beyond 1.6 half widths of a 90 % interval
        assert abs(item.value - true) < 1.6 * half < 0.16
        assert item.growth > 2.0 * item.error > 0.0
    assert found.after < 0.8 * found.before
    arm, turned = mounting_effects(found)
    assert (arm.x, arm.y, turned.yaw) == tuple(named[name].value for name in ("imu_x", "imu_y", "imu_yaw"))


def test_an_imu_that_is_mounted_as_stated_stays_so():
    found = mounting_from(readings(), 4)
    assert not any(item.kept for item in found.sizes)
    assert all(item.value == 0.0 and item.interval is None and item.helps for item in found.sizes)
    assert mounting_effects(found) == mounting_effects(None) == ()


def test_a_tilt_is_what_all_drives_have_in_common():
    """Noses down by 4 degrees: gravity reads backwards. Grounds of the drives slope by another degree each way."""
    found = mounting_from(readings(tilt=0.07), 4)
    pitch = sizes(found)["imu_pitch"]
    assert pitch.kept
    assert pitch.interval[0] < 0.07 < pitch.interval[1]
    assert not sizes(found)["imu_roll"].kept
    (tilt,) = mounting_effects(found)
    assert tilt == ImuTilt(0.0, pitch.value)
    assert pitch.value > LEAST["imu_pitch"]


def test_one_drive_does_not_tell_a_tilt_from_a_bias():
    """What its quarters read too much alike is a bias, or the ground that it drove on."""
    alike = readings(tilt=0.07)
    found = sizes(mounting_from(alike, 1))
    assert not any(found[name].kept for name in ("imu_roll", "imu_pitch"))
    assert "several drives" in found["imu_pitch"].helps
    assert sizes(mounting_from(alike, 4))["imu_pitch"].kept


def test_a_place_that_is_too_near_to_matter_is_not_kept():
    found = sizes(mounting_from(readings((ImuLeverArm(0.05, 0.0),)), 4))
    assert not found["imu_x"].kept


def test_halves_of_one_drive_judge_each_other():
    found = sizes(mounting_from(readings((ImuMisalignment(0.2),), drives=2), 1))
    assert found["imu_yaw"].kept
    assert found["imu_yaw"].interval[0] < 0.2 < found["imu_yaw"].interval[1]


@pytest.mark.parametrize("effect", [ImuLeverArm(0.5, 0.2), ImuMisalignment(-0.15)])
def test_the_simulator_reads_a_mounting_as_its_effects_do(effect):
    """A robot file with a sensor elsewhere and the effect on one at the origin are the same."""
    robot, soil = get_robot("ddagr"), get_soil("thesis_a1")
    place = (effect.x, effect.y) if isinstance(effect, ImuLeverArm) else (0.0, 0.0)
    yaw = effect.yaw if isinstance(effect, ImuMisalignment) else 0.0
    commands = np.tile([1.2, 0.3], (100, 1))
    imu = ddagr_gym.parameters.Imu(50.0, 0.0, 0.0, 0.0, position=place, mounting_yaw=yaw)
    level = replace(imu, position=(0.0, 0.0), mounting_yaw=0.0)
    stated, missing = (
        ddagr_gym.simulator.simulate(robot, soil, commands, sensors=ddagr_gym.parameters.Sensors(item), effects=e)
        for item, e in ((imu, ()), (level, (effect,)))
    )
    for name in ("specific_force_x", "specific_force_y"):
        np.testing.assert_allclose(stated[name], missing[name], atol=1e-3)
