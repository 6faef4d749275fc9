"""``ddagr replay``: recorded drives driven again in the simulator, and what it gets wrong."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro
from tyro.conf import Positional

from ddagr_gym.commands.output import format_table, output_folder, write_text
from ddagr_gym.errors import InputError
from ddagr_gym.progress import Progress

if TYPE_CHECKING:
    from ddagr_gym.recordings.schema import Recording
    from ddagr_gym.replay_analysis.report import ArmReport, ReplayReport
    from ddagr_gym.replay_analysis.run import RunResult

EXAMPLES = (
    "ddagr replay run.parquet --robot ddagr --soil thesis_a1 --output replayed",
    "ddagr replay drive.csv.gz --map drive_steps --robot warthog --soil lete_sand_wong --refit --window 5 -o sand",
    "ddagr replay run_1.parquet run_2.parquet --robot ddagr --soil thesis_a1 --refit --together "
    "--effects slope=0.05 --output both",
)

SAMPLE = "replay_demo.parquet"
"""Simulated drive that ships with the package, in ``ddagr_gym/data``; ``ddagr demo`` replays it."""
SAMPLE_SOIL = "sandy_loam_lll_15"
"""Soil from which the sample's refit starts; it was driven on a somewhat different one."""


@dataclass(frozen=True)
class Arguments:
    """Drive recordings again in the simulator: residuals, error growth, refit, baselines.

    The simulator is driven by the recorded commands and, as a second arm, by the recorded wheel speeds: in short
    windows with free initial states, and from the state at a start over 1, 5 and 30 s and over every whole stretch.
    Parameters and baselines are fitted on one part of each recording (alternate steps, or blocks of time) and judged
    on the other.

    Attributes:
        runs: recordings: Parquet of `ddagr import`, or any source that it takes.
        output: folder to write: replay.json, figures as PNG and SVG, and one page, index.html.
        soil: nominal soil (see `ddagr soils`), or the path of a YAML file with one's own.
        robot: robot that drove (see `ddagr robots`), or a YAML file with one's own; that of the recordings when it is
            left out.
        map: shipped map by name or the path of one's own YAML file, for sources that are not imported yet.
        effects: missing physics to add, name=size or an effects file; may be repeated.
        window: length of the windows with free initial states [s]; fit with windows as long as the horizon that counts.
        refit: fit soil and uncertain robot parameters.
        together: let all runs share one set of fitted parameters; otherwise each is fitted on its own.
        overwrite: replace an output folder that an earlier command wrote.
        threads: of the simulator.
        seed: of the resampled intervals.
        maximum_rows: refuse a recording with more rows or messages.
        maximum_bytes: refuse a recording that unpacks to more bytes.
    """

    runs: Positional[tuple[Path, ...]]
    output: Annotated[Path, tyro.conf.arg(aliases=("-o",))]
    soil: str
    robot: str = ""
    map: str = ""
    effects: Annotated[tuple[str, ...], tyro.conf.UseAppendAction] = ()
    window: float = 2.0
    refit: bool = False
    together: bool = False
    overwrite: bool = False
    threads: int = 1
    seed: int = 0
    maximum_rows: int = 2_000_000
    maximum_bytes: int = 4 * 2**30


def run(arguments: Arguments) -> None:
    """Replay, print the tables, write report, figures and page."""
    from ddagr_gym.physics.effects import load_effects
    from ddagr_gym.presets import get_robot, get_soil
    from ddagr_gym.replay_analysis.arm import ArmSettings

    if arguments.threads < 1:
        raise InputError(f"--threads is {arguments.threads}: give at least 1.")
    soil = get_soil(arguments.soil)
    effects = tuple(effect for item in arguments.effects for effect in load_effects(item))
    recordings = _load(arguments)
    robot = get_robot(robot_name(arguments.robot, recordings))
    settings = ArmSettings(arguments.window, arguments.refit, effects, threads=arguments.threads, seed=arguments.seed)
    groups = [recordings] if arguments.together else [[recording] for recording in recordings]
    with output_folder(arguments.output, overwrite=arguments.overwrite) as folder:
        report = replay_groups(groups, robot, soil, arguments.soil, settings, folder)
    for text in summary(report):
        print(text)
    print(f"\nreport, figures and page: {arguments.output}")


def _load(arguments: Arguments) -> list[Recording]:
    from ddagr_gym.recordings.files import Limits
    from ddagr_gym.recordings.load import load_recording

    if not arguments.runs:
        raise InputError("no recording is given: name one or more files.")
    limits = Limits(arguments.maximum_rows, arguments.maximum_bytes)
    return [load_recording(r, arguments.map or None, arguments.robot or None, limits) for r in arguments.runs]


def robot_name(asked: str, recordings: Sequence[Recording]) -> str:
    """Robot that drove: the one asked for, else the recordings' own.

    Raises:
        InputError: recordings of two robots, or none named.
    """
    names = sorted({recording.meta.robot for recording in recordings} - {""})
    if len(names) > 1:
        raise InputError(f"the runs are of the robots {', '.join(names)}: replay one robot at a time.")
    if not asked and not names:
        raise InputError("the recordings do not say which robot drove: name it with --robot.")
    return asked or names[0]


def replay_groups(
    groups: Sequence[Sequence[Recording]], robot: Any, soil: Any, soil_name: str, settings: Any, folder: Path
) -> ReplayReport:
    """Replay groups of recordings and write report, figures and page into a folder.

    Args:
        groups: recordings that share fitted parameters.
        robot: nominal.
        soil: nominal.
        soil_name: for the report.
        settings: :class:`~ddagr_gym.replay_analysis.arm.ArmSettings`.
        folder: that exists.
    """
    from ddagr_gym.replay_analysis.report import save_report
    from ddagr_gym.replay_analysis.run import make_report, replay_run, steps
    from ddagr_gym.reporting.replay_page import replay_page

    results = []
    with Progress(steps(len(groups)), "replaying", stream=sys.stderr) as progress:
        for group in groups:
            results.append(replay_run(group, robot, soil, settings, progress.advance))
    report = make_report(results, robot.name, soil_name, settings)
    figures = _draw(results, folder)
    save_report(report, folder / "replay.json")
    write_text(folder / "index.html", replay_page(report, figures))
    return report


def _draw(results: Sequence[RunResult], folder: Path) -> dict[tuple[int, str], list[Path]]:
    from ddagr_gym.reporting.replay_figures import replay_overview, replay_residuals

    figures: dict[tuple[int, str], list[Path]] = {}
    with Progress(sum(len(result.arms) for result in results), "drawing") as progress:
        for number, result in enumerate(results):
            stem = _stem(result, number, len(results))
            for arm in result.arms:
                title = f"{', '.join(result.report.sources)}, driven by {_DRIVEN[arm.report.drive]}"
                overview, _ = replay_overview(arm, folder / f"{stem}_{arm.report.drive}", title)
                detail, _ = replay_residuals(arm, folder / f"{stem}_{arm.report.drive}_residuals", title)
                figures[number, arm.report.drive] = [overview, detail]
                progress.advance()
    return figures


_DRIVEN = {"commands": "commands", "encoders": "wheel speeds"}
_SHORT = ("simulator", "refitted", "no slip", "effective track")
"""Of the models, in their order."""


def _stem(result: RunResult, number: int, count: int) -> str:
    name = Path(result.report.sources[0]).name.split(".", 1)[0] or "run"
    name = f"{name}_and_{len(result.report.sources) - 1}_more" if len(result.report.sources) > 1 else name
    return f"{number + 1}_{name}" if count > 1 else name


def summary(report: ReplayReport) -> list[str]:
    """Tables of a report as text, one per arm of each run."""
    texts = []
    for item in report.runs:
        texts.append(f"\n{', '.join(item.sources)}: {item.seconds:.0f} s; {item.split}")
        texts += [f"note: {note}" for note in item.notes]
        texts += [arm_text(arm) for arm in item.arms]
        texts.append(f"replayed in {item.cpu_seconds:.1f} s of one core")
    return texts


def arm_text(arm: ArmReport) -> str:
    """Errors and residuals of one arm as tables."""
    from ddagr_gym.replay_analysis.report import MODELS

    models = [m for m in MODELS if any(e.model == m for e in arm.horizons)]
    rows = []
    for horizon, metric in dict.fromkeys((e.horizon, e.metric) for e in arm.horizons if e.error.count):
        found = {e.model: e for e in arm.horizons if (e.horizon, e.metric) == (horizon, metric)}
        sizes = [_number(found[m].error.rms) for m in models]
        first = found[models[0]]
        rows.append((f"{metric} after {horizon:g} s", first.unit, str(first.error.count), *sizes))
    errors = format_table(("root mean square error", "unit", "windows", *models), rows) if rows else "no unseen windows"
    names = [table.model for table in arm.residuals]
    channels = [
        (c.channel, c.unit, _number(c.noise), *(_number(t.channels[k].rms) for t in arm.residuals),
         *(_number(t.channels[k].bias) for t in arm.residuals), f"{arm.residuals[-1].channels[k].correlation:.2f}")
        for k, c in enumerate(arm.residuals[0].channels)
    ]  # fmt: skip
    head = ("residual", "unit", "noise", *(f"rms {n}" for n in names), *(f"bias {n}" for n in names), "correlation")
    parts = [f"\ndriven by {_DRIVEN[arm.drive]}", errors]
    parts += [format_table(head, channels)] if channels else []
    parts += [f"note: {note}" for note in arm.notes]
    parts.append(_fit_text(arm))
    parts.append(f"simulator: {arm.speed.times_real_time:.0f} times real time on one core")
    return "\n".join(part for part in parts if part)


def lead_text(report: ReplayReport) -> str:
    """Heading errors after 5 s of every model as one short table, a row per run and arm."""
    from ddagr_gym.replay_analysis.report import MODELS, lead_errors

    rows = []
    for item in report.runs:
        for arm in item.arms:
            found = lead_errors(arm)
            errors = (_number(found[m].error.rms) if m in found else "-" for m in MODELS)
            rows.append((", ".join(item.sources), _DRIVEN[arm.drive], *errors))
    return format_table(("heading error after 5 s [rad]", "driven by", *_SHORT), rows)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def _fit_text(arm: ArmReport) -> str:
    if arm.refit is None:
        return ""
    rows = [
        (p.name, "ln factor" if p.unit == "-" else p.unit, f"{p.value:+.3f}", f"{p.window_deviation:.3f}",
         f"{p.prior:.3f}", f"{p.pull:+.1f}", "at bound" if p.at_bound else "pulled" if abs(p.pull) > 3.0 else "")
        for p in arm.refit.parameters
    ]  # fmt: skip
    return format_table(("refitted", "unit", "value", "deviation", "prior", "pull", ""), rows)
