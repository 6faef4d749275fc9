"""Figures of what changed: shifts of all effects beside their limit, and what would have been found."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ddagr_gym.diagnosis.answer.change import BEFORE
from ddagr_gym.diagnosis.result.near_miss import by_distance, over_limit
from ddagr_gym.diagnosis.wording import CHANNEL_NAMES, title
from ddagr_gym.physics.effects.registry import effect_kind
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import PAGE_WIDTH, blank_figure
from ddagr_gym.reporting.plain_axes import plain_log, plain_symlog

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.answer.change import Change, ChangeCertificate, EffectShift

_NINETY = 1.645
"""Normal quantile of a 90 % interval."""

_FARTHEST = 4.0
"""Multiples of the limit beyond which a shift is drawn at the edge (ours)."""


def shift_figure(change: Change, named: tuple[str, ...]) -> Any:
    """Distance of every effect over its limit; least detectable changes over the least sizes that matter beside it.

    Args:
        change: of a drive.
        named: effects of the verdict.
    """
    shifts = list(reversed(by_distance(change)))
    figure = blank_figure(1.1 + 0.24 * len(shifts), PAGE_WIDTH)
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(3.0, 2.0))
    for place, item in enumerate(shifts):
        over = over_limit(item)
        colour = palette.VERMILLION if item.effect in named else palette.BLUE
        left.barh(place, min(over, _FARTHEST), 0.62, color=colour, zorder=2)
        if over > _FARTHEST:
            left.text(_FARTHEST, place, f" {over:.0f} x", va="center", fontsize=7, color=palette.INK)
        multiples = least_multiples(item)
        if multiples:
            right.plot(multiples, [place] * len(multiples), "o-", ms=4, lw=1.0, color=palette.BLUE, zorder=2)
        else:
            right.text(1.0, place, "no size that exists", va="center", fontsize=7, color=palette.GREY)
    left.axvline(1.0, color=palette.INK, lw=0.9, zorder=3)
    largest = max((over_limit(item) for item in shifts), default=0.0)
    left.set_xlim(0.0, 1.12 * min(max(largest, 1.1), _FARTHEST))
    left.set_yticks(range(len(shifts)), [title(item.effect) for item in shifts])
    left.set_ylim(-0.6, len(shifts) - 0.4)
    percent = f"{100.0 * change.level:g} %"
    left.set_xlabel(f"shift, in standard deviations over the limit of {percent} false alarms over all effects")
    right.axvline(1.0, color=palette.GREY, lw=0.8)
    plain_log(right)
    right.set_xlabel(f"change found {100.0 * change.power:g} times in 100,\nin least sizes that matter")
    return figure


def least_multiples(item: EffectShift) -> list[float]:
    """Least detectable changes of an effect's sizes in least sizes that matter; a limit or a sign is there or not."""
    kind = effect_kind(item.effect)
    if kind.categorical or not kind.differentiable:
        return [1.0 for size in item.sizes.values() if size.least_detectable is not None]
    known = [(name, size.least_detectable) for name, size in item.sizes.items() if size.least_detectable is not None]
    return [value / float(kind.parameter(name).metadata["least"]) for name, value in known]


def size_figure(change: Change, named: tuple[str, ...]) -> Any:
    """Sizes of every effect before and after, side by side, in least sizes that matter.

    Args:
        change: of a drive.
        named: effects of the verdict.
    """
    rows = [row for item in reversed(by_distance(change)) for row in _sizes_of(item)]
    figure = blank_figure(1.2 + 0.22 * len(rows), PAGE_WIDTH)
    axes = figure.subplots(1, 2, sharey=True, sharex=True)
    for place, (_, effect, before, after, half) in enumerate(rows):
        colour = palette.VERMILLION if effect in named else palette.BLUE
        axes[0].plot(before, place, "o", ms=4, color=colour)
        axes[1].plot([before, before], [place - 0.3, place + 0.3], color=palette.GREY, lw=1.2)
        axes[1].errorbar(after, place, xerr=half, fmt="o", ms=4, lw=1.0, color=colour)
    sides = ("before", "after") if change.against == BEFORE else ("ordinary drives", "the drives compared")
    farthest = max((max(abs(before), abs(after) + half) for _, _, before, after, half in rows), default=0.0)
    for axis, side in zip(axes, sides, strict=True):
        axis.axvline(0.0, color=palette.GREY, lw=0.8, zorder=0)
        axis.set_title(side)
        plain_symlog(axis, 2.0, farthest)
        axis.set_xlabel("size, in least sizes that matter")
    axes[0].set_yticks(range(len(rows)), [row[0] for row in rows])
    axes[0].set_ylim(-0.6, len(rows) - 0.4)
    return figure


def _sizes_of(item: EffectShift) -> list[tuple[str, str, float, float, float]]:
    """Label, effect, size before and after, and half the interval of the difference, of each size."""
    kind = effect_kind(item.effect)
    if kind.categorical or not kind.differentiable:
        return []
    rows = []
    for name, size in item.sizes.items():
        least = float(kind.parameter(name).metadata["least"])
        label = title(item.effect) if len(item.sizes) == 1 else f"{title(item.effect)}, {name.replace('_', ' ')}"
        values = (size.before / least, (size.before + size.value) / least, _NINETY * size.deviation / least)
        rows.append((label, item.effect, *values))
    return rows


def forecast_figure(certificate: ChangeCertificate, named: bool) -> Any:
    """Quartiles of the losses of left-out windows: before, after without what changed, and with it.

    Args:
        certificate: of the drives.
        named: whether anything changed that has a name.
    """
    rows = [
        ("after, with what changed", certificate.losses, palette.BLUE),
        ("after, without it" if named else "after", certificate.losses_without, palette.VERMILLION),
        ("before", certificate.losses_of_ordinary, palette.GREY),
    ]
    shown = rows if named else rows[1:]
    figure = blank_figure(1.0 + 0.35 * len(shown), PAGE_WIDTH)
    axis = figure.subplots()
    for place, (_, (low, middle, high), colour) in enumerate(shown):
        axis.plot([low, high], [place, place], color=colour, lw=5.0, alpha=0.5, solid_capstyle="butt")
        axis.plot(middle, place, "o", ms=6, color=colour)
    axis.axvline(certificate.limit, color=palette.INK, lw=0.9)
    plain_log(axis)
    axis.set_yticks(range(len(shown)), [row[0] for row in shown])
    axis.set_ylim(-0.6, len(shown) - 0.4)
    axis.set_xlabel("mean loss of a sample, forecast by a fit without it")
    return figure


def parameter_figure(change: Change) -> Any:
    """Parameters of robot and ground before and after the named effects, in deviations of ordinary drives."""
    items = [item for item in reversed(change.parameters) if item.expected_deviation > 0.0]
    figure = blank_figure(1.0 + 0.25 * len(items), PAGE_WIDTH)
    axis = figure.subplots()
    axis.axvspan(-2.0, 2.0, color=palette.SHADE, zorder=0)
    axis.axvline(0.0, color=palette.GREY, lw=0.8, zorder=1)
    for place, item in enumerate(items):
        before, after = (value / item.expected_deviation for value in (item.change, item.with_effects))
        axis.plot([before, after], [place, place], color=palette.PALE, lw=1.4, zorder=2)
        axis.plot(before, place, "o", ms=5, mfc="none", color=palette.VERMILLION, zorder=3,
                  label="without effects" if place == 0 else None)  # fmt: skip
        axis.plot(
            after, place, "o", ms=4, color=palette.BLUE, zorder=4, label="with what changed" if place == 0 else None
        )
    farthest = max((abs(x) / item.expected_deviation for item in items for x in (item.change, item.with_effects)),
                   default=0.0)  # fmt: skip
    plain_symlog(axis, 4.0, farthest)
    axis.set_yticks(range(len(items)), [item.name.replace("_", " ") for item in items])
    axis.set_ylim(-0.6, len(items) - 0.4)
    axis.set_xlabel("from the calibrated value, in standard deviations of ordinary drives (band: two)")
    axis.legend(ncols=2, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure


def channel_figure(change: Change) -> Any:
    """What the model leaves of each channel before, and after without and with what changed, with its limit."""
    items = list(reversed(change.channels))
    figure = blank_figure(1.0 + 0.3 * len(items), PAGE_WIDTH)
    axis = figure.subplots()
    for place, item in enumerate(items):
        rows = (
            (item.before, "before", {"marker": "o", "ms": 7, "color": palette.GREY}),
            (
                item.without_effects,
                "after, without effects",
                {"marker": "o", "ms": 6, "color": palette.VERMILLION, "mfc": "none"},
            ),
            (item.with_effects, "after, with what changed", {"marker": "o", "ms": 4, "color": palette.BLUE}),
            (item.limit, "limit", {"marker": "|", "ms": 16, "color": palette.INK}),
        )
        for value, name, look in rows:
            axis.plot(math.sqrt(value), place, ls="none", label=None if place else name, **look)
    plain_log(axis)
    axis.set_yticks(range(len(items)), [CHANNEL_NAMES[item.channel] for item in items])
    axis.set_ylim(-0.6, len(items) - 0.4)
    axis.set_xlabel("error of the model in units of its weight, r.m.s.")
    axis.legend(ncols=4, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure
