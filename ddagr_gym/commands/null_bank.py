"""``ddagr null-bank``: thresholds of the diagnosis from drives in which nothing is missing."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro
from tyro.conf import Positional

from ddagr_gym.errors import InputError, at_least
from ddagr_gym.files import check_output_file, make_folder
from ddagr_gym.tasks import ResultStore, Task, TaskRunner, run_tasks

if TYPE_CHECKING:
    from ddagr_gym.api.nominal import Nominal
    from ddagr_gym.diagnosis.gates.thresholds import NullKind, NullRun, Origin, Thresholds
    from ddagr_gym.diagnosis.null_bank.bank import NullBank
    from ddagr_gym.diagnosis.null_bank.drives import Template
    from ddagr_gym.diagnosis.setting import Setting
    from ddagr_gym.parameters import Robot, Soil
    from ddagr_gym.recordings.schema import Recording

    _Centre = tuple[Robot, Soil] | None

EXAMPLES = (
    "ddagr null-bank --robot ddagr --soil thesis_a1 --output thresholds.json",
    "ddagr null-bank run_1.csv.gz run_2.csv.gz run_3.csv.gz --robot ddagr --soil thesis_a1 --output thresholds.json",
)


@dataclass(frozen=True)
class Arguments:
    """Make a bank of null drives and the thresholds of a diagnosis from it.

    Each null run follows the commands of the given recordings, of three pieces of them where they are long, in a
    simulator of another structure (soil law, speed loop, relief, soil that varies from place to place) with the
    recordings' noise, and goes through the same refit and scan as real drives. Soils are drawn about the nominal one,
    or about robot and soil as fitted to the recordings (a bootstrap of the fitted nominal simulator), where that fit is
    a robot that the data sheet allows. An interrupted bank goes on where it stopped.

    Attributes:
        runs: recordings of one robot, as `ddagr diagnose` takes them; without any, three drives of 60 s are drawn.
        ordinary: take the runs themselves for null drives: real ones in which nothing is wrong. They are cut into
            pieces, of which at least 20 are needed (the level is 5 percent), and no drive is simulated. Pieces of twice
            the length and whole drives say beside them how gains grow with the length.
        piece: length of a piece [s], at least 16 (8 windows of 2 s; three pieces of a simulated run have 8 windows).
        output: thresholds to write, .json; the runs themselves lie beside it.
        robot: nominal robot: name (ddagr robots) or YAML file.
        soil: nominal soil: name (ddagr soils) or YAML file; as for `ddagr diagnose` when it is left out.
        map: column map, for sources that are not imported yet.
        count: null drives to simulate; at least 20 for the level of 5 percent.
        seed: random seed of the bank.
        soil_uncertainty: as for `ddagr diagnose`.
        window: length of the windows [s]; diagnoses with these thresholds cut recordings in the same way.
        stride: seconds between the starts of windows; their length, which uses all samples, when it is left out.
        processes: how many processes work at the same time, or processors of a local cluster.
        cluster: a Ray cluster to work on: "local" starts one here, an address (ray://HOST:PORT) takes one that runs.
    """

    output: Annotated[Path, tyro.conf.arg(aliases=("-o",))]
    runs: Positional[tuple[Path, ...]] = ()
    robot: str = "ddagr"
    soil: str = ""
    map: str = ""
    ordinary: bool = False
    piece: float = 60.0
    count: int = 60
    seed: int = 0
    soil_uncertainty: float | None = None
    window: float = 6.0
    stride: float | None = None
    processes: int = 2
    cluster: str = ""


def run(arguments: Arguments) -> None:
    """Make what is missing of the bank, then write the thresholds."""
    from ddagr_gym.api.inputs import recordings_from
    from ddagr_gym.api.nominal import nominal_or_usual
    from ddagr_gym.diagnosis.gates.threshold_files import save_thresholds
    from ddagr_gym.diagnosis.gates.thresholds import thresholds_from
    from ddagr_gym.diagnosis.null_bank.bank import NullBank
    from ddagr_gym.diagnosis.null_bank.drives import drawn_templates
    from ddagr_gym.diagnosis.preprocessing.input_requirements import check_recordings
    from ddagr_gym.diagnosis.setting import Setting
    from ddagr_gym.identification.nuisances import NuisancePriors

    _check_options(arguments)
    check_output_file(arguments.output)
    given = recordings_from(arguments.runs, arguments.robot, arguments.map or None) if arguments.runs else ()
    nominal, uncertainty = nominal_or_usual(given, arguments.robot, arguments.soil or None, arguments.soil_uncertainty)
    robot, soil = nominal.robot, nominal.soil
    recordings = _mended(given)
    priors = NuisancePriors().with_soil(uncertainty)
    setting = Setting(priors=priors).with_windows(arguments.window, arguments.stride)
    drives: list[Template | Recording | None] = [None] * arguments.count
    centre: _Centre = None
    longer: list[Recording] = []
    if arguments.ordinary:
        pieces, longer = _pieces(recordings, arguments.piece, robot, setting)
        drives = [*pieces, *longer]
    elif recordings:
        check_recordings(recordings, robot, setting)
        drives = [*drawn_templates(recordings, robot.outer_radius, arguments.piece, arguments.count, arguments.seed)]
        centre = _centre(robot, soil, recordings, setting)
    made_of = NullBank(robot, soil, setting, tuple(drives), arguments.seed, centre)
    bank, folder = made_of.key(), make_folder(arguments.output.with_suffix(".bank"))
    made = _make(made_of, [f"{bank[:16]}_{n:03d}" for n in range(len(drives))], folder, arguments)
    runs = [replace(run, own=number < len(drives) - len(longer)) for number, run in enumerate(made)]
    found = thresholds_from(runs, bank, origin=_origin(arguments, nominal, uncertainty))
    save_thresholds(found, arguments.output)
    beside = f" and {len(longer)} longer ones" if longer else ""
    print(f"{arguments.output}: thresholds of {found.nulls} null drives{beside}, bank {bank[:12]}")
    _print_use([run for run in runs if run.own], found, robot)


def _print_use(runs: Sequence[NullRun], found: Thresholds, robot: Robot) -> None:
    """Say how many null runs pass these thresholds, and those that ship for the robot and for the general case."""
    from ddagr_gym.diagnosis.gates.threshold_files import GENERAL, shipped_thresholds
    from ddagr_gym.diagnosis.gates.thresholds import false_alarms

    shipped = {owner: shipped_thresholds(owner) for owner in dict.fromkeys((robot.name, GENERAL))}
    others = [f"those shipped for the {name} in {false_alarms(runs, own)}" for name, own in shipped.items() if own]
    passed = ", ".join([f"in {false_alarms(runs, found)} of {len(runs)} null drives", *others])
    print(f"an effect passes these thresholds {passed}")


def _mended(loaded: Sequence[Recording]) -> Sequence[Recording]:
    """Recordings as a diagnosis sees them; what had to be mended is reported."""
    from ddagr_gym.diagnosis.preprocessing.mended_recordings import mend_recordings
    from ddagr_gym.diagnosis.wording import in_sentence

    if not loaded:
        return loaded
    found = mend_recordings(loaded)
    faults = [f"repeated readings ({item.sensor})" for item in found.repeated]
    faults += [in_sentence(fault.name) for fault in found.channel_faults]
    faults += ["a reversed gyro"] if found.reversed_gyro is not None else []
    if faults:
        print(f"ddagr: warning: the recordings have {' and '.join(faults)}, which is mended first.", file=sys.stderr)
    return found.recordings


def _centre(robot: Robot, soil: Soil, recordings: Sequence[Recording], setting: Setting) -> _Centre:
    """Robot and soil as fitted to recordings; None, which a warning says, where something is missing in the fit."""
    from ddagr_gym.diagnosis.null_bank.fitted_nominal import fitted_nominal

    fitted = fitted_nominal(robot, soil, recordings, setting)
    if fitted.credible:
        return fitted.robot, fitted.soil
    print(
        f"ddagr: warning: the simulator fits these recordings only with {fitted.farthest} {fitted.deviations:.0f} "
        "standard deviations off, so that it lacks something: null drives are drawn about the nominal robot and soil.",
        file=sys.stderr,
    )
    return None


def _check_options(arguments: Arguments) -> None:
    from ddagr_gym.diagnosis.gates.thresholds import LEVEL, least_nulls
    from ddagr_gym.diagnosis.null_bank.drives import DRIVES
    from ddagr_gym.diagnosis.setting import LEAST_WINDOWS, SHORT, SHORTEST

    copied = arguments.runs and not arguments.ordinary
    shared = LEAST_WINDOWS * arguments.window / DRIVES if copied else 0.0
    for name, least in (("window", SHORTEST), ("stride", 0.1), ("piece", max(LEAST_WINDOWS * SHORT, shared))):
        given = getattr(arguments, name)
        if given is not None and not least <= given < math.inf:
            raise InputError(f"--{name} is {given:g}: give a finite time of at least {least:g} s.")
    at_least(**{"--seed": (arguments.seed, 0), "--processes": (arguments.processes, 1)})
    if arguments.ordinary and not arguments.runs:
        raise InputError("--ordinary takes recordings for null drives and none is given: name some, or leave it out.")
    if not arguments.ordinary and arguments.count < least_nulls():
        raise InputError(f"--count is {arguments.count}: give at least {least_nulls()} for the level of {LEVEL:g}.")


def _pieces(
    recordings: Sequence[Recording], length: float, robot: Robot, setting: Setting
) -> tuple[list[Recording], list[Recording]]:
    """Ordinary drives in pieces, enough of them for thresholds, and longer ones."""
    from ddagr_gym.diagnosis.gates.thresholds import LEVEL, least_nulls
    from ddagr_gym.diagnosis.null_bank.ordinary_drives import longer_runs, pieces_of
    from ddagr_gym.diagnosis.preprocessing.input_requirements import check_recordings

    for recording in recordings:
        check_recordings([recording], robot, setting)
    pieces = [piece for recording in recordings for piece in pieces_of(recording, length)]
    if len(pieces) < least_nulls():
        raise InputError(
            f"the recordings give {len(pieces)} pieces with commands of {length:g} s and the level of {LEVEL:g} takes "
            f"at least {least_nulls()}: name more recordings or give a shorter --piece."
        )
    return pieces, [run for recording in recordings for run in longer_runs(recording, length)]


def _origin(arguments: Arguments, nominal: Nominal, soil_uncertainty: float) -> Origin:
    from ddagr_gym.diagnosis.gates.thresholds import Origin

    kind: NullKind = "ordinary" if arguments.ordinary else "simulated"
    return Origin(nominal.robot.name, nominal.soil_name, soil_uncertainty, arguments.seed, kind)


def _make(bank: NullBank, keys: Sequence[str], folder: Path, arguments: Arguments) -> list[NullRun]:
    """Null runs of a bank, those that are missing made by worker processes or a cluster.

    Args:
        bank: whose recordings are sent once to a worker or node.
        keys: of the runs in the store.
        folder: of the store.
        arguments: of the command.
    """
    from ddagr_gym.diagnosis.gates.thresholds import NullRun

    store = ResultStore(folder)
    with TaskRunner(min(arguments.processes, len(keys)), cluster=arguments.cluster) as runner:
        shared = runner.share(bank)
        tasks = [Task(f"null drive {n}", _one, (shared, n), key) for n, key in enumerate(keys)]
        return [NullRun(**item) for item in run_tasks(tasks, "null drives", runner, store)]


def _one(bank: NullBank, number: int) -> dict[str, Any]:
    return asdict(bank.run(number))
