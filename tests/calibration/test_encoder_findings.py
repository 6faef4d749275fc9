"""Encoders that poses and commands both contradict are named by what they read, without a simulator."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.calibration.encoder_findings import encoder_findings
from ddagr_gym.physics.effects.encoder_scale import EncoderScale
from ddagr_gym.recordings.schema import Recording, RobotGeometry
from tests.recordings.conftest import Faults, drive

GEOMETRY = RobotGeometry("warthog", 0.3, 0.54)


def with_encoders(right: float, left: float, travel: float = 1.0, seed: int = 0) -> Recording:
    return drive(GEOMETRY, Faults(right_scale=right, left_scale=left, travel=travel), seed=seed)


def found_in(*drives: Recording):
    return encoder_findings(drives, np.random.default_rng(0))


@pytest.mark.parametrize(("right", "left"), [(2.0, 2.0), (0.5, 0.5), (1.0, 2.0), (2.2, 1.4)])
def test_encoders_that_are_far_off_are_named_with_both_scales(right, left):
    ((finding, effect),) = found_in(with_encoders(right, left))
    assert finding.name == EncoderScale.name
    assert (effect.right, effect.left) == pytest.approx((right, left), rel=0.1)
    for name, scale in (("right", right), ("left", left)):
        told = finding.parameters[name]
        assert told.value == getattr(effect, name)
        assert told.interval[0] < scale < told.interval[1]


@pytest.mark.parametrize(("right", "left"), [(1.0, 1.0), (1.1, 1.1), (0.9, 0.9), (1.0, 1.2)])
def test_what_slip_and_motors_may_do_is_left_to_a_fit(right, left):
    assert found_in(with_encoders(right, left)) == ()


@pytest.mark.parametrize("travel", [0.5, 2.0])
def test_wheels_of_another_size_are_no_scale_of_encoders(travel):
    """Encoders that do what was commanded are right: it is the wheels that differ, or the ground."""
    assert found_in(with_encoders(1.0, 1.0, travel)) == ()


def test_all_drives_must_say_so():
    wrong, sound = (with_encoders(scale, scale, seed=seed) for seed, scale in enumerate((2.0, 1.0)))
    assert found_in(wrong, sound) == ()
    ((finding, _),) = found_in(wrong, with_encoders(2.0, 2.0, 0.92, seed=2))
    low, high = finding.parameters["right"].interval
    assert low < 2.0 < high
    assert high - low > 1.05 * np.ptp(found_in(wrong)[0][0].parameters["right"].interval)
