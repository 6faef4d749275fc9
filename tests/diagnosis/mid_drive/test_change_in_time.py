"""Change points of sizes by window, of which the truth is known."""

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.mid_drive.change_in_time import FEWEST_ASIDE, TimeRegression
from ddagr_gym.diagnosis.mid_drive.onsets import THRESHOLD, changes
from ddagr_gym.diagnosis.mid_drive.sizes import WindowSizes, sizes_of
from ddagr_gym.identification.spells import Spell

WINDOW = 2.0


def sizes(truth, rng, information=25.0, recording=None):
    """Sizes of windows that are known each by themselves."""
    count = len(truth)
    recording = np.zeros(count, dtype=np.int64) if recording is None else recording
    known = information * np.exp(0.5 * rng.normal(size=count))
    gradient = known * truth + np.sqrt(known) * rng.normal(size=count)
    start = WINDOW * np.concatenate([np.arange(np.count_nonzero(recording == k)) for k in np.unique(recording)])
    return WindowSizes(recording, start, start + WINDOW, gradient, np.diag(known))


def stepped(time, count=30, before=0.0, after=1.0):
    start = WINDOW * np.arange(count)
    share = np.clip((start + WINDOW - time) / WINDOW, 0.0, 1.0)
    return before + (after - before) * share


@pytest.mark.parametrize("time", [12.4, 31.0, 47.9])
def test_a_step_is_found_where_it_is(time):
    best = TimeRegression.of(sizes(stepped(time), np.random.default_rng(1))).best()
    assert changes(best)
    assert not best.line
    assert best.interval[0] <= time <= best.interval[1]
    assert best.interval[1] - best.interval[0] <= 3.0 * WINDOW
    assert best.before == pytest.approx(0.0, abs=4.0 * best.deviation[0])
    assert best.after == pytest.approx(1.0, abs=4.0 * best.deviation[1])


@pytest.mark.parametrize("gap", [0.0, 11.0])
def test_an_interval_reaches_over_the_gap_between_windows_in_which_a_step_may_lie(gap):
    """Windows that are compared are spread over a long drive: between two of them nothing is known."""
    found = sizes(np.arange(30) >= 15, np.random.default_rng(7), information=400.0)
    start = (WINDOW + gap) * np.arange(30)
    best = TimeRegression(replace(found, start=start, end=start + WINDOW)).best()
    low, high = best.interval
    assert low <= start[14] + WINDOW
    assert high >= start[15]
    # both windows that the edge may be of, the gap between them, and those beside them: there the sizes are the same
    assert high - low <= 2.0 * WINDOW + 3.0 * gap + 1e-9


def test_nine_in_ten_intervals_hold_a_weak_step():
    rng = np.random.default_rng(2)
    times = rng.uniform(15.0, 45.0, 60)
    found = [TimeRegression.of(sizes(stepped(t), rng, information=5.0)).best() for t in times]
    inside = [item.interval[0] <= t <= item.interval[1] for item, t in zip(found, times, strict=True) if changes(item)]
    assert len(inside) > 40
    assert np.mean(inside) >= 0.85


@pytest.mark.parametrize("count", [9, 30])
def test_a_constant_size_hardly_ever_changes(count):
    rng = np.random.default_rng(3)
    alarms = [changes(TimeRegression.of(sizes(np.ones(count), rng, information=3.0)).best()) for _ in range(60)]
    assert np.mean(alarms) <= 0.05


def test_scatter_by_window_counts_as_noise():
    """A size that differs from window to window, as one of another form does, is no change in time."""
    rng = np.random.default_rng(4)
    scattered = [sizes(1.0 + 0.4 * rng.normal(size=30), rng, information=400.0) for _ in range(40)]
    assert np.mean([changes(TimeRegression.of(item).best()) for item in scattered]) <= 0.05


def test_a_drift_is_a_line():
    best = TimeRegression.of(sizes(np.linspace(0.0, 2.0, 30), np.random.default_rng(5), information=40.0)).best()
    assert best.line
    assert changes(best)
    assert best.before == pytest.approx(0.0, abs=0.2)
    assert best.after == pytest.approx(2.0, abs=0.2)


def test_recordings_of_different_sizes_are_no_change_in_time():
    recording = np.repeat([0, 1], 15)
    truth = np.where(recording == 0, 0.2, 1.8)
    best = TimeRegression.of(sizes(truth, np.random.default_rng(6), recording=recording)).best()
    assert best.evidence < THRESHOLD


def test_the_recording_with_the_change_is_told():
    recording = np.repeat([0, 1], 15)
    truth = np.concatenate([np.zeros(15), stepped(16.5, 15)])
    best = TimeRegression.of(sizes(truth, np.random.default_rng(7), recording=recording)).best()
    assert changes(best)
    assert best.recording == 1
    assert best.interval[0] <= 16.5 <= best.interval[1]


def test_too_few_windows_say_nothing():
    assert TimeRegression.of(sizes(stepped(6.0, 7), np.random.default_rng(8))).best() is None
    assert FEWEST_ASIDE * 2 < 8


def test_anchored_sizes_are_nothing_where_the_effect_is_absent():
    """What every window shares moves all sizes together; taken as absent on one side, the other is the difference."""
    rng = np.random.default_rng(9)
    truth = sizes(stepped(30.0) - 0.5, rng)
    told = TimeRegression.of(truth).anchored(Spell(0, 30.0))
    before, after = told.around(TimeRegression.of(truth).best())
    assert before == pytest.approx(0.0, abs=0.05)
    early = [size for _, _, end, size, _ in told.in_stretches(2, 12) if end <= 30.0]
    assert np.mean(early) == pytest.approx(0.0, abs=0.05)
    assert after > 0.3


def test_sizes_are_those_of_the_joint_least_squares():
    """Equation (2) against one large least-squares problem of all sizes and shared parameters."""
    rng = np.random.default_rng(10)
    windows, rows, shared = 12, 20, 3
    column = rng.normal(size=(windows, rows))
    sensitivity = rng.normal(size=(windows, rows, shared))
    residual = rng.normal(size=(windows, rows)) + 0.7 * column
    precision, value = np.array([1.0, 0.0, 4.0]), np.array([0.3, 0.0, -0.2])
    time = WINDOW * np.arange(windows)
    found = sizes_of(residual, column, sensitivity, precision, value, np.zeros(windows, dtype=np.int64), time, WINDOW)
    whole = np.zeros((windows * rows, windows + shared))
    for w in range(windows):
        whole[w * rows : (w + 1) * rows, w] = column[w]
        whole[w * rows : (w + 1) * rows, windows:] = sensitivity[w]
    prior = np.zeros((shared, windows + shared))
    prior[:, windows:] = np.diag(np.sqrt(precision))
    right = np.concatenate([residual.ravel(), -np.sqrt(precision) * value])
    expected = np.linalg.lstsq(np.concatenate([whole, prior]), right, rcond=None)[0][:windows]
    np.testing.assert_allclose(np.linalg.solve(found.information, found.gradient), expected, rtol=1e-6)


def test_windows_in_which_an_effect_does_next_to_nothing_are_left_out():
    rng = np.random.default_rng(11)
    column = rng.normal(size=(10, 20)) * np.where(np.arange(10) < 4, 0.01, 1.0)[:, None]
    nothing = np.zeros((10, 20, 0))
    found = sizes_of(
        rng.normal(size=(10, 20)), column, nothing, np.zeros(0), np.zeros(0), np.zeros(10, dtype=np.int64),
        WINDOW * np.arange(10), WINDOW,
    )  # fmt: skip
    np.testing.assert_array_equal(found.start, WINDOW * np.arange(4, 10))
