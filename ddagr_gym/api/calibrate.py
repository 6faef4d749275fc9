"""``ddagr_gym.calibrate``: a robot's parameters from its ordinary drives."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from ddagr_gym.api.drive_names import names_apart, without_number
from ddagr_gym.api.inputs import ENDINGS, Source, Sources, recordings_from, sources_in
from ddagr_gym.api.nominal import OWN, RobotLike, SoilLike, robot_from, soil_from, soil_name_of
from ddagr_gym.api.results import Report, Table
from ddagr_gym.errors import InputError, at_least
from ddagr_gym.files import expanded
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits

if TYPE_CHECKING:
    from ddagr_gym.calibration.result import CalibratedParameter, Calibration
    from ddagr_gym.calibration.run import Outcome
    from ddagr_gym.parameters import Robot, Soil
    from ddagr_gym.physics.effects import Effect
    from ddagr_gym.recordings.schema import Recording

DriveLike: TypeAlias = int | Source
"""A drive among those that are calibrated: its number, its path or file name, or the object itself."""

DrivesLike: TypeAlias = int | str | os.PathLike[str] | Sequence[DriveLike]
"""Drives among those, or a single one by its number, path or file name."""


@dataclass(frozen=True, eq=False, repr=False)
class CalibrationResult(Report):
    """A robot as its drives show it.

    ``report(folder)`` writes robot.yaml, a soil file for each ground, effects.yaml, draws.yaml (what
    ``gym.make(calibration=folder)`` draws from), calibration.json, bank.json (what other drives are
    compared with; not with ``bank=False``), and a page, calibration.html.

    Attributes:
        outcome: answer, calibrated robot and soils, and the forecasts behind them (:mod:`ddagr_gym.calibration.run`).
    """

    outcome: Outcome

    @property
    def calibration(self) -> Calibration:
        """The whole answer, as ``calibration.json`` holds it."""
        return self.outcome.calibration

    @property
    def robot(self) -> Robot:
        """Calibrated robot."""
        return self.outcome.robot

    @property
    def soils(self) -> Mapping[str, Soil]:
        """Calibrated soils by ground."""
        return self.outcome.soils

    @property
    def effects(self) -> tuple[Effect, ...]:
        """What belongs to the sensors and to no robot, as ``gym.make(effects=...)`` and simulate take it."""
        from ddagr_gym.calibration.simulator_values import calibrated_effects

        return calibrated_effects(self.calibration)

    @property
    def parameters(self) -> tuple[CalibratedParameter, ...]:
        """Of the robot, then of the grounds."""
        return self.calibration.parameters

    @property
    def headline(self) -> str:
        """What was calibrated, with what, and what it is worth."""
        from ddagr_gym.reporting.calibration_text import headline

        return headline(self.calibration)

    def tables(self) -> Sequence[Table]:
        """Parameters, and errors on left-out drives."""
        from ddagr_gym.reporting.calibration_text import (
            FORECAST_HEADER,
            PARAMETER_HEADER,
            forecast_rows,
            parameter_rows,
        )

        return [
            Table(PARAMETER_HEADER, parameter_rows(self.calibration)),
            Table(FORECAST_HEADER, forecast_rows(self.calibration)),
        ]

    def __str__(self) -> str:
        from ddagr_gym.reporting.calibration_text import summary

        return summary(self.calibration)

    def to_json(self, path: str | os.PathLike[str]) -> None:
        """Write calibration.json, whole or not at all."""
        from ddagr_gym.calibration.files import save

        save(self.calibration, Path(path))

    def _fill(self, folder: Path, progress: Callable[[str], None] | None) -> None:
        from ddagr_gym.calibration.files import NAME, ROBOT, soil_file
        from ddagr_gym.calibration.ordinary_files import NAME as BANK
        from ddagr_gym.calibration.ordinary_files import save_ordinary
        from ddagr_gym.calibration.simulator_values import calibrated_draws
        from ddagr_gym.config import dump_config
        from ddagr_gym.envs.calibrated_draws import EFFECTS
        from ddagr_gym.envs.calibrated_draws import NAME as DRAWS
        from ddagr_gym.physics.effects.files import save_effects
        from ddagr_gym.reporting.calibration_page import write_page

        (folder / ROBOT).write_text(dump_config(self.robot), encoding="utf-8")
        for ground, soil in self.soils.items():
            (folder / soil_file(ground)).write_text(dump_config(soil), encoding="utf-8")
        draws = calibrated_draws(self.calibration, self.robot, self.soils)
        (folder / DRAWS).write_text(dump_config(draws), encoding="utf-8")
        save_effects(folder / EFFECTS, self.effects, source=self.headline)
        if self.outcome.ordinary is not None:
            save_ordinary(self.outcome.ordinary, folder / BANK)
        self.to_json(folder / NAME)
        write_page(folder, self.calibration, self.outcome.forecasts)


def calibrate(
    recordings: Sources,
    robot: RobotLike,
    soil: SoilLike | Mapping[str, SoilLike] = "firm_ground",
    grounds: Mapping[str, DrivesLike] | None = None,
    *,
    seed: int = 0,
    threads: int = 1,
    bank: bool = True,
    supply_currents: bool = False,
    processes: int = 1,
    cluster: str = "",
    column_map: str | os.PathLike[str] | None = None,
    limits: Limits = DEFAULT_LIMITS,
    progress: Callable[[str], None] | None = None,
    cache: str | os.PathLike[str] | None = None,
) -> CalibrationResult:
    """Fit a robot to its ordinary drives, all together.

    The robot's parameters are shared by all drives, the soil by those on one ground, a gyro's bias belongs to a drive.
    Which parts of the robot are fitted is decided by forecasts of drives that are left out. What the drives do not
    identify keeps the data sheet's value.

    Args:
        recordings: ordinary drives of one robot: recordings, tables, paths of files or folders.
        robot: its data sheet: name, YAML file or object.
        soil: nominal one: name, YAML file or object, or one of these for each ground by its name.
        grounds: drives on each ground by its name, as numbers, paths or objects; all on one where it is None. Of files
            of one name, the end of the path that tells them apart.
        seed: of the resampled intervals.
        threads: of the simulator, in each process.
        supply_currents: also fit currents that motors draw from their supply; their own current is always fitted.
        bank: also scan each drive for every effect of the library, with the robot calibrated without it: what ordinary
            drives show of each. Of two drives or more; without it no other drive can be compared with these.
        processes: for what does not depend on each other: the fits from several starts and, for the bank, the drives.
        cluster: a Ray cluster to run them on: "local" starts one of so many processors here, an address takes one that
            runs. The result is the same.
        column_map: shipped map by name or the path of one's own, for files that are not imported yet.
        limits: on rows and bytes of files.
        progress: called with a line of text at each step; ``print`` will do.
        cache: folder in which finished steps are kept. After an interruption (KeyboardInterrupt) the same call goes on
            from it; it stays when all is done, and is emptied when it is of another calibration.

    Returns:
        Parameters with intervals, robot and soils for the simulator, errors on left-out drives.

    Raises:
        InputError: drives of another robot or of two, too short, without commands, encoders or gyro; grounds that do
            not fit the drives; unknown names; a cluster that does not answer.

    Examples:
        >>> import ddagr_gym
        >>> import numpy as np
        >>> from ddagr_gym.presets import get_robot
        >>> robot = get_robot("ddagr").with_values(motor_rate=3.0)  # slower than the data sheet's 4.5 1/s
        >>> rng = np.random.default_rng(0)
        >>> steps = [np.repeat(rng.uniform(-1.5, 1.5, (24, 2)), 60, axis=0) for _ in range(2)]  # 3 s each, at 20 Hz
        >>> drives = [ddagr_gym.simulate(commands, robot, rate=20.0, pose_rate=5.0) for commands in steps]
        >>> result = ddagr_gym.calibrate(drives, "ddagr", "thesis_a1", bank=False)
        >>> abs(result.robot.motor_rate - 3.0) < 0.05
        True
    """
    import numpy as np

    from ddagr_gym.calibration.files import check_ground_name
    from ddagr_gym.calibration.input_requirements import check_drives, check_map, grounds_of
    from ddagr_gym.calibration.run import calibrate_drives
    from ddagr_gym.calibration.settings import CalibrationSettings
    from ddagr_gym.tasks import TaskRunner

    at_least(threads=(threads, 1), seed=(seed, 0), processes=(processes, 1))
    data_sheet = robot_from(robot)
    sources = sources_in(recordings)
    read = recordings_from(sources, robot, column_map, limits) if sources else ()
    names = names_apart([recording.meta.source for recording in read], sources)
    found = tuple(recording.with_meta(source=name) for recording, name in zip(read, names, strict=True))
    check_drives(found, data_sheet)
    check_map(found, np.random.default_rng(seed))
    by_drive = grounds_of(names, _numbers(grounds or {}, sources, found))
    for ground in dict.fromkeys(by_drive):
        check_ground_name(ground)
    soils = _soils(soil, by_drive)
    with TaskRunner(processes, cluster=cluster) as runner:
        outcome = calibrate_drives(
            found,
            by_drive,
            data_sheet,
            {ground: soil_from(item) for ground, item in soils.items()},
            CalibrationSettings(threads=threads, seed=seed, supply_currents=supply_currents),
            data_sheet=OWN if not isinstance(robot, str | os.PathLike) else str(robot),
            soil_names={ground: soil_name_of(item) for ground, item in soils.items()},
            with_bank=bank,
            runner=runner,
            cache=None if cache is None else Path(cache),
            progress=(lambda line: None) if progress is None else progress,
        )
    return CalibrationResult(outcome)


def _numbers(
    grounds: Mapping[str, DrivesLike], sources: Sequence[Source], found: Sequence[Recording]
) -> dict[str, list[int]]:
    """Numbers of the drives on each ground."""
    numbers: dict[str, list[int]] = {}
    for ground, drives in grounds.items():
        several = drives if isinstance(drives, Sequence) and not isinstance(drives, str) else [drives]
        numbers[ground] = [_number(drive, sources, found) for drive in several]
    return numbers


def _number(drive: DriveLike, sources: Sequence[Source], found: Sequence[Recording]) -> int:
    """Number of a drive among the recordings, each of which has one source."""
    if isinstance(drive, int) and not isinstance(drive, bool):
        if not 0 <= drive < len(found):
            raise InputError(f"drive number {drive} has a ground: give numbers from 0 to {len(found) - 1}.")
        return drive
    if isinstance(drive, str | os.PathLike):
        matching = _of_path(drive, sources) or _of_name(drive, found)
    else:
        matching = [n for n, item in enumerate(sources) if item is drive]
    if not matching:
        said = drive if isinstance(drive, str | os.PathLike) else f"a {type(drive).__name__}"
        names = ", ".join(recording.meta.source for recording in found)
        raise InputError(f"{said} has a ground and is not among the drives {names}: give the name or path of one.")
    if len(matching) > 1:
        raise InputError(
            f"{drive} is the name of {len(matching)} drives: give the whole path of one (or, in Python, its number)."
        )
    return matching[0]


def _of_path(drive: str | os.PathLike[str], sources: Sequence[Source]) -> list[int]:
    """Numbers of the files that a path names: that one itself, else those whose paths end so."""
    path = expanded(drive)
    places = {n: Path(os.path.abspath(item)) for n, item in enumerate(sources) if isinstance(item, Path)}
    same = [n for n, place in places.items() if place == Path(os.path.abspath(path))]
    return same or [n for n, place in places.items() if place.parts[-len(path.parts) :] == path.parts]


def _of_name(drive: str | os.PathLike[str], found: Sequence[Recording]) -> list[int]:
    """Numbers of the recordings that bear a name."""
    name, names = Path(drive).name, [recording.meta.source for recording in found]
    numbered = [n for n, known in enumerate(names) if known == str(drive) and without_number(known) != known]
    same = numbered or [n for n, known in enumerate(names) if without_number(known) in (str(drive), name)]
    # one may name a drive by the log that it was imported from, whose ending alone differs
    return same or [n for n, known in enumerate(names) if _stem(known) == _stem(name)]


def _stem(name: str) -> str:
    """Name of a recording's file without its ending."""
    return next((name.removesuffix(end) for end in sorted(ENDINGS, key=len, reverse=True) if name.endswith(end)), name)


def _soils(soil: SoilLike | Mapping[str, SoilLike], by_drive: Sequence[str]) -> dict[str, SoilLike]:
    """Nominal soil of each ground."""
    grounds = list(dict.fromkeys(by_drive))
    if not isinstance(soil, Mapping):
        return dict.fromkeys(grounds, soil)
    unknown = [name for name in soil if name not in grounds]
    absent = [name for name in grounds if name not in soil]
    if unknown or absent:
        wrong = f"no drive is on the ground {unknown[0]!r}" if unknown else f"the ground {absent[0]!r} has none"
        raise InputError(f"soils are given by ground and {wrong}: give one for each of {', '.join(grounds)}.")
    return dict(soil)
