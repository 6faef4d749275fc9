"""The page of an adaptation: one file without links to anywhere, the turns before and after first."""

from __future__ import annotations

from pathlib import Path

from ddagr_gym.adaptation.corrected import Corrected
from ddagr_gym.adaptation.files import NAME
from ddagr_gym.adaptation.run import Adapted
from ddagr_gym.adaptation.turns import CorrectedTurns
from ddagr_gym.evaluation.bundles import CONTROLLER, EFFECTS, ROBOT, SOIL
from ddagr_gym.files import write_text
from ddagr_gym.reporting import adaptation_figure as figures
from ddagr_gym.reporting import adaptation_text as text
from ddagr_gym.reporting.figures import house_style
from ddagr_gym.reporting.page_template import embedded, page_template

PAGE = "index.html"

_SHOWN = 6
"""Turns whose paths are drawn, both sides together (ours: more cover each other)."""


def write_page(folder: Path, adapted: Adapted, corrected: Corrected, turns: CorrectedTurns) -> None:
    """Write ``index.html``, its pictures in it; drives the turns that are drawn once more.

    Args:
        folder: that exists.
        adapted: what came of it.
        corrected: the simulator that it was tuned on.
        turns: in that simulator.

    Raises:
        InputError: matplotlib or jinja2 is not installed.
    """
    page = page_template("adaptation.html")
    numbers = [item.number for item in adapted.after][:_SHOWN]
    commanded = [turns.turn(number) for number in numbers]
    before, after = (
        [turns.drive(bundle.controller(turn), number) for number, turn in zip(numbers, commanded, strict=True)]
        for bundle in (adapted.nominal, adapted.bundle)
    )
    with house_style():
        context = {
            "headline": text.headline(adapted, corrected),
            "doubts": text.doubts(corrected),
            "sentence": corrected.sentence,
            "kept": text.kept_sentence(adapted),
            "turns": len(adapted.after),
            "controller": adapted.bundle.adapted_from,
            "tried": text.TRIED[adapted.bundle.adapted_from],
            "paths": embedded(figures.path_figure(before, after, commanded), "Paths of turns before and after"),
            "errors": embedded(figures.error_figure(adapted), "Radius and lateral errors before and after"),
            "outcome_header": text.OUTCOME_HEADER,
            "outcomes": text.outcome_rows(adapted),
            "taken_header": text.TAKEN_HEADER,
            "taken": text.taken_rows(adapted, corrected),
            "score_header": ("controller", "objective, lower is better"),
            "scores": [(name, f"{value:.3g}") for name, value in adapted.scores.items()],
            "files": [CONTROLLER, ROBOT, SOIL, EFFECTS, NAME],
        }
    write_text(folder / PAGE, page.render(context))
