"""How much of what the true effect is worth an adaptation wins back."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.adaptation.study import ARMS, as_turns
from ddagr_gym.adaptation.files import deviations, summary
from ddagr_gym.adaptation.turns import DrivenTurn, sizes
from ddagr_gym.presets import ddagr

Array = NDArray[np.float64]

SCORES: dict[str, Callable[[Sequence[DrivenTurn]], Array]] = {
    "radius_error": sizes,
    "exit_deviation": lambda driven: deviations(driven, ddagr().half_wheelbase),
}
"""What is won back, by turn."""

_RESAMPLES = 2000

_LEVEL = "nothing"
"""Truth in which nothing is different: what an adaptation wins there is no effect's doing."""


def result_of(found: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """What the study writes: each truth by arm, and the shares that were won back."""
    truths = {name: _of_truth(item) for name, item in found.items()}
    for name, spoilt in _spoilt(found).items():
        truths[name]["spoilt"] = spoilt
    return {
        "arms": ARMS,
        "truths": truths,
        "won_back": {score: _over_truths(truths, score) for score in SCORES},
        "turns": {name: item["turns"] for name, item in found.items()},
    }


def _of_truth(item: Mapping[str, Any]) -> dict[str, Any]:
    turns = {arm: as_turns(own) for arm, own in item["turns"].items()}
    known = {key: item[key] for key in ("title", "effect", "verdict", "complete", "sentence", "kept")}
    arms = {arm: summary(own, ddagr().half_wheelbase) for arm, own in turns.items()}
    return {**known, "arms": arms, "gains": {name: gains(turns, score) for name, score in SCORES.items()}}


def _spoilt(found: Mapping[str, Mapping[str, Any]]) -> dict[str, list[str]]:
    """By truth the scores of the nominal controller that are certainly worse than where nothing is different.

    The same places and noise are compared, turn by turn, with 95 % by resampling; none where that truth is missing.
    """
    if _LEVEL not in found:
        return {name: [] for name in found}
    rng = np.random.default_rng(1)
    worse: dict[str, list[str]] = {}
    for name, item in found.items():
        own, level = (as_turns(entry["turns"]["nominal"]) for entry in (item, found[_LEVEL]))
        chosen = rng.integers(len(own), size=(_RESAMPLES, len(own)))
        excess = {key: (score(own) - score(level))[chosen].mean(axis=1) for key, score in SCORES.items()}
        worse[name] = [key for key, values in excess.items() if np.quantile(values, 0.025) > 0.0]
    return worse


def gains(turns: Mapping[str, Sequence[DrivenTurn]], score: Callable[[Sequence[DrivenTurn]], Array]) -> dict[str, Any]:
    """Fall of the mean score from the nominal to the adapted and the told controller, and their ratio.

    Intervals are 95 %, by resampling turns, the same ones for all controllers. The share is None where the told
    controller's gain is not certain (its interval holds 0 or less).

    Args:
        turns: by arm, the same places in each.
        score: of turns, lower is better.
    """
    values = np.array([score(turns[arm]) for arm in ARMS])
    rng = np.random.default_rng(0)
    chosen = rng.integers(values.shape[1], size=(_RESAMPLES, values.shape[1]))
    means = values[:, chosen].mean(axis=2)
    adapted, told = means[0] - means[1], means[0] - means[2]
    plain = values.mean(axis=1)
    is_certain = float(np.quantile(told, 0.025)) > 0.0
    share = float((plain[0] - plain[1]) / (plain[0] - plain[2])) if is_certain else None
    return {
        "adapted": _entry(float(plain[0] - plain[1]), adapted),
        "told": _entry(float(plain[0] - plain[2]), told),
        "share": None if share is None else _entry(share, adapted / np.maximum(told, 1e-9)),
        "loses": bool(np.quantile(adapted, 0.975) < 0.0),
    }


def _entry(value: float, resampled: Array) -> dict[str, float]:
    low, high = np.quantile(resampled, (0.025, 0.975)).tolist()
    return {name: float(f"{number:.4g}") for name, number in (("value", value), ("low", low), ("high", high))}


def _over_truths(truths: Mapping[str, Mapping[str, Any]], score: str) -> dict[str, Any]:
    """Median share over the truths in which there is something to win, and where the adapted controller loses."""
    shares = {name: item["gains"][score]["share"] for name, item in truths.items()}
    known = {name: share["value"] for name, share in shares.items() if share is not None}
    spoilt = [share for name, share in known.items() if score in truths[name]["spoilt"]]
    return {
        "truths": sorted(known),
        "median_share": _median(list(known.values())),
        "truths_spoilt": sorted(name for name in known if score in truths[name]["spoilt"]),
        "median_share_where_spoilt": _median(spoilt),
        "lost_in": sorted(name for name, item in truths.items() if item["gains"][score]["loses"]),
    }


def _median(values: Sequence[float]) -> float | None:
    return float(f"{np.median(values):.4g}") if values else None


def table(result: Mapping[str, Any]) -> str:
    """Markdown: a row a truth; median |e_R|, median exit deviation and success of each controller."""
    head = "| truth | said | nominal | adapted | told | share won back: radius, exit |"
    lines = [head, "|---" * 6 + "|"]
    for item in result["truths"].values():
        cells = [_cell(item["arms"][arm]) for arm in ARMS]
        shares = [_share(item["gains"][score]["share"]) for score in SCORES]
        lines.append(f"| {item['title']} | {', '.join(item['verdict'])} | {' | '.join(cells)} | {', '.join(shares)} |")
    return "\n".join(lines)


def _cell(arm: Mapping[str, Any]) -> str:
    error, leave, made = arm["radius_error"], arm["exit_deviation"], arm["success"]
    return (
        f"{100 * error['value']:.1f} % ({100 * error['low']:.1f} to {100 * error['high']:.1f}), "
        f"{100 * leave['value']:.1f} cm, {100 * made['value']:.0f} % "
        f"({100 * made['low']:.0f} to {100 * made['high']:.0f})"
    )


def _share(entry: Mapping[str, float] | None) -> str:
    return "-" if entry is None else f"{100 * entry['value']:.0f} %"
