"""The page of what changed: one file without links to anywhere."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ddagr_gym.files import write_text
from ddagr_gym.reporting import change_figures as figures
from ddagr_gym.reporting import change_text as text
from ddagr_gym.reporting.diagnosis_text import FINDING_HEADER, finding_rows
from ddagr_gym.reporting.figures import house_style
from ddagr_gym.reporting.page_template import embedded, page_template

if TYPE_CHECKING:
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


def _context(diagnosis: Diagnosis) -> dict[str, Any]:
    change = diagnosis.change
    if change is None:
        raise ValueError("the diagnosis was made without a calibration")
    return {
        "headline": diagnosis.sentence,
        "robot": diagnosis.robot,
        "drives": list(diagnosis.recordings),
        "ordinary": list(change.ordinary),
        "ground": change.ground,
        "windows": change.windows,
        "level": f"{100.0 * change.level:g}",
        "power": f"{100.0 * change.power:g}",
        "shift_picture": embedded(
            figures.shift_figure(change, diagnosis.verdict), "Shift of every effect over its limit, and what would show"
        ),
        "parameter_picture": embedded(
            figures.parameter_figure(change), "Parameters of robot and ground without and with what changed"
        ),
        "finding_header": FINDING_HEADER,
        "findings": finding_rows(diagnosis),
        "shift_header": text.SHIFT_HEADER,
        "shifts": text.shift_rows(diagnosis),
        "parameter_header": text.PARAMETER_HEADER,
        "parameters": text.parameter_rows(diagnosis),
        "not_compared": text.not_compared(change),
        "checks": [(item.recording, item.sentence) for item in diagnosis.checks],
        "seconds": f"{diagnosis.seconds:.0f}",
    }
