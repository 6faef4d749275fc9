"""Gyro and accelerometer that rests or poses contradict are named by what they read, without a simulator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.result.inertial_findings import inertial_findings
from ddagr_gym.physics.effects.gyro_bias import GyroBias
from ddagr_gym.physics.effects.gyro_scale import GyroScale
from ddagr_gym.physics.effects.imu_tilt import ImuTilt
from ddagr_gym.recordings.schema import RobotGeometry
from tests.recordings.conftest import Faults, drive

GEOMETRY = RobotGeometry("warthog", 0.3, 0.54)


def found_in(*faults: Faults):
    drives = [drive(GEOMETRY, item, seed=seed) for seed, item in enumerate(faults)]
    return inertial_findings(drives, np.random.default_rng(0))


def test_a_sound_gyro_is_not_named():
    assert found_in(Faults()) == ()


@pytest.mark.parametrize(
    ("faults", "kind", "field", "size"),
    [
        (Faults(gyro_scale=1.1), GyroScale, "scale", 1.1),
        (Faults(gyro_scale=0.9, pose_latency=0.4), GyroScale, "scale", 0.9),
        (Faults(gyro_bias=0.05), GyroBias, "bias", 0.05),
    ],
)
def test_what_the_poses_contradict_is_named_with_its_size(faults, kind, field, size):
    ((finding, effect),) = found_in(faults)
    assert finding.name == kind.name == effect.name
    told = finding.parameters[field]
    assert told.value == getattr(effect, field) == pytest.approx(size, rel=0.1)
    low, high = told.interval
    assert low < size < high
    # it needed no fit, and passed no gate
    assert finding.gain == finding.gate == 0.0


def test_a_bias_is_that_at_rest_and_by_the_poses_where_the_robot_never_stands():
    standing = drive(GEOMETRY, Faults(gyro_bias=0.05))
    rolling = {name: standing[name] + 0.5 for name in ("encoder_right", "encoder_left")}
    never = replace(standing, channels={**standing.channels, **rolling})
    (at_rest,), (by_poses,) = (inertial_findings([given], np.random.default_rng(0)) for given in (standing, never))
    known, wide = (finding.parameters["bias"] for finding, _ in (at_rest, by_poses))
    assert known.value == pytest.approx(0.05, abs=5e-4)
    assert wide.value == pytest.approx(0.05, abs=5e-3)
    assert np.ptp(known.interval) < 0.5 * np.ptp(wide.interval)


def test_a_gyro_that_turns_the_wrong_way_has_no_scale():
    assert found_in(Faults(gyro_scale=-1.0)) == ()


@pytest.mark.parametrize("other", [Faults(), Faults(gyro_scale=0.85)])
def test_of_several_drives_all_must_say_so_to_one_side(other):
    assert found_in(Faults(gyro_scale=1.15), other) == ()


def test_an_interval_of_several_drives_holds_what_each_says():
    ((finding, _),) = found_in(Faults(gyro_scale=1.08), Faults(gyro_scale=1.25))
    scale = finding.parameters["scale"]
    assert scale.value == pytest.approx(1.165, rel=0.01)
    assert scale.interval[0] < 1.08
    assert scale.interval[1] > 1.25


@pytest.mark.parametrize(
    ("offset", "sizes"),
    [
        ((-0.5, 0.0), {"pitch": 0.051}),
        ((0.0, -0.4), {"roll": -0.0408}),
        ((0.6, 0.5), {"pitch": -0.0612, "roll": 0.0511}),
        ((-9.81 * np.sin(0.25), 9.81 * np.sin(-0.2) * np.cos(0.25)), {"pitch": 0.25, "roll": -0.2}),
    ],
)
def test_gravity_along_an_axis_of_the_robot_is_a_tilt_or_a_bias(offset, sizes):
    """A slope turns with the heading and is told from it."""
    ((finding, effect),) = found_in(Faults(force_offset=offset, slope=(0.8, -0.5)))
    assert isinstance(effect, ImuTilt)
    assert finding.equivalence_set == {"imu_tilt": 0.5, "accelerometer_bias": 0.5}
    assert {name: item.value for name, item in finding.parameters.items()} == pytest.approx(sizes, abs=1e-3)
    for name, item in finding.parameters.items():
        low, high = item.interval
        assert low < sizes[name] < high
        assert getattr(effect, name) == item.value


@pytest.mark.parametrize("others", [(Faults(),), (Faults(force_offset=(0.6, 0.0)),)])
def test_a_tilt_is_one_of_all_drives(others):
    assert found_in(Faults(force_offset=(-0.6, 0.0)), *others) == ()


@pytest.mark.parametrize("offset", [(-4.0, 0.0), (0.0, 9.9)])
def test_an_imu_on_its_side_is_no_tilt(offset):
    assert found_in(Faults(force_offset=offset)) == ()
