"""Recordings without poses have a heading each, which turns the first guess of their windows and nothing else."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.identification.headings import headings_matter, turned_starts, without_poses
from ddagr_gym.identification.parameters import command_shift, heading_parameters
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.windows import STATE, WindowSet
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.recordings.schema import Recording

POSE = [STATE.index(name) for name in ("x", "y", "yaw")]
PARAMETERS = (command_shift(0.02), *heading_parameters((1, 2), math.pi))
NAMES = [parameter.name for parameter in PARAMETERS]


def windows() -> WindowSet:
    """Five windows of three recordings, at places and headings of their own."""
    recording = np.array([0, 1, 1, 2, 2])
    none = np.zeros((5, 1, 2))
    initial = np.random.default_rng(3).normal(size=(5, len(STATE)))
    return WindowSet(0.02, recording, np.arange(5), np.arange(5.0), none, 0, np.zeros((5, 1, 8)), initial)


def values(**given: float) -> np.ndarray:
    return np.array([given.get(name, 0.0) for name in NAMES])


@pytest.fixture(scope="module")
def unfollowed(drive: Callable[..., Recording], problem_of: Callable[..., Problem]) -> Problem:
    """Two short drives without poses."""
    return problem_of(*(drive(seconds=8.0, seed=seed, poses=False) for seed in (1, 2)))


def headings(problem: Problem) -> list[str]:
    return [p.name for p in problem.nuisances.parameters if p.heading]


def test_a_receiver_that_says_nothing_is_none(drive: Callable[..., Recording]) -> None:
    followed, silent = drive(seconds=1.0), drive(seconds=1.0, poses=False)
    headless = replace(followed, channels={k: v for k, v in followed.channels.items() if k != "pose_yaw"})
    assert without_poses((followed, silent, followed, headless)) == (1, 3)


def test_a_recording_turns_about_its_own_start() -> None:
    before = windows()
    after = turned_starts(before, PARAMETERS, values(heading_2=math.pi / 2.0))
    others = before.recording != 1
    np.testing.assert_array_equal(after[others], before.initial[others])
    x, y, yaw = before.initial[~others][:, POSE].T
    np.testing.assert_allclose(after[~others][:, POSE], np.stack([-y, x, yaw + math.pi / 2.0], axis=1), atol=1e-12)
    np.testing.assert_array_equal(after[:, 3:], before.initial[:, 3:])


def test_where_nothing_has_poses_the_first_drive_is_the_world(unfollowed: Problem) -> None:
    assert headings(unfollowed) == ["heading_2"]


def test_where_one_drive_has_poses_it_is_the_world(
    drive: Callable[..., Recording], problem_of: Callable[..., Problem]
) -> None:
    silent = drive(seconds=8.0, poses=False)
    assert headings(problem_of(drive(seconds=8.0))) == []
    mixed = problem_of(silent, drive(seconds=8.0), silent)
    assert headings(mixed) == ["heading_1", "heading_3"]


def test_a_heading_matters_where_the_ground_has_a_direction() -> None:
    assert not headings_matter(load_effects("gyro_scale=1.1"))
    assert headings_matter(load_effects("slope=0.1"))
    assert not headings_matter(load_effects("soil_patch=0.5"))


def test_sensitivities_to_a_heading_are_those_of_its_own_windows_on_this_ground(unfollowed: Problem) -> None:
    names = [parameter.name for parameter in unfollowed.nuisances.parameters]
    place = names.index("heading_2")
    flat = unfollowed.start()
    blank = np.zeros((*unfollowed.blocked.mask.shape, len(names)))
    of_a_slope = np.ones_like(blank)
    assert not unfollowed.heading_columns(flat, of_a_slope)[..., place].any()
    assert np.delete(unfollowed.heading_columns(flat, of_a_slope), place, axis=2).all()
    sloping = replace(flat, effects=load_effects("slope=0.1"))
    base = unfollowed.predict(sloping)
    columns = unfollowed.heading_columns(sloping, blank)
    assert not blank.any()
    own = unfollowed.blocked.windows.recording == 1
    assert not columns[~own].any()
    assert not np.delete(columns, place, axis=2).any()
    values = sloping.values + np.where(np.arange(len(names)) == place, 0.1, 0.0)
    turned = unfollowed.predict(unfollowed.moved(sloping, values))
    change = unfollowed.blocked.means(turned - base)[own]
    left = change - 0.1 * columns[own, :, place]
    assert np.abs(left).max() < 0.2 * np.abs(change).max()
