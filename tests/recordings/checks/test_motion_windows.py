"""Windows of motion lie between gaps: a pause of days costs nothing and speaks for nothing."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from ddagr_gym.diagnosis.preprocessing.mended_recordings import mend_recordings
from ddagr_gym.presets import get_robot
from ddagr_gym.recordings.checks.arbitration import arbitrated
from ddagr_gym.recordings.checks.blocks import cut_blocks
from ddagr_gym.recordings.checks.clock_offsets import ENCODER, POSE, RESPONSE
from ddagr_gym.recordings.checks.findings import Status
from ddagr_gym.recordings.checks.motion_windows import ENCODERS, STEP, motion_windows, stretches
from ddagr_gym.recordings.checks.run import check_recording
from ddagr_gym.recordings.schema import Recording, RobotGeometry

NO_OFFSETS = dict.fromkeys((RESPONSE, ENCODER, POSE))


@pytest.fixture(scope="module")
def whole(make_drive):
    return make_drive(seconds=60.0)


def paused(recording, pause):
    """The drive with a pause after its first half."""
    t = recording.t + pause * (np.arange(len(recording)) >= len(recording) // 2)
    return Recording.from_columns({**recording.columns(), "t": t}, recording.meta.geometry)


@pytest.mark.parametrize("pause", [1.0, 9e5])
def test_windows_leave_a_gap_out(whole, pause):
    without, found = motion_windows(whole, NO_OFFSETS), motion_windows(paused(whole, pause), NO_OFFSETS)
    middle = len(whole) // 2
    assert stretches(paused(whole, pause)) == (slice(0, middle), slice(middle, len(whole)))
    # Half as many windows fit twice, less those that would lie across the gap.
    assert len(without.block) - 6 <= len(found.block) < len(without.block)
    first = round((whole.t[middle - 1] - 2 * STEP) / (0.5 * STEP))
    np.testing.assert_allclose(found.turn[ENCODERS][:first], without.turn[ENCODERS][:first], atol=1e-9)
    assert np.nanmax(np.abs(found.forward[ENCODERS])) <= np.nanmax(np.abs(without.forward[ENCODERS])) + 1e-9


def test_a_short_hole_or_slow_rows_are_no_gap(whole):
    hole = paused(whole, 0.7)
    assert stretches(hole) == (slice(0, len(hole)),)
    slow = Recording.from_columns({"t": np.arange(40.0), "yaw_rate": np.zeros(40)})
    assert stretches(slow) == (slice(0, 40),)


def test_stretches_lie_inside_spans(whole):
    spans = ((0, 1000), (1000, len(whole)))
    assert stretches(whole.with_meta(spans=spans)) == (slice(0, 1000), slice(1000, len(whole)))


def test_a_pause_of_days_needs_no_more_memory_and_gives_the_same_answers(whole):
    tracemalloc.start()
    found = arbitrated(paused(whole, 9e5), np.random.default_rng(0))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 50e6  # windows over the pause would be 2.4 million, of 24 bytes for each channel
    expected = arbitrated(whole, np.random.default_rng(0))
    assert found.driving.majority == expected.driving.majority
    assert found.turning.majority == expected.turning.majority


def test_the_pause_is_a_finding_and_a_doubt(whole):
    report = check_recording(paused(whole, 9e5), np.random.default_rng(0))
    gaps = next(f for f in report.findings if (f.check, f.channel) == ("timing", "t, gaps"))
    assert gaps.status is Status.SUSPICIOUS
    assert any("no rows come for 9e+05 s after row 1500" in sentence for sentence in report.sentences)
    assert not any(f.check == "arbitration" for f in report.suspicious)


def seldom(t, spans=None):
    """A drive of which rows come only at these times [s]."""
    rng = np.random.default_rng(0)
    names = ("encoder_right", "encoder_left", "command_right", "command_left", "yaw_rate", "pose_x", "pose_y")
    columns = {"t": t, **{name: rng.uniform(0.0, 1.0, len(t)) for name in names}}
    return Recording.from_columns(columns, RobotGeometry.of(get_robot("husky")), spans=spans)


@pytest.mark.parametrize("period", [1.5, 2.0, 3.0])
def test_rows_that_come_seldom_are_no_error(period):
    slow = seldom(period * np.arange(20))
    windows = motion_windows(slow, NO_OFFSETS)
    assert windows is None or min(windows.block) >= 0
    said = next(f for f in check_recording(slow, np.random.default_rng(0)).findings if f.check == "arbitration")
    assert said.status is Status.NOT_TESTABLE
    assert windows is not None or "rows come too seldom" in said.meaning
    assert mend_recordings([slow]).names == ()


def test_windows_after_the_last_block_count_with_it():
    slow = seldom(np.r_[np.arange(20.0), 21.0, 23.0], ((0, 20), (20, 22)))
    blocks, windows = cut_blocks(slow), motion_windows(slow, NO_OFFSETS)
    assert blocks[-1].stop == 20
    assert windows.block.tolist()[-2:] == [len(blocks) - 1] * 2
