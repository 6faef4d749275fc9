"""Rows that come in bursts: how often, and from when on rows are missing."""

from __future__ import annotations

from array import array
from pathlib import Path

import numpy as np
import pytest

from ddagr_gym.recordings.checks.findings import Status
from ddagr_gym.recordings.checks.timing import timing
from ddagr_gym.recordings.files import DEFAULT_LIMITS
from ddagr_gym.recordings.row_times import in_bursts, longest_period, row_period, uneven
from ddagr_gym.recordings.schema import Recording, split_at_gaps
from ddagr_gym.recordings.streams import Samples, assemble
from ddagr_gym.recordings.topic_map import Topic, TopicMap, TopicSource


def bursts(count=200, size=5, between=0.04, inside=2e-4):
    """Stamps of batches that are handed over at once."""
    return (between * np.arange(count)[:, None] + inside * np.arange(size)).ravel()


@pytest.mark.parametrize("size", [2, 5, 15])
def test_rows_in_bursts_are_one_segment_at_the_mean_period(size):
    t = bursts(size=size, between=0.008 * size)
    assert in_bursts(np.diff(t))
    assert split_at_gaps(t, ((0, t.size),)) == ((0, t.size),)
    recording = Recording.from_columns({"t": t, "yaw_rate": np.sin(t)})
    assert recording.period == pytest.approx(0.008, rel=0.01)
    assert recording.rate("yaw_rate") == pytest.approx(125, rel=0.01)


def test_batches_that_are_lost_are_a_gap():
    t = bursts()
    t = t[(t < 2.0) | (t > 2.15)]
    (first, second) = split_at_gaps(t, ((0, t.size),))
    assert (t[first[1]] - t[first[1] - 1]) > 0.15
    assert second[1] == t.size


def lossy(share, seed=0):
    return np.flatnonzero(np.random.default_rng(seed).random(4000) > share) * 0.02


@pytest.mark.parametrize(
    "t",
    [
        np.arange(500) * 0.02,
        np.arange(500) * 0.02 + 0.004 * np.random.default_rng(0).random(500),
        lossy(0.05),
        lossy(0.2),
        lossy(0.45),
        np.concatenate([20.0 * i + np.arange(10) * 0.05 for i in range(40)]),  # ten rows, then seconds of nothing
        np.concatenate([0.3 * i + np.arange(4) * 0.02 for i in range(80)]),  # two thirds of the rows are lost
        np.arange(3) * 0.02,
        np.array([0.0, 1e-4, 0.04]),
    ],
)
def test_rows_that_are_lost_are_no_bursts_and_keep_their_median(t):
    steps = np.diff(t)
    assert not in_bursts(steps)
    assert row_period(steps) == longest_period(steps) == float(np.median(steps))


def test_no_steps_have_no_period():
    assert np.isnan(row_period(np.empty(0)))
    assert np.isnan(longest_period(np.empty(0)))
    assert not uneven(np.empty(0))


def test_bursts_are_said_and_are_no_lost_data():
    t = bursts()
    columns = {
        "t": t,
        "yaw_rate": np.sin(t),
        "encoder_right": np.full(t.size, 2.0),
        "encoder_left": np.full(t.size, 2.0),
    }
    found = {(f.check, f.channel): f for f in timing(Recording.from_columns(columns))}
    assert found["timing", "t, gaps"].value == 0.0
    assert found["timing", "t, jitter"].status is Status.SUSPICIOUS
    assert "in bursts of about 5, 0.0392 s apart, and at 125" in found["timing", "t, jitter"].meaning
    assert "own stamps" in found["timing", "t, jitter"].remedy
    assert found["wait", "yaw_rate, share"].status is Status.PASS
    assert found["rate", "yaw_rate"].value == pytest.approx(125, rel=0.01)


@pytest.mark.parametrize("late", [0.001, 0.003, 0.005, 0.0079])
def test_tables_merged_on_time_are_judged_by_their_fastest_sensor(late):
    imu, wheels, commands = np.arange(2000) * 0.016, np.arange(2000) * 0.016 + late, np.arange(640) * 0.05 + 0.0011
    t = np.unique(np.concatenate([imu, wheels, commands]))
    columns = {"t": t, "yaw_rate": np.where(np.isin(t, imu), 0.3, np.nan)}
    columns |= {f"encoder_{bank}": np.where(np.isin(t, wheels), 0.0, np.nan) for bank in ("right", "left")}
    columns |= {f"command_{bank}": np.where(np.isin(t, commands), 0.0, np.nan) for bank in ("right", "left")}
    found = {f.channel: f for f in timing(Recording.from_columns(columns)) if f.check == "timing"}
    assert found["t, gaps"].value == 0.0
    assert found["t, jitter"].status is Status.PASS
    lost = {name: np.delete(values, np.flatnonzero((t > 10) & (t < 14))) for name, values in columns.items()}
    found = {f.channel: f for f in timing(Recording.from_columns(lost)) if f.check == "timing"}
    assert found["t, gaps"].status is Status.SUSPICIOUS
    assert found["t, gaps"].value == pytest.approx(4 / 32, abs=0.005)
    assert "merged on time, of which yaw_rate comes at 62.5 Hz" in found["t, jitter"].meaning


def test_samples_find_rows_that_come_in_bursts():
    """Within half of the time between bursts, as within half a period elsewhere."""
    stamps = {"imu": bursts(), "pose": np.arange(0.02, 7.9, 0.2)}
    kinds = {"imu": ("Imu", "yaw_rate"), "pose": ("Odometry", "pose_x")}
    samples = {
        role: Samples(lambda message: None, array("d", t), array("d", t), {kinds[role][1]: array("d", t)})
        for role, t in stamps.items()
    }
    chosen = {role: Topic(f"/{role}", kinds[role][0], len(t)) for role, t in stamps.items()}
    topics = TopicMap({role: TopicSource(f"/{role}") for role in stamps})
    recording = assemble(Path("run.mcap"), topics, chosen, samples, None, DEFAULT_LIMITS)
    assert np.count_nonzero(np.isfinite(recording["pose_x"])) == stamps["pose"].size
