"""A replay's report as one page, beside the figures that it shows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path

from ddagr_gym.replay_analysis.horizons import METRICS
from ddagr_gym.replay_analysis.intervals import ErrorStatistics
from ddagr_gym.replay_analysis.report import MODELS, DriveModeReport, ReplayReport, RunReport, lead_errors
from ddagr_gym.reporting.replay_figures import MODEL_STYLES

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 68rem; margin: 2rem auto; padding: 0 1rem; color: #22262a; }
h1 { font-size: 1.5rem } h2 { font-size: 1.25rem; margin-top: 3rem; overflow-wrap: anywhere } h3 { font-size: 1.05rem }
.wide { overflow-x: auto; margin: 1rem 0 } img { width: 100%; min-width: 44rem; height: auto; display: block }
table { border-collapse: collapse; font-variant-numeric: tabular-nums }
th, td { padding: 0.2rem 1rem 0.2rem 0; text-align: right; border-bottom: 1px solid #e3e5e7; white-space: nowrap }
th { vertical-align: bottom; white-space: normal }
th:first-child, td:first-child { text-align: left; white-space: normal }
tr.new td { border-top: 1px solid #9aa0a6 } small { color: #6e757c } p.note { margin: 0.2rem 0; color: #5a5f64 }
"""

DRIVEN = {"commands": "commands", "encoders": "wheel speeds"}
LEAD = 5.0
"""Horizon [s] of the table at the head."""

Figures = Mapping[tuple[int, str], Sequence[Path]]


def replay_page(report: ReplayReport, figures: Figures) -> str:
    """HTML of a report; its figures are named, not held, so that they must lie in the page's folder.

    Args:
        report: of the replay.
        figures: PNG files by index of the run and drive mode.
    """
    effects = "; effects: " + ", ".join(escape(str(e["name"])) for e in report.effects) if report.effects else ""
    lines = [
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>Replay of {escape(report.robot)} on {escape(report.soil)}</title><style>{STYLE}</style></head><body>",
        f"<h1>Replay of {escape(report.robot)} on {escape(report.soil)}</h1>",
        _lead(report),
        f"<p>Errors are judged on the part of each recording that no fit has seen; brackets hold 95 %. Residuals come "
        f"from windows of {report.window:g} s with free initial states{effects}. All numbers are in "
        '<a href="replay.json">replay.json</a>.</p>',
    ]
    for number, run in enumerate(report.runs):
        lines += _run(run, number, figures)
    return "\n".join([*lines, "</body></html>", ""])


def _lead(report: ReplayReport) -> str:
    """What most readers came for: one error of every model, per run and drive mode."""
    rows = []
    for number, run in enumerate(report.runs):
        for mode in run.arms:
            found = lead_errors(mode, LEAD)
            name = f'<a href="#run{number + 1}">{escape(_names(run))}</a>'
            cells = [_size(found[m].error) if m in found else "–" for m in MODELS]
            rows.append(_row([name, DRIVEN[mode.drive], *cells]))
    head = [f"heading error after {LEAD:g} s [rad], r.m.s.", "driven by", *(MODEL_STYLES[m][0] for m in MODELS)]
    return _table(head, rows)


def _names(run: RunReport) -> str:
    return ", ".join(run.sources)


def _run(run: RunReport, number: int, figures: Figures) -> list[str]:
    lines = [
        f'<h2 id="run{number + 1}">{escape(_names(run))}</h2>',
        f"<p>{run.seconds:.0f} s, {run.rows} rows, replayed in {run.cpu_seconds:.1f} s of one core. "
        f"Split for fits: {escape(run.split)}.</p>",
        *_notes(run.notes),
    ]
    for mode in run.arms:
        lines += [f"<h3>Driven by the recorded {DRIVEN[mode.drive]}</h3>", *_notes(mode.notes)]
        lines += [_image(path) for path in figures.get((number, mode.drive), ())]
        lines += [_horizon_table(mode), _residual_table(mode), _parameter_table(mode)]
        lines.append(
            f"<p>The simulator ran {mode.speed.times_real_time:.0f} times as fast as the robot on one core.</p>"
        )
    return lines


def _notes(notes: Iterable[str]) -> list[str]:
    return [f'<p class="note">{escape(note[:1].upper() + note[1:])}</p>' for note in notes]


def _image(path: Path) -> str:
    name = escape(path.name)
    return f'<div class="wide"><a href="{name}"><img alt="{escape(path.stem)}" src="{name}" loading="lazy"></a></div>'


def _table(head: Sequence[str], rows: Sequence[str]) -> str:
    cells = "".join(f"<th>{escape(item)}</th>" for item in head)
    return f'<div class="wide"><table><tr>{cells}</tr>{"".join(rows)}</table></div>'


def _row(cells: Sequence[str], new: bool = False) -> str:
    start = '<tr class="new">' if new else "<tr>"
    return start + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"


def _horizon_table(mode: DriveModeReport) -> str:
    models = [m for m in MODELS if any(e.model == m for e in mode.horizons)]
    rows, before = [], 0.0
    for horizon, metric in dict.fromkeys((e.horizon, e.metric) for e in mode.horizons if e.error.count):
        found = {e.model: e for e in mode.horizons if (e.horizon, e.metric) == (horizon, metric)}
        unit, count = METRICS[metric][0], found[models[0]].error.count
        name = f"{metric.replace('_', ' ')} after {horizon:g} s [{unit}]"
        rows.append(_row([name, str(count), *(_size(found[m].error) for m in models)], horizon != before > 0.0))
        before = horizon
    return _table(["root mean square error", "windows", *(MODEL_STYLES[m][0] for m in models)], rows) if rows else ""


def _size(error: ErrorStatistics) -> str:
    if error.rms is None:
        return "–"
    interval = error.rms_interval
    return f"{error.rms:.3g}" + ("" if interval is None else f" <small>({interval[0]:.2g}–{interval[1]:.2g})</small>")


def _residual_table(mode: DriveModeReport) -> str:
    tables = mode.residuals
    if not tables[0].channels:
        return ""
    head = ["residual, unseen windows", "noise"]
    for table in tables:
        head += [f"r.m.s., {MODEL_STYLES[table.model][0]}", "mean"]
    rows = []
    for k, channel in enumerate(tables[0].channels):
        sizes = [f"{value:.3g}" for table in tables for value in (table.channels[k].rms, table.channels[k].bias)]
        unit = channel.unit.replace("^2", "²")
        rows.append(_row([f"{channel.channel.replace('_', ' ')} [{unit}]", f"{channel.noise:.3g}", *sizes]))
    return _table(head, rows)


def _parameter_table(mode: DriveModeReport) -> str:
    if mode.refit is None:
        return ""
    rows = []
    for p in mode.refit.parameters:
        doubt = "at its bound" if p.at_bound else "pulled" if abs(p.pull) > 3.0 else ""
        unit = "ln factor" if p.unit == "-" else p.unit
        numbers = [f"{p.value:+.3g}", f"{p.window_deviation:.2g}", f"{p.prior:.2g}", f"{p.pull:+.1f}", doubt]
        rows.append(_row([f"{p.name.replace('_', ' ')} [{unit}]", *numbers]))
    return _table(["refitted parameter, 0 is nominal", "value", "deviation", "prior", "value / prior", ""], rows)
