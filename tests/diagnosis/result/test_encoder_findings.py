"""Encoders that poses and commands both contradict are named by what they read, without a simulator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.answer.verdict import Finding
from ddagr_gym.diagnosis.result.encoder_findings import encoder_findings, or_wheel_radius
from ddagr_gym.diagnosis.result.encoder_findings import with_encoders as with_encoders_named
from ddagr_gym.physics.effects.encoder_scale import EncoderScale
from ddagr_gym.physics.effects.pose_latency import PoseLatency
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


@pytest.mark.parametrize(("right", "left"), [(1.0, 1.0), (1.1, 1.1), (0.9, 0.9), (1.0, 1.2), (0.75, 0.75)])
def test_what_slip_and_motors_may_do_is_left_to_a_fit(right, left):
    assert found_in(with_encoders(right, left)) == ()


@pytest.mark.parametrize("travel", [0.5, 2.0])
def test_wheels_of_another_size_are_no_scale_of_encoders(travel):
    """Encoders that do what was commanded are right: it is the wheels that differ, or the ground."""
    assert found_in(with_encoders(1.0, 1.0, travel)) == ()


@pytest.mark.parametrize("scale", [12.0, 0.05])
def test_a_scale_that_no_simulator_has_is_not_named(scale):
    assert found_in(with_encoders(scale, scale)) == ()


@pytest.mark.parametrize("other", [1.0, 0.5, 3.0])
def test_all_drives_that_tell_must_say_the_same(other):
    wrong, sound = (with_encoders(scale, scale, seed=seed) for seed, scale in enumerate((2.0, other)))
    assert found_in(wrong, sound) == ()
    ((finding, _),) = found_in(wrong, with_encoders(2.0, 2.0, 0.92, seed=2))
    low, high = finding.parameters["right"].interval
    assert low < 2.0 < high
    assert high - low > 1.05 * np.ptp(found_in(wrong)[0][0].parameters["right"].interval)


def test_a_drive_that_cannot_tell_says_nothing_against_it():
    wrong, blind = (with_encoders(2.0, 2.0, seed=seed) for seed in range(2))
    without = replace(blind, channels={n: v for n, v in blind.channels.items() if not n.startswith("pose")})
    assert len(found_in(wrong, without)) == 1
    assert found_in(without) == ()


def test_commands_computed_with_another_wheel_radius_look_the_same_and_that_is_said():
    """Wheels half as large as the data sheet says, in a drive that was commanded by the body's speed."""
    made = with_encoders(1.0, 1.0, 0.5)
    halved = {name: 0.5 * made[name] for name in ("command_right", "command_left")}
    ((_, effect),) = found_in(replace(made, channels={**made.channels, **halved}))
    said = or_wheel_radius(effect, "warthog")
    assert f"the encoders read {effect.right:.2f} times" in said
    assert 1.9 < effect.right < 2.2
    assert "another wheel radius than that of warthog" in said


def test_what_a_fit_finds_on_top_goes_into_the_scales():
    found = found_in(with_encoders(2.0, 2.0))
    seen = found[0][1]
    late = (Finding.seen("pose_latency", {}), PoseLatency(0.3))
    others, (finding, effect) = with_encoders_named(found, [late, (None, EncoderScale(0.95, 0.8))])
    assert others == late
    assert (effect.right, effect.left) == pytest.approx((0.95 * seen.right, 0.8 * seen.left))
    assert [finding.parameters[name].value for name in ("right", "left")] == [effect.right, effect.left]
    assert finding.parameters["right"].interval == found[0][0].parameters["right"].interval
    # an interval always holds its value
    assert finding.parameters["left"].interval[0] == effect.left
    assert with_encoders_named((), [late]) == (late,)


def test_a_scale_that_a_fit_takes_beyond_a_simulator_ends_there():
    """Turns per minute that were taken for radians per second are 9.5 times too many."""
    found = found_in(with_encoders(8.5, 8.5))
    ((_, effect),) = with_encoders_named(found, [(None, EncoderScale(1.4, 1.4))])
    assert (effect.right, effect.left) == (10.0, 10.0)
