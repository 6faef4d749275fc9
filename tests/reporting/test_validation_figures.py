"""Figures of the validation: written whole, and showing the data that they are given."""

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from ddagr_gym.reporting.validation_figures import single_wheel_figure, turn_comparison_figure


def _trials():
    slip, angle, _ = (a.ravel() for a in np.meshgrid([-0.5, 0.0, 0.5], [0.0, 30.0], [1, 2]))
    rng = np.random.default_rng(0)
    return {
        "rim_command": np.round(0.01 * (1 + slip), 6), "slip": slip, "slip_angle": np.radians(angle),
        "load": np.full(slip.shape, 20.0), "drawbar": rng.normal(0, 5, slip.size),
        "lateral": rng.normal(8, 5, slip.size), "sinkage": rng.uniform(0.01, 0.05, slip.size),
    }  # fmt: skip


def test_single_wheel_figure_shows_points_and_curves(tmp_path):
    trials = _trials()
    curve = {name: trials[name] for name in ("drawbar", "lateral", "sinkage")}
    png, svg = single_wheel_figure(trials, {"model": curve, "FIT": curve}, tmp_path / "wheel")
    assert png.stat().st_size > 20_000
    text = svg.read_text()
    assert text.count("measured") >= 1
    assert text.rstrip().endswith("</svg>")
    again = single_wheel_figure(trials, {"model": curve, "FIT": curve}, tmp_path / "again")
    assert again[0].read_bytes() == png.read_bytes()
    moved = trials | {"drawbar": trials["drawbar"] + 5.0}
    other = single_wheel_figure(moved, {"model": curve, "FIT": curve}, tmp_path / "other")
    assert other[0].read_bytes() != png.read_bytes()


def test_turn_comparison_figure_shows_every_variant(tmp_path):
    rng = np.random.default_rng(1)
    reference = {
        "yaw_rate": rng.uniform(0, 1, 6), "v_x": rng.uniform(0, 1, 6), "slip": rng.uniform(-1, 1, (6, 2)),
        "sinkage": rng.uniform(0.01, 0.05, (6, 4)),
    }  # fmt: skip
    reference["slip"][0, 1] = np.nan
    half = {name: 0.5 * values for name, values in reference.items()}
    soils = ["sand", "loam"] * 3
    png, svg = turn_comparison_figure(
        soils, reference, {"model": half, "other": reference}, tmp_path / "turns", reference_name="SCM"
    )
    assert png.stat().st_size > 20_000
    one, _ = turn_comparison_figure(soils, reference, {"model": half}, tmp_path / "one", reference_name="SCM")
    assert one.read_bytes() != png.read_bytes()
    assert svg.read_text().rstrip().endswith("</svg>")
