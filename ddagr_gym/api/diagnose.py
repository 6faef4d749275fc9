"""``ddagr_gym.diagnose``: which physics the nominal simulator leaves out, from recordings."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, overload

from ddagr_gym.api.change import ChangeResult, changed, changed_since
from ddagr_gym.api.diagnosis_result import DiagnosisResult
from ddagr_gym.api.drivetrain_fit import DrivetrainFit
from ddagr_gym.api.inputs import Sources, recordings_from
from ddagr_gym.api.nominal import (
    Nominal,
    RobotLike,
    SoilLike,
    ThresholdsLike,
    check_left_out,
    nominal_or_usual,
    thresholds_from,
)
from ddagr_gym.errors import InputError, InputWarning, at_least
from ddagr_gym.extras import need
from ddagr_gym.progress import counting

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.gates.thresholds import Thresholds

__all__ = ["ChangeResult", "DiagnosisResult", "diagnose"]

_SAME_WINDOW = 0.5
"""Difference of lengths of windows up to which gates are taken to hold [s] (ours; short segments shorten windows)."""


@overload
def diagnose(
    recordings: Sources,
    robot: RobotLike | None = None,
    soil: SoilLike | None = None,
    *,
    calibration: None = None,
    ground: str = "",
    before: None = None,
    same_ground: bool | None = None,
    thresholds: ThresholdsLike | None = None,
    soil_uncertainty: float | None = None,
    window: float | None = None,
    stride: float | None = None,
    seed: int = 0,
    threads: int = 1,
    names_only: bool = False,
    column_map: str | os.PathLike[str] | None = None,
    progress: Callable[[str], None] | None = None,
    cache: str | os.PathLike[str] | None = None,
) -> DiagnosisResult: ...


@overload
def diagnose(
    recordings: Sources,
    robot: RobotLike | None = None,
    soil: SoilLike | None = None,
    *,
    calibration: str | os.PathLike[str],
    ground: str = "",
    before: None = None,
    same_ground: bool | None = None,
    thresholds: ThresholdsLike | None = None,
    soil_uncertainty: float | None = None,
    window: float | None = None,
    stride: float | None = None,
    seed: int = 0,
    threads: int = 1,
    names_only: bool = False,
    column_map: str | os.PathLike[str] | None = None,
    progress: Callable[[str], None] | None = None,
    cache: str | os.PathLike[str] | None = None,
) -> ChangeResult: ...


@overload
def diagnose(
    recordings: Sources,
    robot: RobotLike | None = None,
    soil: SoilLike | None = None,
    *,
    calibration: None = None,
    ground: str = "",
    before: Sources,
    same_ground: bool | None = None,
    thresholds: ThresholdsLike | None = None,
    soil_uncertainty: float | None = None,
    window: float | None = None,
    stride: float | None = None,
    seed: int = 0,
    threads: int = 1,
    names_only: bool = False,
    column_map: str | os.PathLike[str] | None = None,
    progress: Callable[[str], None] | None = None,
    cache: str | os.PathLike[str] | None = None,
) -> ChangeResult: ...


def diagnose(
    recordings: Sources,
    robot: RobotLike | None = None,
    soil: SoilLike | None = None,
    *,
    calibration: str | os.PathLike[str] | None = None,
    ground: str = "",
    before: Sources | None = None,
    same_ground: bool | None = None,
    thresholds: ThresholdsLike | None = None,
    soil_uncertainty: float | None = None,
    window: float | None = None,
    stride: float | None = None,
    seed: int = 0,
    threads: int = 1,
    names_only: bool = False,
    column_map: str | os.PathLike[str] | None = None,
    progress: Callable[[str], None] | None = None,
    cache: str | os.PathLike[str] | None = None,
) -> DiagnosisResult | ChangeResult:
    """Find the physics that a nominal simulator leaves out: where, what, how big, how sure.

    Several recordings of one robot on one ground are diagnosed together; each is then predicted by a model whose sizes
    were fitted to the others. With a single one its halves judge each other, which is weaker: place, day and biases are
    the same.

    With a calibration the question is what changed against the ordinary drives of that robot, which tells far smaller
    effects: a wrong simulator is wrong in the same way in all of them. With drives from before the same is asked
    without a calibration: one robot and one soil are fitted to these.

    Args:
        recordings: one or several recordings, tables with the schema's columns, paths of files or folders.
        robot: nominal: name, YAML file or object. Where it is None, the one that the recordings name, else the ddagr
            with a warning; files that cannot be read without it are refused.
        soil: nominal: name, YAML file or object. Where it is None, that of thresholds that are given or ship for the
            robot (thesis_a1 for the ddagr), else firm_ground at four times the usual uncertainty, which stands for
            ground that is not known. But for the ddagr, and with drives from before, a warning says so.
        calibration: folder that ``ddagr calibrate`` wrote: the robot, its grounds and its ordinary drives stand
            for robot, soil, thresholds and windows, which are left out then.
        ground: of the calibration that the recordings are on; "" for one of which only the kind is known, where far
            larger changes are hidden.
        before: drives of the same robot when it was ordinary, on one ground; robot and soil are where the fit to them
            begins. Thresholds, soil uncertainty and stride are left out then.
        same_ground: whether the recordings are on the ground of the drives before; else, and where nobody knows (None),
            its soil is free and no change of soil has a name.
        thresholds: of ``ddagr null-bank``, made with these or similar drives; those that ship with the package when it
            is None.
        soil_uncertainty: factor on how far the soil may be from the nominal one; larger where it is only guessed. The
            thresholds must be of the same. 1 beside a soil that is given.
        window: length of the windows [s]; that of the thresholds when it is None, against drives before 4 s.
        stride: seconds between the starts of windows; their length, which uses all samples, when it is None.
        seed: of the resampling.
        threads: of the simulator.
        names_only: only name what is missing: no errors on unseen drives, no unnamed terms, no next drive, no page.
        column_map: shipped map by name or the path of one's own, for files that are not imported yet.
        progress: called with a line of text when a step begins and on what it does; ``print`` will do.
        cache: folder in which finished steps are kept, of a diagnosis without calibration and drives from before only.
            After an interruption (KeyboardInterrupt) the same call goes on from it; it stays when all is done, and is
            emptied when it is of another diagnosis.

    Returns:
        Verdict, findings with sizes and intervals, effects and refitted robot and soil for the simulator; with a
        calibration or drives from before what changed, and the least change of every effect that would have been found.

    Raises:
        InputError: recordings that cannot be diagnosed, unknown names, no thresholds for the robot, options at odds.
        InputWarning: (a warning) the thresholds were made for another robot, soil, uncertainty or window; no robot or
            soil is given; a channel has too few samples to measure its noise and is left out.

    Examples:
        >>> import ddagr_gym
        >>> drives = [ddagr_gym.simulate(name, effects="slope=0.06", rate=25.0, pose_rate=5.0, seed=seed)
        ...           for seed, name in enumerate(["arcs", "s_weave"])]
        >>> result = ddagr_gym.diagnose(drives, names_only=True)
        >>> result.verdict
        ('slope',)
        >>> abs(float(result.findings[0].parameters["angle"]) - 0.06) < 0.005  # rad
        True
    """
    from ddagr_gym.diagnosis.pipeline import diagnose as diagnosed
    from ddagr_gym.diagnosis.pipeline import steps_of
    from ddagr_gym.diagnosis.setting import Setting
    from ddagr_gym.identification.nuisances import NuisancePriors

    at_least(threads=(threads, 1), window=(window, 1.0), stride=(stride, 0.1), seed=(seed, 0))
    if calibration is not None or before is not None:
        _check_no_cache(cache)
    if before is not None:
        _check_only_before(calibration, ground, thresholds=thresholds, stride=stride, soil_uncertainty=soil_uncertainty)
        given, earlier = (recordings_from(drives, robot, column_map) for drives in (recordings, _some(before)))
        nominal, _ = nominal_or_usual((*given, *earlier), robot, soil, say_soil=False)
        given, earlier = (recordings_from(drives, nominal.robot) for drives in (given, earlier))
        say = (lambda line: None) if progress is None else progress
        return changed_since(
            given, earlier, nominal.robot, nominal.soil, same_ground=bool(same_ground), window=window, seed=seed,
            threads=threads, with_page=not names_only, progress=say,
        )  # fmt: skip
    if same_ground is not None:
        raise InputError("whether the ground is the same is said, and no drive from before: name one with --before.")
    if calibration is not None:
        folder = Path(calibration)
        check_left_out(folder, robot, soil, thresholds=thresholds, window=window, stride=stride)
        _check_known_soil(folder, soil_uncertainty)
        given = recordings_from(recordings, _robot_of(folder), column_map)
        say = (lambda line: None) if progress is None else progress
        return changed(given, folder, ground, seed=seed, threads=threads, with_page=not names_only, progress=say)
    if ground:
        raise InputError(f"the ground is {ground!r} and there is no calibration: name its folder with --calibration.")
    need("ruptures", *(() if names_only else ("sklearn",)))
    found = recordings_from(recordings, robot, column_map)
    nominal, uncertainty = nominal_or_usual(found, robot, soil, soil_uncertainty, thresholds)
    found = recordings_from(found, nominal.robot)
    priors = NuisancePriors().with_soil(uncertainty)
    gates = _gates(thresholds, nominal, uncertainty)
    setting = Setting(priors=priors, threads=threads).with_windows(_window(window, gates), stride)
    drivetrain = DrivetrainFit(nominal, threads, seed, cache, progress)
    with _steps(len(steps_of(names_only)), progress) as on_step:
        outcome = diagnosed(
            found,
            nominal.robot,
            nominal.soil,
            gates,
            setting,
            seed=seed,
            names_only=names_only,
            soil_name=nominal.soil_name,
            robot_file=nominal.robot_file,
            complete_nominal=None if gates.of_ordinary_drives else drivetrain.complete,
            cache=None if cache is None else Path(cache),
            on_step=on_step,
            progress=lambda line: None if progress is None else progress(f"  {line}"),
        )
    return DiagnosisResult(outcome, drivetrain.made if outcome.diagnosis.drivetrain is not None else None)


def _check_no_cache(cache: object) -> None:
    """Refuse a cache beside ordinary drives; InputError."""
    if cache is not None:
        raise InputError(
            f"the cache {cache} is given with a calibration or drives from before: leave it out, nothing is kept then."
        )


def _check_only_before(calibration: object, ground: str, **options: object) -> None:
    """Refuse what drives from before already say; InputError."""
    if calibration is not None:
        raise InputError(
            "a calibration and drives from before are given: leave out one of them, either says what is ordinary."
        )
    if ground:
        raise InputError(f"the ground is {ground!r} and there is no calibration: say --same-ground or --other-ground.")
    given = [name for name, value in options.items() if value is not None]
    if given:
        raise InputError(f"{given[0]} is given with drives from before: leave it out, these say what is ordinary.")


def _some(before: Sources) -> Sources:
    """Drives from before; InputError where there is none."""
    if isinstance(before, Sequence) and not isinstance(before, str) and not before:
        raise InputError("no drive from before is given: name one or more ordinary ones behind --before.")
    return before


def _check_known_soil(folder: Path, soil_uncertainty: float | None) -> None:
    if soil_uncertainty is not None:
        raise InputError(
            f"the soil uncertainty is {soil_uncertainty:g} and there is a calibration: leave it out, {folder} says how "
            "much soils differ; for another ground leave out the ground."
        )


def _robot_of(folder: Path) -> str:
    """File of a calibration's robot; InputError where the folder is none."""
    from ddagr_gym.calibration.files import load, robot_file

    load(folder)
    return robot_file(folder)


def _gates(given: ThresholdsLike | None, nominal: Nominal, soil_uncertainty: float) -> Thresholds:
    """Thresholds as given, else the usual ones; those of something else are warned of."""
    from ddagr_gym.diagnosis.gates.threshold_files import usual_thresholds

    usual = usual_thresholds(nominal.robot.name)
    wanted = usual if given is None else given
    return thresholds_from(wanted, nominal.robot, nominal.soil_name, soil_uncertainty) or usual


def _window(window: float | None, gates: Thresholds) -> float:
    """Length of the windows [s]; one that the thresholds were not made with is warned of."""
    if window is None:
        return gates.duration
    if abs(window - gates.duration) > _SAME_WINDOW:
        warnings.warn(
            f"the thresholds were made with windows of {gates.duration:g} s instead of {window:g} s, which show other "
            f"effects: make others with `ddagr null-bank --window {window:g}`.",
            InputWarning,
            stacklevel=3,
        )
    return window


@contextmanager
def _steps(count: int, progress: Callable[[str], None] | None) -> Iterator[Callable[[str, bool], None]]:
    """Function to call with the name of each step when it begins; the last one ends with the block."""
    names: list[str] = []
    with counting(count, "diagnosing", progress) as steps:

        def begin(name: str, kept: bool) -> None:
            if names:
                steps.advance()
            names.append(name)
            if progress is not None:
                progress(f"step {len(names)} of {count}, {name}{', kept from before' if kept else ''}")

        yield begin
        steps.advance()
