"""The page of what changed: one file without links to anywhere."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ddagr_gym.diagnosis.answer.change import BEFORE
from ddagr_gym.diagnosis.result.near_miss import few_drives_in_words
from ddagr_gym.files import write_text
from ddagr_gym.reporting import change_figures as figures
from ddagr_gym.reporting import change_text as text
from ddagr_gym.reporting.figures import house_style
from ddagr_gym.reporting.onset_figure import onset_figure, timed
from ddagr_gym.reporting.page_template import embedded, page_template

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.answer.change import Change
    from ddagr_gym.diagnosis.answer.verdict import Diagnosis

PAGE = "index.html"


def write_page(folder: Path, diagnosis: Diagnosis) -> None:
    """Write ``index.html``, its pictures in it.

    Args:
        folder: that exists.
        diagnosis: made with a calibration.

    Raises:
        InputError: matplotlib or jinja2 is not installed.
    """
    page = page_template("change.html")
    with house_style():
        context = _context(diagnosis)
    write_text(folder / PAGE, page.render(context))


def _sides(diagnosis: Diagnosis, change: Change) -> list[tuple[str, str]]:
    """Names of the drives before, or of ordinary ones, and of those that are asked about, side by side."""
    known, asked = list(change.ordinary), list(diagnosis.recordings)
    rows = max(len(known), len(asked))
    return [(known[k] if k < len(known) else "", asked[k] if k < len(asked) else "") for k in range(rows)]


def _context(diagnosis: Diagnosis) -> dict[str, Any]:
    change = diagnosis.change
    if change is None:
        raise ValueError("the diagnosis was made without a calibration")
    return {
        "headline": diagnosis.sentence,
        "robot": diagnosis.robot,
        "sides": _sides(diagnosis, change),
        "before": change.against == BEFORE,
        "certificate": text.certified(diagnosis),
        "slope": text.slope_before(change),
        "few_drives": few_drives_in_words(change),
        "first_estimate": text.first_estimate(diagnosis),
        "ground": change.ground,
        "windows": change.windows,
        "usual": "" if change.certificate is None else f"{100.0 * change.certificate.expected:.0f}",
        "level": f"{100.0 * change.level:g}",
        "power": f"{100.0 * change.power:g}",
        "shift_picture": embedded(
            figures.shift_figure(change, diagnosis.verdict), "Shift of every effect over its limit, and what would show"
        ),
        "size_picture": embedded(
            figures.size_figure(change, diagnosis.verdict), "Size of every effect before and after, side by side"
        ),
        "forecast_picture": None
        if change.certificate is None
        else embedded(
            figures.forecast_figure(change.certificate, bool(diagnosis.findings)),
            "Losses of forecasts before and after, side by side",
        ),
        "onset_picture": embedded(
            onset_figure(diagnosis.findings, diagnosis.recordings), "Size of each named effect against time"
        )
        if timed(diagnosis.findings)
        else None,
        "parameter_picture": embedded(
            figures.parameter_figure(change), "Parameters of robot and ground without and with what changed"
        ),
        "channel_picture": embedded(
            figures.channel_figure(change), "Error of the model in each channel, before and after"
        )
        if change.channels
        else None,
        "channel_header": text.CHANNEL_HEADER,
        "channels": text.channel_rows(diagnosis),
        "finding_header": text.CHANGED_HEADER,
        "findings": text.changed_rows(diagnosis),
        "shift_header": text.SHIFT_HEADER,
        "shifts": text.shift_rows(diagnosis),
        "parameter_header": text.PARAMETER_HEADER,
        "parameters": text.parameter_rows(diagnosis),
        "not_compared": text.not_compared(change),
        "checks": [(item.recording, item.sentence) for item in diagnosis.checks],
        "seconds": f"{diagnosis.seconds:.0f}",
    }
