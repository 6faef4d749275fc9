"""The page of a diagnosis: one file without links to anywhere, the answer first, pictures next."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ddagr_gym.diagnosis.answer.certificate import Certificate
from ddagr_gym.diagnosis.answer.drivetrain import DrivetrainAnswer
from ddagr_gym.diagnosis.answer.evidence import Evidence
from ddagr_gym.diagnosis.answer.verdict import Diagnosis
from ddagr_gym.diagnosis.wording import CHANNEL_NAMES, title
from ddagr_gym.files import atomic_path, make_folder
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.reporting import diagnosis_figures as figures
from ddagr_gym.reporting import diagnosis_maps as maps
from ddagr_gym.reporting import diagnosis_tables as tables
from ddagr_gym.reporting.drivetrain_figure import forecast_figure, part_figure
from ddagr_gym.reporting.drivetrain_section import drivetrain_section, other_findings
from ddagr_gym.reporting.figures import house_style
from ddagr_gym.reporting.onset_figure import onset_figure, timed
from ddagr_gym.reporting.page_template import embedded, page_template
from ddagr_gym.reporting.recorded_currents import currents_figure, has_currents

PAGE = "report.html"
PICTURES = "figures"

Progress = Callable[[str], None]


class _Studio:
    """Turns figures into pictures of the page, and keeps each as PNG too."""

    def __init__(self, folder: Path, progress: Progress) -> None:
        self._folder = folder
        self._progress = progress

    def picture(self, figure: Any, name: str, alt: str, **more: Any) -> dict[str, Any]:
        """Data of an SVG for the page; the PNG is written."""
        self._progress(name)
        shown = embedded(figure, alt)
        with atomic_path(self._folder / f"{name}.png") as path:
            figure.savefig(path, format="png", dpi=160, facecolor="white", metadata={"Software": None})
        return shown | more


def write_report(
    folder: Path,
    diagnosis: Diagnosis,
    evidence: Evidence,
    progress: Progress = lambda name: None,
    recordings: Sequence[Recording] = (),
) -> None:
    """Write ``report.html`` and, in ``figures``, its pictures as PNG.

    Args:
        folder: to write to; made where absent.
        diagnosis: what later steps add may be absent.
        evidence: of the same diagnosis.
        progress: called with the name of each figure.
        recordings: that were diagnosed, whose currents and voltages are drawn.

    Raises:
        InputError: matplotlib or jinja2 is not installed, or the folder cannot be one.
    """
    page = page_template("diagnosis.html")
    pictures = make_folder(make_folder(folder) / PICTURES)
    with house_style():
        studio = _Studio(pictures, progress)
        context = _context(diagnosis, evidence, studio) | {"currents": _currents(recordings, studio)}
    with atomic_path(folder / PAGE) as path:
        path.write_text(page.render(context), encoding="utf-8")


def _context(diagnosis: Diagnosis, evidence: Evidence, studio: _Studio) -> dict[str, Any]:
    findings, localisation = diagnosis.findings, diagnosis.localisation
    return {
        "raw": figures.RAW,
        "before": figures.BEFORE,
        "after": figures.AFTER,
        "verdict": ", ".join(diagnosis.verdict),
        "sentence": diagnosis.sentence,
        "recordings": diagnosis.recordings,
        "tiles": tables.tiles(diagnosis, _seconds(evidence)),
        "checks": tables.checks(diagnosis.checks),
        "findings": [tables.finding_card(item, diagnosis.recordings) for item in other_findings(diagnosis)],
        "rejected": tables.rejected(diagnosis.rejected),
        "drivetrain": drivetrain_section(diagnosis),
        "drivetrain_pictures": _drivetrain_pictures(diagnosis.drivetrain, studio),
        "mismatch": localisation.mismatch.phrase if localisation and findings else "",
        "remaining": localisation.remaining.phrase if localisation else "",
        "window": f"{evidence.duration:.3g}",
        "condition_rows": tables.condition_rows(localisation, findings),
        "gate_note": tables.gate_note(diagnosis.thresholds, diagnosis.robot, diagnosis.soil),
        "wrench_rows": tables.wrench_rows(localisation),
        "unnamed": tables.unnamed(diagnosis.unnamed),
        "next_drive": tables.next_drive(diagnosis.next_drive),
        "gates": bool(tables.shown_gates(diagnosis)),
        "detectable": tables.detectable(diagnosis.detectable, tables.shown_gates(diagnosis)),
        "sources": tables.sources(diagnosis),
        "nuisances": tables.nuisances(diagnosis.nuisances),
        "fit": _fit(diagnosis.fit, studio),
        **_pictures(diagnosis, evidence, studio),
    }


def _drivetrain_pictures(answer: DrivetrainAnswer | None, studio: _Studio) -> list[dict[str, Any]]:
    if answer is None or not answer.parts or not answer.forecasts:
        return []
    return [
        studio.picture(part_figure(answer), "drivetrain_parts", "What forecasts lose without each part"),
        studio.picture(forecast_figure(answer), "drivetrain_errors", "Errors over those of the simulator as given"),
    ]


def _currents(recordings: Sequence[Recording], studio: _Studio) -> dict[str, Any] | None:
    """Picture of the currents and voltages; None where nothing of the kind was recorded."""
    measured = [recording for recording in recordings if has_currents(recording)]
    if not measured:
        return None
    return studio.picture(currents_figure(measured, "none"), "currents", "Currents and voltages as recorded")


def _seconds(evidence: Evidence) -> float:
    """Driven time that windows cover, overlaps counted once."""
    total = 0.0
    for number in np.unique(evidence.recording):
        start = np.sort(evidence.time[evidence.recording == number])
        total += float(np.minimum(np.diff(start), evidence.duration).sum()) + evidence.duration
    return total


def _pictures(diagnosis: Diagnosis, evidence: Evidence, studio: _Studio) -> dict[str, Any]:
    drawn = zip(maps.map_figures(evidence, diagnosis.findings), figures.MODELS, strict=True)
    force_before, force_after = maps.wrench_figures(evidence)
    rows = figures.best_stretch(evidence)
    return {
        "maps": [
            studio.picture(figure, f"map_{model}", f"Map of the drives, coloured by the mismatch of the {label} model")
            for figure, (model, label, _) in drawn
        ],
        "misfit": [
            studio.picture(figures.lasting_figure(evidence), "lasting", "What lasts of each channel's residual"),
            studio.picture(figures.misfit_figure(diagnosis.misfit), "misfit", "Residual over noise by channel"),
        ],
        "stretch": _stretch(evidence, rows, diagnosis.recordings),
        "channels": [
            studio.picture(
                figures.channel_figure(evidence, name, rows), f"channel_{name}", f"{CHANNEL_NAMES[name]} over time"
            )
            for name in figures.present(evidence)
        ],
        "onsets": studio.picture(
            onset_figure(diagnosis.findings, diagnosis.recordings), "onsets", "Size of each named effect against time"
        )
        if timed(diagnosis.findings)
        else None,
        "scores": _scores(diagnosis, evidence, studio),
        "conditions": _conditions(evidence, studio),
        "gains": studio.picture(
            figures.gain_figure(evidence, title), "gains", "Gain of each effect of the library, with its gate"
        ),
        "unshown": len(evidence.effects) - len(figures.shown_effects(evidence)),
        "forces": [
            studio.picture(force_before, "force_before", "Force that the simulator lacks, over the ground"),
            studio.picture(force_after, "force_after", "Force that the corrected model lacks, over the ground"),
        ],
    }


def _stretch(evidence: Evidence, rows: Any, recordings: Sequence[str]) -> str:
    number = int(evidence.recording[rows[0]])
    start, end = float(evidence.time[rows[0]]), float(evidence.time[rows[-1]]) + evidence.duration
    name = recordings[number] if number < len(recordings) else f"recording {number + 1}"
    return f"stretch in which the correction helps most: {start:.0f} to {end:.0f} s of {name}"


def _scores(diagnosis: Diagnosis, evidence: Evidence, studio: _Studio) -> list[dict[str, Any]]:
    where = {finding.name: finding.where for finding in diagnosis.findings}
    return [
        studio.picture(
            figures.score_figure(evidence, number, where.get(name)),
            f"score_{number + 1}",
            f"Score of {title(name)} over time",
            title=title(name),
        )
        for number, name in enumerate(evidence.findings)
    ]


def _conditions(evidence: Evidence, studio: _Studio) -> list[dict[str, Any]]:
    drawn = [(name, figures.condition_figure(evidence, name)) for name in evidence.regime_names]
    return [
        studio.picture(figure, f"condition_{name}", f"Residual over noise against {name.replace('_', ' ')}")
        for name, figure in drawn
        if figure is not None
    ]


def _fit(fit: Certificate | None, studio: _Studio) -> dict[str, Any] | None:
    if fit is None or not fit.channels:
        return None
    pictures = [
        studio.picture(figures.horizon_figure(horizons, name), f"errors_{number + 1}", f"Held-out errors of {name}")
        for number, (name, horizons) in enumerate(fit.channels.items())
    ]
    return {**tables.fit_table(fit), "pictures": pictures}
