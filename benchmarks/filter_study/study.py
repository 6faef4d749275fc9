"""The filter on soils that it does not know: errors of all estimators, consistency, force laws, real drives.

Every part is a line of a journal, so that an interrupted study goes on where it stopped.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.filter_study.consistency import PRIORS, matched_drive, matched_model, row_turn_commands
from benchmarks.filter_study.estimators import ESTIMATORS, innovations, judge
from benchmarks.filter_study.force_law_costs import LAWS, draw_soils, soil_set_costs
from benchmarks.filter_study.real_drives import real_drive
from benchmarks.filter_study.settings import FilterStudySettings
from ddagr_gym.envs.options import make_settings
from ddagr_gym.evaluation.controllers import nominal_constants
from ddagr_gym.evaluation.force_law_fits import drive_law_fit
from ddagr_gym.evaluation.runs import drive_turn
from ddagr_gym.parameters import Sensors
from ddagr_gym.presets import ddagr

Array = NDArray[np.float64]

DRIVE, MATCHED, FORCE_LAWS, REAL = KINDS = ("drive", "matched", "force_laws", "real_drives")
_MATCHED_SET = 1000
"""Set number in the seeds of matched drives, beyond those of soil sets."""


@dataclass(frozen=True)
class Part:
    """One independent piece of a study.

    Attributes:
        kind: of KINDS.
        name: soil set, prior or recording.
        number: of the drive.
    """

    kind: str
    name: str
    number: int = 0


def study_parts(settings: FilterStudySettings, recordings: Path | None) -> list[Part]:
    """Everything that a study does; real drives only of the recordings that are in the folder."""
    parts = [Part(FORCE_LAWS, name) for name in ("thesis_a1", *settings.soil_sets)]
    parts += [Part(MATCHED, prior, n) for prior in PRIORS for n in range(settings.matched_drives)]
    parts += [Part(DRIVE, name, n) for name in settings.soil_sets for n in range(settings.drives)]
    return parts + [Part(REAL, name) for name in settings.recordings if _recording(recordings, name) is not None]


def _recording(folder: Path | None, name: str) -> Path | None:
    path = None if folder is None else folder / "open" / f"{name}.csv.gz"
    return path if path is not None and path.is_file() else None


def run_study(
    settings: FilterStudySettings,
    journal: Path,
    *,
    recordings: Path | None = None,
    progress: Callable[[int], None] = lambda parts: None,
) -> dict[Part, Any]:
    """Do what the journal does not hold yet.

    Args:
        settings: plan.
        journal: JSON lines, appended; of this plan.
        recordings: folder with ``open/``; None leaves real drives out.
        progress: called with the number of parts done.

    Returns:
        Results of all parts.
    """
    wanted = study_parts(settings, recordings)
    known = dict(_read(journal))
    done = {part: known[part] for part in wanted if part in known}
    if done:
        progress(len(done))
    for part in wanted:
        if part in done:
            continue
        done[part] = _RUNNERS[part.kind](settings, part, recordings)
        with journal.open("a", encoding="utf-8") as file:
            file.write(json.dumps([part.kind, part.name, part.number, done[part]]) + "\n")
        progress(1)
    return {part: done[part] for part in wanted}


def _read(journal: Path) -> Iterator[tuple[Part, Any]]:
    """Parts of a journal; a last line that was cut off by an interruption is dropped."""
    if not journal.is_file():
        return
    for line in journal.read_text(encoding="utf-8").splitlines():
        try:
            kind, name, number, result = json.loads(line)
        except json.JSONDecodeError:
            return
        yield Part(kind, name, number), result


def _run_drive(settings: FilterStudySettings, part: Part, recordings: Path | None) -> dict[str, Any]:
    """One row turn by constant bank speeds on a drawn soil, with everything else randomised as in training.

    The estimators know the nominal robot and the sensors' data sheets, not what was drawn.
    """
    turn_settings = make_settings(soil=part.name, radius=settings.radius)
    rng = np.random.default_rng([settings.seed, settings.soil_sets.index(part.name), part.number])
    episode = turn_settings.draw(rng)
    drive = drive_turn(nominal_constants(episode.turn), turn_settings, int(rng.integers(2**31)), episode)
    robot, judged = ddagr(), {}
    for name, estimator in ESTIMATORS.items():
        motion = estimator.estimate(robot, turn_settings.sensors, drive.columns)
        judged[name] = judge(motion, robot, drive.columns, episode.turn.side) | {"innovations": innovations(motion)}
    return {"arms": judged, "laws": _law_errors(drive.columns)}


def _law_errors(columns: Mapping[str, Array]) -> dict[str, list[float]]:
    """Largest error of each law's best fit to a drive over the drive's largest force, along x and y."""
    fits = {name: drive_law_fit(ddagr(), columns, law, rolls) for name, (law, rolls) in LAWS.items()}
    return {name: (np.abs(fit.errors).max(axis=0) / fit.peak).tolist() for name, fit in fits.items()}


def _run_matched(settings: FilterStudySettings, part: Part, recordings: Path | None) -> dict[str, Any]:
    sensors = Sensors()
    model = matched_model(ddagr(), sensors, part.name)
    rng = np.random.default_rng([settings.seed, _MATCHED_SET + PRIORS.index(part.name), part.number])
    side = ("left", "right")[part.number % 2]
    commands = row_turn_commands(side, float(rng.uniform(*settings.radius)), sensors.period)
    return matched_drive(model, commands, sensors.encoder, rng)


def _run_force_laws(settings: FilterStudySettings, part: Part, recordings: Path | None) -> dict[str, Any]:
    robot = ddagr()
    soils = draw_soils(part.name, robot, settings.force_law_soils, settings.seed)
    return soil_set_costs(robot, soils, settings.seed)


def _run_real(settings: FilterStudySettings, part: Part, recordings: Path | None) -> dict[str, Any]:
    path = _recording(recordings, part.name)
    assert path is not None
    return real_drive(path, settings.recordings[part.name], settings.seed)


_RUNNERS: dict[str, Callable[[FilterStudySettings, Part, Path | None], dict[str, Any]]] = {
    DRIVE: _run_drive,
    MATCHED: _run_matched,
    FORCE_LAWS: _run_force_laws,
    REAL: _run_real,
}
