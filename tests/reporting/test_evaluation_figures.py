"""Figures of an evaluation: what they draw, by the numbers in their artists."""

import numpy as np
import pytest

from ddagr_gym.presets import ddagr
from ddagr_gym.reporting import evaluation_figures as figures
from ddagr_gym.reporting import evaluation_paths as paths
from ddagr_gym.reporting.figures import house_style

from .evaluation_example import evaluation, rows_of

pytest.importorskip("matplotlib", reason="needs the extra report")


@pytest.fixture(autouse=True)
def _style():
    with house_style():
        yield


def markers(axes, kind):
    return [line.get_xydata()[0] for line in axes.lines if line.get_marker() == kind and len(line.get_xydata())]


def test_medians_and_percentiles_stand_where_the_summary_says():
    figure = figures.error_figure(evaluation())
    first, second = figure.axes
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["S1", "T"]
    assert [label.get_text() for label in first.get_yticklabels()] == ["B1", "B4", "ppo_ekf", "true_path"]
    # median of B1: |e_R| of 9, 5, 4, 6, infinity, 3 %, the third smallest; its percentile is the failure
    assert markers(first, "o")[0] == pytest.approx([5.0, -0.13])
    assert [list(mark) for mark in markers(first, ">")] == [pytest.approx([figures._FAILED, 0.13])]
    assert len(markers(second, "o")) == 4  # two arms drove T


def test_signed_errors_keep_their_sign_and_stay_inside():
    figure = figures.signed_figure(evaluation())
    middle = markers(figure.axes[0], "o")
    assert middle[0][0] == pytest.approx(-3.0)  # -9, -4, -3, 5, 6 %, and no radius: the third
    assert max(point for line in figure.axes[0].lines for point in line.get_xdata()) <= 30.0


def test_probabilities_of_both_baselines_stand_apart():
    figure = figures.improvement_figure(evaluation())
    dots = {tuple(np.round(mark, 2)) for mark in markers(figure.axes[0], "o")}
    assert (100.0, 0.87) in dots  # B4 is closer than B1 on each of the six
    assert not any(place == 1.13 for _, place in dots)  # and is not compared with itself


def test_bounds_are_grey_and_the_best_arm_stands_out():
    colours = figures.arm_colours(evaluation())
    assert colours["true_path"] == figures.palette.GREY
    assert colours["ppo_ekf"] == figures.palette.VERMILLION
    assert len(set(colours.values())) == 4


def test_the_readme_picture_is_the_same_every_time(tmp_path):
    first = figures.radius_error_figure(evaluation(), tmp_path / "a.png")[0].read_bytes()
    assert first == figures.radius_error_figure(evaluation(), tmp_path / "b.png")[0].read_bytes()


def test_the_diamond_is_the_tolerance_of_the_furrow():
    figure = paths.exit_figure(evaluation(), ddagr())
    outline = figure.axes[0].patches[0].get_xy()
    lateral, heading = outline[:, 0] / 1e3, np.radians(outline[:, 1])
    sizes = np.abs(lateral) + ddagr().half_wheelbase * np.abs(np.sin(heading))
    assert sizes == pytest.approx(np.full(len(sizes), 0.127))


def test_exits_of_right_turns_are_mirrored():
    found = evaluation(rows=rows_of("B4", [0.02, -0.02]))
    axes = paths.exit_figure(found, ddagr()).axes[0]
    points = np.concatenate([line.get_xydata() for line in axes.lines if line.get_marker() == "o"])
    # left: 32 mm to the left of its row; right: as far to the right; both are short of it
    assert points[:, 0] == pytest.approx([-32.0, -32.0])
    assert points[:, 1] == pytest.approx([np.degrees(0.02)] * 2)


def test_turns_of_another_radius_lie_on_the_commanded_circle():
    figure = paths.path_figure(evaluation(), ddagr())
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["B1", "ppo_ekf"]
    drawn = figure.axes[0].lines[-2].get_xydata()
    assert drawn == pytest.approx(evaluation().drives[0].path)


def test_estimates_are_laid_over_the_truth():
    axes = paths.estimate_figure(evaluation().tracked, ddagr()).axes[0]
    labels = [line.get_label() for line in axes.lines]
    assert {"true", "estimated", "commanded"} <= set(labels)
    estimate = axes.lines[labels.index("estimated")].get_xydata()
    assert estimate == pytest.approx(evaluation().tracked[0].path * 1.01)
    assert "1.3 %" in axes.texts[0].get_text()
