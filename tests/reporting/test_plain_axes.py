"""Ticks are plain numbers, and axes reach as far as what they show."""

from __future__ import annotations

import pytest

from ddagr_gym.diagnosis.answer.onset import TimedSize
from ddagr_gym.reporting.figures import blank_figure
from ddagr_gym.reporting.onset_figure import size_limits
from ddagr_gym.reporting.plain_axes import plain_log, plain_symlog, symlog_ticks

pytest.importorskip("matplotlib", reason="needs the extra report")


def axis_of(*values: float):
    axis = blank_figure(2.0).subplots()
    axis.plot(values, [0.0] * len(values), "o")
    return axis


def labels(axis) -> list[str]:
    axis.figure.canvas.draw()
    low, high = axis.get_xlim()
    return [tick.get_text() for tick in axis.get_xticklabels(which="both") if low <= tick.get_position()[0] <= high]


def test_an_axis_that_is_linear_near_zero_has_plain_ticks_on_both_sides():
    axis = axis_of(-3.0, 30.0)
    plain_symlog(axis, 2.0, 30.0)
    assert labels(axis)[-5:] == ["1", "2", "5", "10", "20"]
    assert "−1" in labels(axis)
    few = axis_of(-1.0, 1.0)
    plain_symlog(few, 2.0, 1.0)
    assert few.get_xscale() == "linear"
    assert symlog_ticks(2.0, 3e4) == [1.0, 2.0, 10.0, 100.0, 1e3, 1e4]


@pytest.mark.parametrize("values", [(0.3, 0.42), (0.9, 7.0), (0.01, 300.0)])
def test_a_logarithmic_axis_has_two_plain_ticks_or_more(values):
    axis = axis_of(*values)
    plain_log(axis)
    found = [text for text in labels(axis) if text]
    assert len(found) >= 2
    assert all(float(text) > 0.0 for text in found)


def test_sizes_by_time_fill_their_axis():
    def sizes(*values: float) -> list[TimedSize]:
        return [TimedSize(0, 6.0 * k, 6.0 * k + 6.0, value, 0.01) for k, value in enumerate(values)]

    low, high = size_limits(sizes(1.0, 1.02))
    assert 0.85 < low < 0.9
    assert 1.1 < high < 1.15
    low, high = size_limits(sizes(0.1, 1.0))
    assert low < 0.0 < 1.0 < high
    assert size_limits(sizes(-40.0, 40.0)) == (-1.5, 2.5)
