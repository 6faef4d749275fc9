"""A replay's report as text."""

from __future__ import annotations

from ddagr_gym.replay_analysis.report import MODELS, DriveModeReport, ReplayReport, lead_errors
from ddagr_gym.reporting.parameter_units import unit_in_words
from ddagr_gym.reporting.text_table import format_table, short

DRIVEN_BY = {"commands": "commands", "encoders": "wheel speeds"}
"""What drove the simulator, in words."""

PULLED = 3.0
"""Value over prior from which a fitted parameter is marked [-]: one in 370 normal variables lies beyond (ours)."""

LEAD_HEADER = ("heading error after 5 s [rad]", "driven by", "simulator", "refitted", "no slip", "effective track")
"""Of :func:`lead_rows`; the models in their order."""


def summary(report: ReplayReport) -> list[str]:
    """Tables of a report as text, one per drive mode of each run."""
    texts = []
    for item in report.runs:
        texts.append(f"\n{', '.join(item.sources)}: {item.seconds:.0f} s; {item.split}")
        texts += [f"note: {note}" for note in item.notes]
        texts += [drive_mode_text(mode) for mode in item.arms]
        texts.append(f"replayed in {item.cpu_seconds:.1f} s of one core")
    return texts


def drive_mode_text(mode: DriveModeReport) -> str:
    """Errors and residuals in one drive mode as tables."""
    models = [m for m in MODELS if any(e.model == m for e in mode.horizons)]
    rows = []
    for horizon, metric in dict.fromkeys((e.horizon, e.metric) for e in mode.horizons if e.error.count):
        found = {e.model: e for e in mode.horizons if (e.horizon, e.metric) == (horizon, metric)}
        sizes = [short(found[m].error.rms) for m in models]
        first = found[models[0]]
        rows.append((f"{metric} after {horizon:g} s", first.unit, str(first.error.count), *sizes))
    errors = format_table(("root mean square error", "unit", "windows", *models), rows) if rows else "no unseen windows"
    names = [table.model for table in mode.residuals]
    channels = [
        (c.channel, c.unit, short(c.noise), *(short(t.channels[k].rms) for t in mode.residuals),
         *(short(t.channels[k].bias) for t in mode.residuals), f"{mode.residuals[-1].channels[k].correlation:.2f}")
        for k, c in enumerate(mode.residuals[0].channels)
    ]  # fmt: skip
    head = ("residual", "unit", "noise", *(f"rms {n}" for n in names), *(f"bias {n}" for n in names), "correlation")
    parts = [f"\ndriven by {DRIVEN_BY[mode.drive]}", errors]
    parts += [format_table(head, channels)] if channels else []
    parts += [f"note: {note}" for note in mode.notes]
    parts.append(_fit_text(mode))
    parts.append(f"simulator: {mode.speed.times_real_time:.0f} times real time on one core")
    return "\n".join(part for part in parts if part)


def lead_text(report: ReplayReport) -> str:
    """Heading errors after 5 s of every model as one short table, a row per run and drive mode."""
    return format_table(LEAD_HEADER, lead_rows(report))


def lead_rows(report: ReplayReport) -> list[tuple[str, ...]]:
    """Heading errors after 5 s under :data:`LEAD_HEADER`."""
    rows = []
    for item in report.runs:
        for mode in item.arms:
            found = lead_errors(mode)
            errors = (short(found[m].error.rms) if m in found else "-" for m in MODELS)
            rows.append((", ".join(item.sources), DRIVEN_BY[mode.drive], *errors))
    return rows


def _fit_text(mode: DriveModeReport) -> str:
    if mode.refit is None:
        return ""
    rows = [
        (p.name, unit_in_words(p.name, p.unit), f"{p.value:+.3f}", f"{p.window_deviation:.3f}",
         f"{p.prior:.3f}", f"{p.pull:+.1f}", "at bound" if p.at_bound else "pulled" if abs(p.pull) > PULLED else "")
        for p in mode.refit.parameters
    ]  # fmt: skip
    return format_table(("refitted", "unit", "value", "deviation", "prior", "pull", ""), rows)
