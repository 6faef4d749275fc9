"""The page of an evaluation: one file without links to anywhere but the videos beside it, the answer first."""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.report_data import Evaluation, Film
from ddagr_gym.evaluation.summary import BASELINES
from ddagr_gym.files import atomic_path, make_folder
from ddagr_gym.parameters import Robot
from ddagr_gym.reporting import evaluation_figures as figures
from ddagr_gym.reporting import evaluation_paths as paths
from ddagr_gym.reporting import evaluation_tables as tables
from ddagr_gym.reporting.figures import house_style
from ddagr_gym.reporting.page_template import embedded, page_template

PAGE = "report.html"
PICTURE = "radius_error"
"""Stem of the picture for a README."""

TRANSFER = ("S1", "T")
"""Set and the same scenarios on another soil law."""

_DPI = 110
"""Of the points inside figures."""


def write_page(folder: Path, evaluation: Evaluation, robot: Robot, progress: Callable[[], None] = lambda: None) -> Path:
    """Write ``report.html`` and ``radius_error.png``.

    Args:
        folder: to write to; made where absent.
        evaluation: what was driven.
        robot: that drove, for outlines and tolerances.
        progress: called after each figure, :data:`FIGURES` times at most.

    Returns:
        The page.

    Raises:
        InputError: matplotlib or jinja2 is not installed, the folder cannot be one, or nothing was driven.
    """
    if not evaluation.rows:
        raise InputError("no episodes were driven: a page needs at least one.")
    template = page_template("evaluation.html")
    make_folder(folder)
    figures.radius_error_figure(evaluation, folder / f"{PICTURE}.png")
    with house_style():
        context = _context(evaluation, robot, progress)
    target = folder / PAGE
    with atomic_path(target) as path:
        path.write_text(template.render(context), encoding="utf-8")
    return target


def _context(evaluation: Evaluation, robot: Robot, progress: Callable[[], None]) -> dict[str, Any]:
    known = {item.name for item in evaluation.sets}
    judged = next(item for item in evaluation.sets if item.name == evaluation.judged)
    return {
        "judged": judged,
        "sentence": tables.sentence(evaluation),
        "doubts": tables.doubts(evaluation),
        "note": evaluation.note,
        "answers": tables.answer_rows(evaluation, True),
        "bounds": tables.answer_rows(evaluation, False),
        "baselines": BASELINES,
        "sets": evaluation.sets,
        "medians": tables.set_matrix(evaluation, "radius_error_median"),
        "worst_medians": tables.set_matrix(evaluation, "radius_error_p95"),
        "successes": tables.set_matrix(evaluation, "success_rate"),
        "radius_note": tables.radius_note(evaluation),
        "claims": tables.claim_rows(evaluation),
        "claims_sentence": tables.claims_sentence(evaluation),
        "learned": tables.learned_rows(evaluation),
        "headline": evaluation.headline,
        "worst": tables.worst_rows(evaluation),
        "failures": tables.failure_rows(evaluation),
        "infeasible": tables.infeasible_rows(evaluation),
        "infeasible_sentence": tables.infeasible_sentence(evaluation),
        "estimator_sizes": tables.ESTIMATOR,
        "estimator": tables.size_rows(evaluation, tables.ESTIMATOR),
        "cost_sizes": tables.COST,
        "cost": tables.size_rows(evaluation, tables.COST),
        "transfer": tables.transfer_rows(evaluation, *TRANSFER) if set(TRANSFER) <= known else [],
        "films": [_film(film) for film in evaluation.films],
        "sources": evaluation.sources,
        "pictures": _pictures(evaluation, robot, progress),
    }


def _film(film: Film) -> dict[str, str]:
    poster = f"data:image/jpeg;base64,{base64.b64encode(film.poster).decode()}" if film.poster else ""
    return {"file": str(film.file), "title": film.title, "command": film.command, "poster": poster}


def _makers(evaluation: Evaluation, robot: Robot) -> dict[str, tuple[Callable[[], Any], str]]:
    """Figure and alternative text by name, those that there is something for."""
    makers: dict[str, tuple[Callable[[], Any], str]] = {
        "errors": (lambda: figures.error_figure(evaluation), "Turn radius error by controller and scenario set"),
        "signed": (lambda: figures.signed_figure(evaluation), "Signed turn radius error by controller and set"),
        "profiles": (lambda: figures.profile_figure(evaluation), "Share of turns within an error, by controller"),
        "improvement": (lambda: figures.improvement_figure(evaluation), "Probability of improvement over B1 and B4"),
        "exits": (lambda: paths.exit_figure(evaluation, robot), "Lateral against heading error at the exit"),
        "estimator": (lambda: figures.size_figure(evaluation, tables.ESTIMATOR), "Errors of the filter by controller"),
        "cost": (lambda: figures.size_figure(evaluation, tables.COST), "Costs by controller"),
    }
    if not any(evaluation.rows_of(arm.name, evaluation.judged) for arm in evaluation.arms):
        makers = {}
    if evaluation.drives:
        makers["paths"] = (lambda: paths.path_figure(evaluation, robot), "True paths over the commanded one")
    if evaluation.tracked:
        makers["estimates"] = (lambda: paths.estimate_figure(evaluation.tracked, robot), "True and estimated path")
    return makers


FIGURES = 9
"""Most figures of a page."""


def _pictures(evaluation: Evaluation, robot: Robot, progress: Callable[[], None]) -> Mapping[str, dict[str, Any]]:
    drawn = {}
    for name, (make, alt) in _makers(evaluation, robot).items():
        drawn[name] = embedded(make(), alt, _DPI)
        progress()
    return drawn
