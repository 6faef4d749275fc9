"""Figures of ``ddagr estimate``: what joins, what is drawn."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.evaluation.estimate_panels import EstimateView, Line, Panel
from ddagr_gym.reporting.estimate_figures import _gapped, _limit, figure_count, save_estimate_figures

pytest.importorskip("matplotlib")


@pytest.fixture
def view():
    t = np.arange(0.0, 10.0, 0.1)
    wave = np.sin(t)
    reading = np.where(np.arange(t.size) % 3 == 0, wave, np.nan)
    lines = [Line("", wave, wave - 0.2, wave + 0.2, truth=0.5, reading=reading)]
    traces = [Line("soil", np.exp(-t)), Line("banks", np.exp(-2 * t))]
    panels = [Panel("speed", "Speed", "m/s", lines), Panel("trace", "Trace", "SI", traces, logarithmic=True)]
    innovations = np.column_stack([wave, np.full(t.size, np.nan)])
    return EstimateView(
        "a run", t, [(0, 40), (40, 100)], panels, {"estimated": np.column_stack([t, wave])}, innovations,
        ("yaw_rate", "encoder_left"), {"yaw_rate": (0.5, 0.8, 1.2)},
    )  # fmt: skip


def test_one_file_a_panel_and_three_more(view, tmp_path):
    done = []
    files = save_estimate_figures(view, tmp_path, "path", lambda: done.append(1))
    assert [path.name for path in files] == ["path.png", "speed.png", "trace.png", "innovations.png", "overview.png"]
    assert len(done) == len(files) == figure_count(view)
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in files)


def test_lines_do_not_cross_spans(view):
    t, values = _gapped(view, view.t)
    assert np.isnan(values).sum() == 2
    assert np.isnan(values[40])
    assert values[39] == view.t[39]
    assert values[41] == view.t[40]
    assert np.isfinite(t).all()


def test_wild_bands_leave_the_panel_and_estimates_fill_it():
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    value = np.linspace(0.0, 1.0, 50)
    wild = value + np.where(np.arange(50) == 0, 1e6, 0.1)
    _limit(axes, Panel("a", "a", "-", [Line("", value, value - 0.1, wild, truth=2.0)]))
    low, high = axes.get_ylim()
    assert -1.0 < low < 0.0
    assert 2.0 < high < 4.0
