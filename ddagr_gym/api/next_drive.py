"""``ddagr_gym.next_drive``: the manoeuvre that would settle what a diagnosis leaves open."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias, Union

from ddagr_gym.api.nominal import (
    DEFAULT_ROBOT,
    DEFAULT_SOIL,
    RobotLike,
    SoilLike,
    diagnosed_with,
    robot_from,
    soil_from,
)
from ddagr_gym.api.results import Result, Table, names_of
from ddagr_gym.errors import InputError, at_least
from ddagr_gym.files import write_json

if TYPE_CHECKING:
    from ddagr_gym.api.diagnosis_result import DiagnosisResult
    from ddagr_gym.diagnosis.answer.drivetrain import DrivetrainAnswer
    from ddagr_gym.diagnosis.answer.next_drive_plan import NextDrivePlan
    from ddagr_gym.diagnosis.answer.verdict import Diagnosis
    from ddagr_gym.diagnosis.setting import Setting
    from ddagr_gym.physics.effects import Effect

RivalsLike: TypeAlias = "Sequence[str | Effect]"
"""Effects at the sizes to tell apart: ``name=size`` texts or objects."""

QuestionLike: TypeAlias = Union["DiagnosisResult", str, os.PathLike[str], RivalsLike]
"""A diagnosis (result, its folder or its diagnosis.json), or rivals."""


@dataclass(frozen=True, eq=False, repr=False)
class NextDriveResult(Result):
    """The drive that would tell explanations apart best, and the runners-up.

    Attributes:
        answer: as :func:`ddagr_gym.diagnosis.planning.next_drive.next_drive` says it and ``to_json`` writes it.
    """

    answer: NextDrivePlan

    @property
    def manoeuvre(self) -> str:
        """Name of the manoeuvre, as :func:`ddagr_gym.simulate` takes it; "" where none helps."""
        return self.answer.manoeuvre

    @property
    def why(self) -> str:
        """Why this one, or why none, in a sentence."""
        return self.answer.why

    @property
    def separates(self) -> tuple[tuple[str, str], ...]:
        """Pairs of effects that it tells apart."""
        return self.answer.separates

    @property
    def minutes(self) -> float | None:
        """Driving time until the worst pair is told apart [min]; None where never."""
        return self.answer.minutes

    @property
    def alternatives(self) -> tuple[str, ...]:
        """Names of the runners-up, the best first."""
        return tuple(entry.manoeuvre for entry in self.answer.alternatives)

    @property
    def headline(self) -> str:
        """The manoeuvre, and why."""
        return f"Drive {self.manoeuvre}: {self.why}" if self.manoeuvre else self.why

    def tables(self) -> Sequence[Table]:
        """The manoeuvre and the runners-up."""
        from ddagr_gym.reporting.next_drive_text import HEADER, answer_rows

        return [Table(HEADER, answer_rows(self.answer))] if self.manoeuvre else []

    def __str__(self) -> str:
        from ddagr_gym.reporting.next_drive_text import answer_text

        return answer_text(self.answer)

    def to_json(self, path: str | os.PathLike[str]) -> None:
        """Write the answer as JSON, whole or not at all."""
        from ddagr_gym.diagnosis.result.files import plain

        write_json(path, plain(self.answer))


def next_drive(
    diagnosis_or_rivals: QuestionLike,
    robot: RobotLike | None = None,
    soil: SoilLike | None = None,
    *,
    sensors: str | Sequence[str] = (),
    seed: int = 0,
    threads: int = 1,
    progress: Callable[[str], None] | None = None,
) -> NextDriveResult:
    """Name the drive that would tell the remaining explanations of a diagnosis apart.

    Every rival is simulated at its fitted size over every built-in manoeuvre; the others imitate it as well as they
    can, with soil and robot refitted. Manoeuvres are ranked by what is left per minute of driving. Of a diagnosis that
    names parts of the drivetrain the answer says which of them are in doubt, and which driving tells them.

    Args:
        diagnosis_or_rivals: result of :func:`ddagr_gym.diagnose`, folder or diagnosis.json of a diagnosis; or a list of
            effects to tell apart, as ``name=size`` texts or objects.
        robot: nominal: name, YAML file or object; that of the diagnosis by default, ddagr without one. After a
            comparison with ordinary drives give both: those of its calibration, or of the data sheet.
        soil: nominal: name, YAML file or object; that of the diagnosis by default, thesis_a1 without one.
        sensors: some of imu, encoders, pose; those of the diagnosis by default, all without one.
        seed: of the sensor noise.
        threads: of the simulator.
        progress: called with a line of text on what is being done.

    Returns:
        The best manoeuvre, why, how long it must be driven, and the runners-up.

    Raises:
        InputError: no diagnosis at the path, unknown names, no rival or the same one twice.

    Examples:
        >>> import ddagr_gym
        >>> result = ddagr_gym.next_drive(["slope=0.02", "accelerometer_bias=0.2"])
        >>> result.separates
        (('slope', 'accelerometer_bias'),)
    """
    from ddagr_gym.diagnosis.answer.drivetrain import DrivetrainAnswer
    from ddagr_gym.diagnosis.planning.drivetrain_drive import drivetrain_drive
    from ddagr_gym.diagnosis.planning.next_drive import next_drive as planned
    from ddagr_gym.diagnosis.preprocessing.session import be_silent

    at_least(seed=(seed, 0), threads=(threads, 1))
    question = _question(diagnosis_or_rivals)
    if isinstance(question, DrivetrainAnswer):
        return NextDriveResult(drivetrain_drive(question))
    nominal = _nominal(question, robot, soil)
    answer = planned(
        robot_from(nominal[0]),
        soil_from(nominal[1]),
        question.rivals,
        sensors=names_of(sensors) or question.sensors,
        seed=seed,
        setting=replace(question.setting, threads=threads),
        progress=be_silent if progress is None else progress,
    )
    return NextDriveResult(answer)


@dataclass(frozen=True)
class _Question:
    """What is to be told apart, with which sensors, for which robot on which soil, by which diagnosis.

    A comparison with ordinary drives says of neither robot nor soil which it is.
    """

    rivals: list[Effect]
    sensors: tuple[str, ...]
    robot: RobotLike | None
    soil: SoilLike | None
    setting: Setting


def _nominal(question: _Question, robot: RobotLike | None, soil: SoilLike | None) -> tuple[RobotLike, SoilLike]:
    """Robot and soil as given, else those of the question; InputError where neither says."""
    chosen_robot, chosen_soil = question.robot if robot is None else robot, question.soil if soil is None else soil
    if chosen_robot is None or chosen_soil is None:
        raise InputError(
            "the diagnosis compares with ordinary drives and does not say which simulator to plan a drive with: give "
            "robot and soil, of a calibration --robot CALIBRATION/robot.yaml --soil CALIBRATION/soil_GROUND.yaml."
        )
    return chosen_robot, chosen_soil


def _question(given: QuestionLike) -> _Question | DrivetrainAnswer:
    from ddagr_gym.api.diagnosis_result import DiagnosisResult
    from ddagr_gym.diagnosis.result.files import load

    if isinstance(given, DiagnosisResult):
        return _of_diagnosis(given.diagnosis, *given.nominal)
    if isinstance(given, str | os.PathLike):
        path = Path(given)
        diagnosis = load(path / "diagnosis.json" if path.is_dir() else path)
        return _of_diagnosis(diagnosis, *diagnosed_with(diagnosis))
    return _of_rivals(given)


def _of_diagnosis(diagnosis: Diagnosis, robot: RobotLike, soil: SoilLike) -> _Question | DrivetrainAnswer:
    from ddagr_gym.diagnosis.planning.next_drive import rivals_of_diagnosis, sensors_of_diagnosis, setting_of_diagnosis
    from ddagr_gym.diagnosis.setting import Setting

    if diagnosis.drivetrain is not None:
        return diagnosis.drivetrain
    if diagnosis.change is not None:
        return _Question(rivals_of_diagnosis(diagnosis), sensors_of_diagnosis(diagnosis), None, None, Setting())
    setting = setting_of_diagnosis(diagnosis)
    return _Question(rivals_of_diagnosis(diagnosis), sensors_of_diagnosis(diagnosis), robot, soil, setting)


def _of_rivals(given: RivalsLike) -> _Question:
    from ddagr_gym.diagnosis.planning.planned_drive import SENSORS
    from ddagr_gym.diagnosis.setting import Setting
    from ddagr_gym.physics.effects import Effect, load_effects

    if not isinstance(given, Sequence) or not all(isinstance(item, str | Effect) for item in given):
        raise InputError(f"{given!r} is neither a diagnosis nor a list of effects: give one of them.")
    return _Question(list(load_effects(given)), tuple(SENSORS), DEFAULT_ROBOT, DEFAULT_SOIL, Setting())
