"""The next drive in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ddagr_gym.reporting.text_table import format_table

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.answer.next_drive_plan import NextDrivePlan

HEADER = ("manoeuvre", "gain per minute", "seconds needed")


def answer_text(answer: NextDrivePlan) -> str:
    """The answer in words, with the runners-up."""
    if not answer.manoeuvre:
        return answer.why
    pairs = ", ".join(" from ".join(pair) for pair in answer.separates)
    tells = f"It tells {pairs}.\n" if pairs else ""
    return f"Drive {answer.manoeuvre}: {answer.why}\n{tells}\n{format_table(HEADER, answer_rows(answer))}"


def answer_rows(answer: NextDrivePlan) -> list[tuple[str, str, str]]:
    """The best manoeuvre and the runners-up under :data:`HEADER`."""
    entries = [answer, *answer.alternatives] if answer.manoeuvre else []
    return [
        (item.manoeuvre, f"{item.power:.3g}", "–" if item.minutes is None else f"{60.0 * item.minutes:.2g}")
        for item in entries
    ]
