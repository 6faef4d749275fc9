"""The next drive in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ddagr_gym.reporting.text_table import format_table

HEADER = ("manoeuvre", "gain per minute", "seconds needed")


def answer_text(answer: Mapping[str, Any]) -> str:
    """The answer in words, with the runners-up.

    Args:
        answer: of :func:`ddagr_gym.diagnosis.planning.next_drive.next_drive`.
    """
    if not answer["manoeuvre"]:
        return str(answer["why"])
    pairs = ", ".join(" from ".join(pair) for pair in answer["separates"])
    tells = f"It tells {pairs}.\n" if pairs else ""
    return f"Drive {answer['manoeuvre']}: {answer['why']}\n{tells}\n{format_table(HEADER, answer_rows(answer))}"


def answer_rows(answer: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """The best manoeuvre and the runners-up under :data:`HEADER`."""
    entries = [answer, *answer["alternatives"]] if answer["manoeuvre"] else []
    return [(e["manoeuvre"], f"{e['power']:.3g}", f"{60.0 * e['minutes']:.2g}") for e in entries]
