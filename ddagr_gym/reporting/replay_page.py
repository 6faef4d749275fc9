"""A replay's report as one page, beside the figures that it shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ddagr_gym.replay_analysis.horizons import METRICS
from ddagr_gym.replay_analysis.intervals import ErrorStatistics
from ddagr_gym.replay_analysis.report import MODELS, DriveModeReport, ReplayReport, lead_errors
from ddagr_gym.reporting.page_template import page_template
from ddagr_gym.reporting.parameter_units import unit_in_words
from ddagr_gym.reporting.replay_figures import MODEL_STYLES
from ddagr_gym.reporting.replay_text import DRIVEN_BY, PULLED

RECORDED = "recorded"
"""Stands for a drive mode with figures of what no model is compared with: currents and voltages."""
LEAD = 5.0
"""Horizon [s] of the table at the head."""

Figures = Mapping[tuple[int, str], Sequence[Path]]


@dataclass(frozen=True)
class _Table:
    """Rows under a head; a cell is text or an error, and a line is drawn above the rows ``new``."""

    head: Sequence[str]
    rows: Sequence[Sequence[str | ErrorStatistics]]
    new: frozenset[int] = frozenset()


def replay_page(report: ReplayReport, figures: Figures) -> str:
    """HTML of a report; it names its figures, which must lie in the page's folder.

    Args:
        report: of the replay.
        figures: PNG files by index of the run and drive mode.

    Raises:
        InputError: jinja2 is not installed.
    """
    # what most readers came for: one error of every model, per run and drive mode
    leads = []
    for number, run in enumerate(report.runs):
        for mode in run.arms:
            found = lead_errors(mode, LEAD)
            leads.append((number, mode, [found[m].error if m in found else None for m in MODELS]))
    page: str = page_template("replay.html").render(
        report=report, figures=figures, recorded=RECORDED, lead=LEAD, leads=leads, driven=DRIVEN_BY, tables=_tables,
        models=[MODEL_STYLES[m][0] for m in MODELS],
    )  # fmt: skip
    return page


def _tables(mode: DriveModeReport) -> list[_Table | None]:
    return [_horizon_table(mode), _residual_table(mode), _parameter_table(mode)]


def _horizon_table(mode: DriveModeReport) -> _Table | None:
    models = [m for m in MODELS if any(e.model == m for e in mode.horizons)]
    pairs = list(dict.fromkeys((e.horizon, e.metric) for e in mode.horizons if e.error.count))
    rows: list[Sequence[str | ErrorStatistics]] = []
    for horizon, metric in pairs:
        found = {e.model: e.error for e in mode.horizons if (e.horizon, e.metric) == (horizon, metric)}
        name = f"{metric.replace('_', ' ')} after {horizon:g} s [{METRICS[metric][0]}]"
        rows.append([name, str(found[models[0]].count), *(found[m] for m in models)])
    new = frozenset(k for k in range(1, len(pairs)) if pairs[k][0] != pairs[k - 1][0])
    head = ["root mean square error", "windows", *(MODEL_STYLES[m][0] for m in models)]
    return _Table(head, rows, new) if rows else None


def _residual_table(mode: DriveModeReport) -> _Table | None:
    head = ["residual, unseen windows", "noise"]
    for table in mode.residuals:
        head += [f"r.m.s., {MODEL_STYLES[table.model][0]}", "mean"]
    rows = []
    for k, channel in enumerate(mode.residuals[0].channels):
        found = [table.channels[k] for table in mode.residuals]
        sizes = [f"{value:.3g}" for item in found for value in (item.rms, item.bias)]
        unit = channel.unit.replace("^2", "²")
        rows.append([f"{channel.channel.replace('_', ' ')} [{unit}]", f"{channel.noise:.3g}", *sizes])
    return _Table(head, rows) if rows else None


def _parameter_table(mode: DriveModeReport) -> _Table | None:
    if mode.refit is None:
        return None
    rows = []
    for p in mode.refit.parameters:
        doubt = "at its bound" if p.at_bound else "pulled" if abs(p.pull) > PULLED else ""
        numbers = [f"{p.value:+.3g}", f"{p.window_deviation:.2g}", f"{p.prior:.2g}", f"{p.pull:+.1f}", doubt]
        rows.append([f"{p.name.replace('_', ' ')} [{unit_in_words(p.name, p.unit)}]", *numbers])
    return _Table(["refitted parameter, 0 is nominal", "value", "deviation", "prior", "value / prior", ""], rows)
