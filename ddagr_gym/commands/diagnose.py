"""``ddagr diagnose``: which physics the nominal simulator leaves out, from recordings."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro
from tyro.conf import Positional

from ddagr_gym.commands.extras import need
from ddagr_gym.commands.output import check_output_folder, format_table, output_folder
from ddagr_gym.commands.ranges import check_at_least
from ddagr_gym.errors import InputError
from ddagr_gym.progress import Progress

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.gates.thresholds import Thresholds
    from ddagr_gym.diagnosis.pipeline import Outcome, Task
    from ddagr_gym.diagnosis.preprocessing.data_checks import DataDoubt
    from ddagr_gym.diagnosis.result.verdict import Diagnosis
    from ddagr_gym.recordings.schema import Recording

EXAMPLES = (
    "ddagr diagnose run_1.csv.gz run_2.csv.gz run_3.csv.gz --output diagnosis",
    "ddagr diagnose drives --robot ddagr --soil thesis_a1 --thresholds thresholds.json --output diagnosis",
)

PAGE = "index.html"
_SAME_WINDOW = 0.5
"""Difference of lengths of windows up to which gates are taken to hold [s] (ours; short segments shorten windows)."""

_ENDINGS = (".csv", ".csv.gz", ".parquet", ".mcap", ".bag")
_SHOWN = ("position", "pose_yaw", "heading_by_gyro", "yaw_rate", "speed", "specific_force_x", "specific_force_y")


@dataclass(frozen=True)
class Arguments:
    """Find the physics that a nominal simulator leaves out: where, what, how big, how sure.

    Several recordings of one robot on one ground are diagnosed together; each is then predicted by a model whose sizes
    were fitted to the others. With a single one its halves judge each other, which is weaker: place, day and biases are
    the same. A diagnosis that was stopped goes on after its last finished step when the command is given again.

    Attributes:
        runs: recordings (Parquet of `ddagr import`, or any source that it takes), or folders of them.
        output: folder to write: index.html with its figures, diagnosis.json, evidence.npz, and what `gym.make`,
            `ddagr simulate` and `ddagr replay` load: effects.json or effects.yaml with the effects that were named, and
            robot.yaml and soil.yaml with the refitted nominal parameters.
        robot: nominal robot (see `ddagr robots`), or the path of a YAML file with one's own.
        soil: nominal soil (see `ddagr soils`), or the path of a YAML file with one's own.
        map: shipped map by name or the path of one's own YAML file, for sources that are not imported yet.
        thresholds: of `ddagr null-bank`, made with these or similar drives; those that ship with the package when it is
            left out.
        soil_uncertainty: factor on how far the soil may be from the nominal one; larger where it is only guessed. The
            thresholds must be of the same.
        window: length of the windows [s]; that of the thresholds when it is left out.
        stride: seconds between the starts of windows; their length, which uses all samples, when it is left out.
        seed: of the resampling.
        threads: of the simulator.
        names_only: only name what is missing: no errors on unseen drives, no unnamed terms, no next drive, no page.
        overwrite: replace an output folder that an earlier command wrote.
        maximum_rows: refuse a recording with more rows or messages.
        maximum_bytes: refuse a recording that unpacks to more bytes.
    """

    runs: Positional[tuple[Path, ...]]
    output: Annotated[Path, tyro.conf.arg(aliases=("-o",))]
    robot: str = "ddagr"
    soil: str = "thesis_a1"
    map: str = ""
    thresholds: Path | None = None
    soil_uncertainty: float = 1.0
    window: float | None = None
    stride: float | None = None
    seed: int = 0
    threads: int = 2
    names_only: bool = False
    overwrite: bool = False
    maximum_rows: int = 2_000_000
    maximum_bytes: int = 4 * 2**30


def run(arguments: Arguments) -> int | None:
    """Diagnose, write the folder, print the answer; 130 when interrupted."""
    from ddagr_gym.diagnosis.preprocessing.input_requirements import check_recordings
    from ddagr_gym.diagnosis.store import StepStore, part_folder

    check_output_folder(arguments.output, overwrite=arguments.overwrite)
    need("ruptures", *(() if arguments.names_only else ("sklearn", "jinja2", "matplotlib")))
    task = _task(arguments)
    check_recordings(task.recordings, task.robot, task.setting)
    parts = part_folder(arguments.output.expanduser().resolve())
    store = StepStore(parts, task.key())
    try:
        outcome = diagnosed(task, store)
        with output_folder(arguments.output, overwrite=arguments.overwrite) as folder:
            write_outcome(outcome, folder, page=not arguments.names_only)
    except KeyboardInterrupt:
        print(f"ddagr: interrupted; the same command goes on from {parts}.", file=sys.stderr)
        return 130
    store.clear()
    print(outcome_text(outcome.diagnosis))
    print(f"\n{'' if arguments.names_only else 'page, figures, '}diagnosis.json and effects.json: {arguments.output}")
    return None


def _task(arguments: Arguments) -> Task:
    from ddagr_gym.diagnosis.pipeline import Task
    from ddagr_gym.diagnosis.setting import Setting
    from ddagr_gym.identification.nuisances import NuisancePriors
    from ddagr_gym.presets import full_name, get_robot, get_soil, is_file
    from ddagr_gym.recordings.files import Limits
    from ddagr_gym.recordings.load import load_recording

    check_at_least(arguments, threads=1, window=1.0, stride=0.1, seed=0)
    robot, soil = get_robot(arguments.robot), get_soil(arguments.soil)
    limits = Limits(arguments.maximum_rows, arguments.maximum_bytes)
    recordings: list[Recording] = [
        load_recording(path, arguments.map or None, arguments.robot, limits) for path in _sources(arguments.runs)
    ]
    priors = NuisancePriors().with_soil(arguments.soil_uncertainty)
    thresholds = _thresholds(arguments)
    window = thresholds.duration if arguments.window is None else arguments.window
    if abs(window - thresholds.duration) > _SAME_WINDOW:
        print(
            f"ddagr: warning: the thresholds were made with windows of {thresholds.duration:g} s instead of "
            f"{window:g} s, which show other effects: make others with `ddagr null-bank --window {window:g}`.",
            file=sys.stderr,
        )
    setting = Setting(priors=priors, threads=arguments.threads).with_windows(window, arguments.stride)
    return Task(
        robot,
        soil,
        tuple(recordings),
        thresholds,
        setting,
        arguments.seed,
        arguments.names_only,
        full_name(arguments.soil),
        full_name(arguments.robot) if is_file(arguments.robot) else "",
    )


def _sources(runs: Sequence[Path]) -> list[Path]:
    """Files as they are; of a folder the recordings in it, unless it is one itself (a ROS 2 bag)."""
    found: list[Path] = []
    for path in runs:
        if not path.is_dir() or (path / "metadata.yaml").exists() or any(path.glob("*.db3")):
            found.append(path)
            continue
        inside = sorted(item for item in path.iterdir() if item.is_file() and item.name.endswith(_ENDINGS))
        if not inside:
            raise InputError(f"the folder {path} holds no recording ({', '.join(_ENDINGS)}): name another one.")
        found += inside
    if not found:
        raise InputError("no recording is given: name one or more files, or a folder of them.")
    return found


def _thresholds(arguments: Arguments) -> Thresholds:
    from ddagr_gym.commands.gates import gates_for
    from ddagr_gym.diagnosis.gates.threshold_files import default_thresholds

    found = gates_for(arguments.thresholds, arguments.robot, arguments.soil, arguments.soil_uncertainty)
    return default_thresholds(arguments.robot) if found is None else found


def diagnosed(task: Task, store: Any = None) -> Outcome:
    """Run all steps with progress on standard error.

    Args:
        task: what and how.
        store: :class:`~ddagr_gym.diagnosis.store.StepStore` of finished steps.
    """
    from ddagr_gym.diagnosis import pipeline

    with _steps(len(task.steps), store) as began:
        return pipeline.run(task, store, began, _told)


def _told(text: str) -> None:
    """What is being done inside a step, on standard error."""
    print(f"ddagr diagnose:   {text}", file=sys.stderr, flush=True)


@contextmanager
def _steps(count: int, store: Any) -> Iterator[Any]:
    """Function to call with the name of each step when it begins; the last one ends with the block."""
    names: list[str] = []
    with Progress(count, "diagnosing") as progress:

        def began(name: str) -> None:
            if names:
                progress.advance()
            names.append(name)
            kept = ", kept from before" if store is not None and store.has(name) else ""
            print(f"ddagr diagnose: step {len(names)} of {count}, {name}{kept}", file=sys.stderr, flush=True)

        yield began
        progress.advance()


def write_outcome(outcome: Outcome, folder: Path, page: bool = True) -> None:
    """Diagnosis, corrected simulator, evidence and page into a folder that exists.

    Args:
        outcome: of the pipeline.
        folder: to fill.
        page: whether to write the page with its figures.
    """
    from ddagr_gym.diagnosis.pipeline import data_hash, effect_intervals
    from ddagr_gym.diagnosis.result import evidence
    from ddagr_gym.diagnosis.result.verdict import as_mapping, save
    from ddagr_gym.physics.effects.files import save_effects
    from ddagr_gym.reporting import diagnosis_page

    diagnosis = outcome.diagnosis
    for name in ("effects.json", "effects.yaml"):
        save_effects(
            folder / name,
            outcome.effects,
            intervals=effect_intervals(diagnosis) if outcome.effects else (),
            data_hash=data_hash(diagnosis),
            source=diagnosis.sentence,
        )
    _write_simulator(outcome, folder)
    save(diagnosis, folder / "diagnosis.json")
    outcome.evidence.save(folder / evidence.NAME)
    if page:
        diagnosis_page.write_report(folder, as_mapping(diagnosis), outcome.evidence)
        (folder / diagnosis_page.PAGE).rename(folder / PAGE)


def _write_simulator(outcome: Outcome, folder: Path) -> None:
    """Robot and soil as refitted beside the effects, unless the refit went where no soil of these parameters is."""
    from ddagr_gym.config import dump_config
    from ddagr_gym.diagnosis.null_bank.fitted_nominal import with_values

    try:
        robot, soil = with_values(*outcome.nominal, outcome.diagnosis.nuisances)
    except InputError as error:
        print(
            f"ddagr: robot.yaml and soil.yaml are left out, the refitted values are no soil: {error}", file=sys.stderr
        )
        return
    for name, fitted in (("robot.yaml", robot), ("soil.yaml", soil)):
        (folder / name).write_text(f"# refitted: {outcome.diagnosis.sentence}\n{dump_config(fitted)}")


def outcome_text(diagnosis: Diagnosis) -> str:
    """Answer, findings and errors at the horizons, as tables."""
    parts = [diagnosis.sentence]
    if diagnosis.checks:
        lines = [_doubt_line(doubt) for doubt in diagnosis.checks]
        parts.append("\n".join(["The recordings themselves are suspicious (`ddagr check` says more):", *lines]))
    if diagnosis.findings:
        head = ("effect", "size", "90 % interval", "unit", "gain", "gate", "could also be")
        parts.append(format_table(head, [row for finding in diagnosis.findings for row in _finding_rows(finding)]))
    if diagnosis.rejected:
        nearest = ", ".join(f"{item.name} (gain {item.gain:.1f})" for item in diagnosis.rejected)
        parts.append(f"What comes nearest leaves too much to be named: {nearest}.")
    if diagnosis.fit is not None:
        parts += _fit_texts(diagnosis.fit)
    if diagnosis.next_drive is not None:
        manoeuvre = str(diagnosis.next_drive["manoeuvre"]).replace("_", " ")
        parts.append(f"Next drive: {manoeuvre or 'none'}. {diagnosis.next_drive['why']}")
    return "\n\n".join(parts)


def _doubt_line(doubt: DataDoubt) -> str:
    place = " ".join(filter(None, (doubt.recording, doubt.channel)))
    return f"  {place}: {doubt.sentence}" if place else f"  {doubt.sentence}"


def _finding_rows(finding: Any) -> Iterator[tuple[str, ...]]:
    """One row per parameter; what the finding as a whole has stands in the first."""
    others = [f"{name} {weight:.2f}" for name, weight in finding.equivalence_set.items() if name != finding.name]
    none = "nothing else" if finding.gate > 0.0 else "seen in the values"
    whole = (f"{finding.gain:.1f}", f"{finding.gate:.1f}", ", ".join(others) or none)
    for number, (name, estimate) in enumerate(finding.parameters.items()):
        interval = "" if estimate.interval is None else f"{estimate.interval[0]:.3g} to {estimate.interval[1]:.3g}"
        first = number == 0
        label = f"{finding.name if first else ''} {name}".strip()
        yield label, f"{estimate.value:.3g}", interval, estimate.unit, *(whole if first else ("", "", ""))


def _fit_texts(fit: Mapping[str, Any]) -> Iterator[str]:
    models = ("raw", "refitted", "corrected", "black_box", "ceiling")
    rows = [
        (f"{channel} after {horizon} s", *(f"{entry[model]['value']:.3g}" for model in models), entry["unit"])
        for channel in _SHOWN
        for horizon, entry in fit["channels"].get(channel, {}).items()
    ]
    if rows:
        head = ("error on unseen drives", "raw", "refitted", "corrected", "black box", "ceiling", "unit")
        yield format_table(head, rows)
    shares = [
        f"{100.0 * share['value']:.0f} % after {horizon} s"
        for horizon, share in fit["gain_share"].items()
        if share is not None
    ]
    if shares:
        yield f"Share of the explainable error that the named effects explain: {', '.join(shares)}."
    yield f"Predicted {fit['folds']}. {fit['note']}"
