"""An adaptation in words and rows, for the command, notebooks and the page."""

from __future__ import annotations

from typing import Any

from ddagr_gym.adaptation.corrected import Corrected
from ddagr_gym.adaptation.files import summary
from ddagr_gym.adaptation.run import Adapted
from ddagr_gym.reporting.text_table import format_table

OUTCOME_HEADER = ("in the corrected simulator", "before", "after")
TAKEN_HEADER = ("named", "what was done with it")

_KEPT = {
    "nominal": "The nominal controller is kept: neither knowledge nor tuning made it better there.",
    "known": "Kept is the nominal controller with what was named put into its filter and its model.",
    "taught": "Kept is the controller with what was named, a feed-forward that was taught, and the gains of a search.",
    "tuned": "Kept is the controller with what was named, and the gains of a search.",
}

TRIED = {
    "B4": "Taught: with a feed-forward and gains besides. The best is kept.",
    "B6": "Tuned: with gains besides. What only knows is kept, unless another is better beyond doubt.",
}
"""What else was tried and what is kept, by the controller that was adapted."""

_READ_OFF = "into the filter and the model, and taught"
_TAUGHT = "taught by turns alone: filter and model have no place for it"
_TUNED = "tuned by turns alone: filter and model have no place for it"
_NO_PLACE = "not taken: the filter and the model have no place for it"
_LEFT = "not taken: the nominal controller is kept"


def outcome_rows(adapted: Adapted) -> list[tuple[str, str, str]]:
    """Radius error, exit and success before and after, with 95 % intervals."""
    reach = adapted.bundle.robot.half_wheelbase
    before, after = summary(adapted.before, reach), summary(adapted.after, reach)
    rows = (("radius error, median", "radius_error", 100.0, "%", 1), ("success", "success", 100.0, "%", 0),
            ("deviation at the next row, median", "exit_deviation", 100.0, "cm", 1))  # fmt: skip
    return [
        (title, _span(before[key], scale, unit, digits), _span(after[key], scale, unit, digits))
        for title, key, scale, unit, digits in rows
    ]


def _span(entry: dict[str, Any], scale: float, unit: str, digits: int) -> str:
    value, low, high = (f"{scale * entry[key]:.{digits}f}" for key in ("value", "low", "high"))
    return f"{value} {unit} ({low} to {high})"


def taken_rows(adapted: Adapted, corrected: Corrected) -> list[tuple[str, str]]:
    """What became of every named effect, and of the refitted robot and soil."""
    if adapted.kept == "nominal":
        return [(item.title, _LEFT) for item in corrected.all_effects] + [("refitted robot and soil", _LEFT)]
    rest = {"taught": _TAUGHT, "tuned": _TUNED}.get(adapted.kept, _NO_PLACE)
    read_off = _READ_OFF if adapted.kept == "taught" else "into the filter and the model"
    rows = [(item.title, read_off if item.name in adapted.used else rest) for item in corrected.all_effects]
    return [*rows, ("refitted robot", "into the filter and the model"), ("refitted soil", "the filter's prior")]


def doubts(corrected: Corrected) -> list[str]:
    """What a reader must know before trusting the corrected simulator."""
    found = []
    if "unknown" in corrected.verdict:
        found.append(
            "The recordings hold something that no effect explains: the controller knows the refitted robot and soil "
            "alone, and the figures below are of a simulator that is not the robot."
        )
    elif not corrected.complete:
        found.append(
            "The diagnosis is not complete: the recordings hold more than was named, which none of the figures has, or "
            "a name is doubtful."
        )
    return found


def headline(adapted: Adapted, corrected: Corrected) -> str:
    """Radius error and success before and after, in a sentence."""
    reach = corrected.robot.half_wheelbase
    before, after = summary(adapted.before, reach), summary(adapted.after, reach)
    return (
        f"In the corrected simulator the median radius error goes from {_percent(before['radius_error'])} to "
        f"{_percent(after['radius_error'])}, and {_percent(after['success'], 0)} of the turns succeed in place of "
        f"{_percent(before['success'], 0)}."
    )


def kept_sentence(adapted: Adapted) -> str:
    """What is kept."""
    return _KEPT[adapted.kept]


def _percent(entry: dict[str, Any], digits: int = 1) -> str:
    return f"{100.0 * entry['value']:.{digits}f}\u00a0%"


def adaptation_text(adapted: Adapted, corrected: Corrected) -> str:
    """All of it, as the command prints it."""
    parts = [
        *(f"Note: {line}" for line in doubts(corrected)),
        corrected.sentence,
        "",
        headline(adapted, corrected),
        kept_sentence(adapted),
        "",
        format_table(OUTCOME_HEADER, outcome_rows(adapted)),
        "",
        format_table(TAKEN_HEADER, taken_rows(adapted, corrected)),
    ]
    return "\n".join(parts)
