"""Figures of an evaluation: radius errors, profiles and improvements, by controller and scenario set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ddagr_gym.evaluation.report_data import Arm, Evaluation, best_arm, display_name
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import COLOURS, house_style, save_figure

ROW_HEIGHT = 0.2
"""Of one arm in a figure [inch]."""

BASELINE_COLOURS = {"B1": palette.BLUE, "B4": palette.ORANGE}
_LEAST, _MOST, _FAILED = 0.1, 100.0, 170.0
"""Ends of the axis of |e_R|, and the place of a failure [%]."""
_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Of the bars: the thin one spans the outer two, the thick one the quartiles, the mark is the median."""

_SIGNED_LIMIT = 0.30
"""Of the axis of the signed radius error [-]; larger errors are drawn at its ends (ours)."""

_POINTS = 400
"""Episodes of an arm that are drawn as points, about (ours: more only cover each other)."""

_MOST_LINES = 9
"""Curves in one picture, at most (ours: more cannot be distinguished by colour)."""


def arm_colours(evaluation: Evaluation) -> dict[str, str]:
    """Bounds grey, the best and the headline strong, ablations and others in turn."""
    colours = {}
    best = best_arm(evaluation)
    strong = [name for name in (best.name if best else "", evaluation.headline) if name]
    cycle = iter(COLOURS[k % len(COLOURS)] for k in range(10_000) if COLOURS[k % len(COLOURS)] != palette.VERMILLION)
    for arm in evaluation.arms:
        if not arm.deployable:
            colours[arm.name] = palette.GREY
        else:
            colours[arm.name] = palette.VERMILLION if strong and arm.name == strong[0] else next(cycle)
    return colours


def radius_error_figure(evaluation: Evaluation, path: str | Path) -> tuple[Path, Path]:
    """Every turn radius error on the judged set by arm, with quantiles; PNG and SVG, for a README.

    Args:
        evaluation: what was driven.
        path: where, with or without a suffix.

    Returns:
        Paths of the PNG and of the SVG.
    """
    with house_style():
        from matplotlib.figure import Figure

        arms = _driven(evaluation, evaluation.judged)
        figure = Figure(figsize=(7.4, 0.9 + 0.26 * len(arms)), layout="constrained")
        axes = figure.subplots()
        colours = arm_colours(evaluation)
        for place, arm in enumerate(arms):
            _strip(axes, place, evaluation.rows_of(arm.name, evaluation.judged), colours[arm.name])
        count = next(item.driven for item in evaluation.sets if item.name == evaluation.judged)
        axes.set_title(
            f"Turn radius error on the {count} scenarios of {evaluation.judged}: median, quartiles, 5 to 95 %"
        )
        _arm_axis(axes, arms)
        _signed_axis(axes)
        axes.set_xlabel("turn radius error [%]; at the edge: beyond it, or no radius")
        return save_figure(figure, path)


def _strip(axes: Any, place: int, rows: Sequence[Mapping[str, Any]], colour: str) -> None:
    limit = 100.0 * _SIGNED_LIMIT
    every = rows[:: max(1, len(rows) // _POINTS)]
    errors = np.array([100.0 * _signed(row) for row in every])
    # spread by rank, so that the same data give the same picture
    aside = 0.2 * np.sin(2.4 * np.arange(errors.size))
    axes.plot(
        np.clip(errors, -limit, limit), place + aside, "o", color=colour, markersize=2.0, alpha=0.45, mew=0,
        rasterized=True, clip_on=False,
    )  # fmt: skip
    _quantile_bar(axes, place, rows, palette.INK, limit)


def _signed(row: Mapping[str, Any]) -> float:
    """e_R, at the far right where there is none."""
    return float("inf") if row["radius_error"] is None else float(row["radius_error"])


def _quantile_bar(axes: Any, place: float, rows: Sequence[Mapping[str, Any]], colour: str, limit: float) -> None:
    errors = [100.0 * _signed(row) for row in rows]
    if not errors:
        return
    ends = np.clip(np.quantile(errors, _QUANTILES, method="inverted_cdf"), -limit, limit)
    axes.plot(ends[[0, 4]], [place, place], color=colour, linewidth=0.9)
    axes.plot(ends[[1, 3]], [place, place], color=colour, linewidth=3.0, solid_capstyle="butt")
    axes.plot(ends[2], place, "o", color="white", markeredgecolor=colour, markersize=4.2, mew=1.2, clip_on=False)


def _driven(evaluation: Evaluation, set_name: str) -> list[Arm]:
    return [arm for arm in evaluation.arms if "success_rate" in evaluation.metrics(arm.name, set_name)]


def _arm_axis(axes: Any, arms: Sequence[Arm]) -> None:
    axes.set_yticks(range(len(arms)), [display_name(arm.name) for arm in arms])
    for label, arm in zip(axes.get_yticklabels(), arms, strict=True):
        label.set_color(palette.INK if arm.deployable else palette.GREY)
        label.set_style("normal" if arm.deployable else "italic")
    axes.set_ylim(len(arms) - 0.4, -0.6)
    axes.grid(axis="y", visible=False)
    axes.tick_params(axis="y", length=0)


def _signed_axis(axes: Any) -> None:
    axes.axvline(0.0, color=palette.GREY, linewidth=0.8, zorder=0.5)
    axes.set_xlim(-100.0 * _SIGNED_LIMIT, 100.0 * _SIGNED_LIMIT)


def _panels(evaluation: Evaluation, width: float = 1.1) -> tuple[Any, list[Any], list[Arm]]:
    """Figure with one panel a set and one row an arm."""
    from matplotlib.figure import Figure

    arms = [arm for arm in evaluation.arms if any(_driven_on(evaluation, arm, s.name) for s in evaluation.sets)]
    count = len(evaluation.sets)
    size = (1.5 + max(width, 3.2 / count) * count, 0.85 + ROW_HEIGHT * len(arms))
    figure = Figure(figsize=size, layout="constrained")
    axes = list(figure.subplots(1, count, sharey=True, squeeze=False)[0])
    for panel, item in zip(axes, evaluation.sets, strict=True):
        panel.set_title(item.name)
    _arm_axis(axes[0], arms)
    for panel in axes[1:]:
        panel.grid(axis="y", visible=False)
        panel.tick_params(axis="y", length=0)
    return figure, axes, arms


def _driven_on(evaluation: Evaluation, arm: Arm, set_name: str) -> bool:
    return "success_rate" in evaluation.metrics(arm.name, set_name)


def error_figure(evaluation: Evaluation) -> Any:
    """Median (filled) and 95th percentile (hollow) of |e_R| with their 95 % intervals, by arm and set."""
    figure, axes, arms = _panels(evaluation)
    colours = arm_colours(evaluation)
    for panel, item in zip(axes, evaluation.sets, strict=True):
        for place, arm in enumerate(arms):
            found = evaluation.metrics(arm.name, item.name)
            _dot(panel, place - 0.13, found.get("radius_error_median"), colours[arm.name], True)
            _dot(panel, place + 0.13, found.get("radius_error_p95"), colours[arm.name], False)
        panel.set_xscale("log")
        panel.set_xlim(_LEAST, 1.2 * _FAILED)
        panel.set_xticks([1.0, 10.0, 100.0], ["1", "10", "100"])
        panel.tick_params(axis="x", which="minor", length=0)
    figure.supxlabel("|turn radius error| [%]", fontsize=8)
    return figure


def _dot(panel: Any, place: float, metric: Mapping[str, Any] | None, colour: str, filled: bool) -> None:
    if metric is None:
        return
    value = _shown(metric["value"])
    if metric["interval"] is not None:
        panel.plot([_shown(end) for end in metric["interval"]], [place, place], color=colour, linewidth=1.5)
    face = colour if filled else "white"
    mark = ">" if metric["value"] is None else "o"
    panel.plot(value, place, mark, color=face, markeredgecolor=colour, markersize=3.6, mew=1.0)


def _shown(share: float | None) -> float:
    """Percent, kept inside the panel."""
    return _FAILED if share is None else float(np.clip(100.0 * share, _LEAST, _MOST))


def signed_figure(evaluation: Evaluation) -> Any:
    """Signed radius error by arm and set: median, quartiles, 5 and 95 %."""
    figure, axes, arms = _panels(evaluation)
    colours = arm_colours(evaluation)
    for panel, item in zip(axes, evaluation.sets, strict=True):
        for place, arm in enumerate(arms):
            rows = evaluation.rows_of(arm.name, item.name)
            _quantile_bar(panel, place, rows, colours[arm.name], 100.0 * _SIGNED_LIMIT)
        _signed_axis(panel)
    figure.supxlabel("turn radius error [%]", fontsize=8)
    return figure


def improvement_figure(evaluation: Evaluation) -> Any:
    """Probability of a smaller |e_R| than B1's and B4's on the same scenario, with 95 % intervals."""
    figure, axes, arms = _panels(evaluation)
    for panel, item in zip(axes, evaluation.sets, strict=True):
        panel.axvline(50.0, color=palette.GREY, linewidth=0.8, zorder=0.5)
        for place, arm in enumerate(arms):
            for side, (baseline, colour) in zip((-0.13, 0.13), BASELINE_COLOURS.items(), strict=True):
                found = evaluation.metrics(arm.name, item.name).get(f"improvement_over_{baseline}")
                if found is not None:
                    ends = [100.0 * end for end in found["interval"] or ()]
                    panel.plot(ends, [place + side] * len(ends), color=colour, linewidth=1.5)
                    panel.plot(100.0 * found["value"], place + side, "o", color=colour, markersize=3.4, clip_on=False)
        panel.set_xlim(0.0, 100.0)
        panel.set_xticks([0, 50, 100])
    for baseline, colour in BASELINE_COLOURS.items():
        axes[0].plot([], [], "-o", color=colour, markersize=3.4, label=f"over {baseline}")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    figure.supxlabel("probability of the smaller error on the same scenario [%]", fontsize=8)
    return figure


def profile_arms(evaluation: Evaluation) -> list[Arm]:
    """Arms that have a line of their own: the ladder, the headline and the best; at most nine."""
    best = best_arm(evaluation)
    first = [arm for arm in evaluation.arms if arm.name == evaluation.headline or (best and arm.name == best.name)]
    ladder = [arm for arm in evaluation.arms if not arm.learned and arm not in first]
    others = [arm for arm in evaluation.arms if arm.learned and arm not in first]
    chosen = [*first, *ladder, *others][:_MOST_LINES]
    return [arm for arm in evaluation.arms if arm in chosen]


def profile_figure(evaluation: Evaluation) -> Any:
    """Share of turns within an error, with its 95 % band, on the judged set."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 3.3), layout="constrained")
    axes = figure.subplots()
    colours = arm_colours(evaluation)
    used: set[str] = set()
    for arm in profile_arms(evaluation):
        profile = evaluation.metrics(arm.name, evaluation.judged).get("profile")
        if profile is not None:
            x, share, low, high = (100.0 * np.array(profile[k]) for k in ("thresholds", "share", "low", "high"))
            again = colours[arm.name] in used  # there are fewer colours than lines
            used.add(colours[arm.name])
            line = (0, (5.0, 1.2)) if again else "-"
            if not arm.deployable:
                line = (0, (1.5, 1.5))
            axes.plot(x, share, color=colours[arm.name], linestyle=line, label=display_name(arm.name))
            axes.fill_between(x, low, high, color=colours[arm.name], alpha=0.13, linewidth=0.0)
    axes.set(xlabel="|turn radius error| at most [%]", ylabel="share of turns [%]", xlim=(0.0, 20.0), ylim=(0.0, 101.0))
    axes.set_title(f"Scenarios {evaluation.judged}")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside right center")
    return figure


def size_figure(evaluation: Evaluation, sizes: Sequence[tuple[str, str, float]]) -> Any:
    """Medians of sizes with 95 % intervals on the judged set, one panel a size.

    Args:
        evaluation: what was driven.
        sizes: key of the summary less ``_median``, words with the unit, factor to that unit.
    """
    from matplotlib.figure import Figure

    arms, colours = _driven(evaluation, evaluation.judged), arm_colours(evaluation)
    figure = Figure(figsize=(1.5 + 1.45 * len(sizes), 0.85 + ROW_HEIGHT * len(arms)), layout="constrained")
    axes = list(figure.subplots(1, len(sizes), sharey=True, squeeze=False)[0])
    for panel, (key, words, factor) in zip(axes, sizes, strict=True):
        for place, arm in enumerate(arms):
            found = evaluation.metrics(arm.name, evaluation.judged).get(f"{key}_median")
            if found is not None and found["value"] is not None:
                ends = [factor * end for end in found["interval"] if end is not None]
                panel.plot(ends, [place] * len(ends), color=colours[arm.name], linewidth=1.5)
                panel.plot(factor * found["value"], place, "o", color=colours[arm.name], markersize=3.8)
        panel.set_title(words.replace(" [", "\n["), fontsize=7.5, fontweight="normal")
        panel.set_xlim(left=0.0)
        panel.grid(axis="y", visible=False)
    _arm_axis(axes[0], arms)
    return figure
