"""A replay's report as one page that needs no other file."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from ddagr_gym.replay.horizons import METRICS
from ddagr_gym.replay.report import MODELS, ArmReport, ErrorStatistics, ReplayReport, RunReport
from ddagr_gym.reporting.replay_figures import MODEL_STYLES

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 68rem; margin: 2rem auto; padding: 0 1rem; color: #22262a; }
h1 { font-size: 1.5rem } h2 { font-size: 1.25rem; margin-top: 2.5rem } h3 { font-size: 1.05rem }
img { max-width: 100%; height: auto; display: block; margin: 1rem 0; }
table { border-collapse: collapse; margin: 0.8rem 0; font-variant-numeric: tabular-nums; }
th, td { padding: 0.2rem 0.8rem 0.2rem 0; text-align: right; border-bottom: 1px solid #e3e5e7; white-space: nowrap }
th:first-child, td:first-child { text-align: left } td small { color: #6e757c } p.note { margin: 0.2rem 0; color: #444 }
"""

DRIVES = {"commands": "Driven by the recorded commands", "encoders": "Driven by the recorded wheel speeds"}


def replay_page(report: ReplayReport, figures: Mapping[tuple[int, str], Sequence[Path]]) -> str:
    """HTML of a report with its figures inside.

    Args:
        report: of the replay.
        figures: PNG files by index of the run and drive of the arm.
    """
    effects = "; effects: " + ", ".join(escape(str(e["name"])) for e in report.effects) if report.effects else ""
    lines = [
        '<!doctype html><html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>Replay on {escape(report.soil)}</title><style>{STYLE}</style></head><body>",
        f"<h1>Replay of {escape(report.robot)} on {escape(report.soil)}</h1>",
        f"<p>Windows of {report.window:g} s with free initial states{effects}. "
        "Errors are judged on the part of each recording that no fit has seen; brackets hold 95 %.</p>",
    ]
    for number, run in enumerate(report.runs):
        lines += _run(run, number, figures)
    return "\n".join([*lines, "</body></html>", ""])


def _run(run: RunReport, number: int, figures: Mapping[tuple[int, str], Sequence[Path]]) -> list[str]:
    lines = [f"<h2>{escape(', '.join(run.sources))}</h2>", f"<p>{run.seconds:.0f} s, {run.rows} rows. {run.split}.</p>"]
    lines += [f'<p class="note">{escape(note)}</p>' for note in run.notes]
    for arm in run.arms:
        lines.append(f"<h3>{DRIVES[arm.drive]}</h3>")
        lines += [_image(path) for path in figures.get((number, arm.drive), ())]
        lines += [_horizon_table(arm), _parameter_table(arm)]
        lines.append(
            f"<p>The simulator ran {arm.speed.times_real_time:.0f} times as fast as the robot on one core.</p>"
        )
    return lines


def _image(path: Path) -> str:
    data = base64.b64encode(path.read_bytes()).decode()
    return f'<img alt="{escape(path.stem)}" src="data:image/png;base64,{data}">'


def _horizon_table(arm: ArmReport) -> str:
    models = [m for m in MODELS if any(e.model == m for e in arm.horizons)]
    head = "".join(f"<th>{escape(MODEL_STYLES[m][0])}</th>" for m in models)
    rows = []
    for horizon, metric in dict.fromkeys((e.horizon, e.metric) for e in arm.horizons):
        found = {e.model: e for e in arm.horizons if (e.horizon, e.metric) == (horizon, metric)}
        if any(e.error.count for e in found.values()):
            unit = METRICS[metric][0]
            cells = "".join(f"<td>{_size(found[m].error)}</td>" for m in models)
            rows.append(f"<tr><td>{metric.replace('_', ' ')} after {horizon:g} s [{unit}]</td>{cells}</tr>")
    return f"<table><tr><th>root mean square error</th>{head}</tr>{''.join(rows)}</table>"


def _size(error: ErrorStatistics) -> str:
    if error.rms is None:
        return "–"
    interval = error.rms_interval
    return f"{error.rms:.3g}" + ("" if interval is None else f" <small>({interval[0]:.2g}–{interval[1]:.2g})</small>")


def _parameter_table(arm: ArmReport) -> str:
    if arm.refit is None:
        return ""
    rows = []
    for p in arm.refit.parameters:
        doubt = " at its bound" if p.at_bound else " pulled" if abs(p.pull) > 3.0 else ""
        unit = "ln factor" if p.unit == "-" else p.unit
        rows.append(
            f"<tr><td>{p.name.replace('_', ' ')} [{unit}]</td><td>{p.value:+.3g}</td><td>{p.window_deviation:.2g}</td>"
            f"<td>{p.prior:.2g}</td><td>{p.pull:+.1f}{doubt}</td></tr>"
        )
    head = "<tr><th>refitted parameter, 0 nominal</th><th>value</th><th>deviation</th><th>prior</th><th>pull</th></tr>"
    return f"<table>{head}{''.join(rows)}</table>"
