"""``ddagr_gym.adapt``: from recordings to controllers that are tuned on what they show."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ddagr_gym.api.inputs import Sources, recordings_from
from ddagr_gym.api.nominal import (
    RobotLike,
    SoilLike,
    check_left_out,
    diagnosed_with,
    robot_from,
    soil_from,
)
from ddagr_gym.api.results import Report, Table
from ddagr_gym.errors import InputError, InputWarning, at_least
from ddagr_gym.extras import need
from ddagr_gym.files import expanded
from ddagr_gym.progress import counting

if TYPE_CHECKING:
    from ddagr_gym.adaptation.corrected import Corrected
    from ddagr_gym.adaptation.run import Adapted
    from ddagr_gym.adaptation.turns import CorrectedTurns
    from ddagr_gym.diagnosis.answer.verdict import Diagnosis
    from ddagr_gym.parameters import Robot, Soil

_UNKNOWN = "unknown"


@dataclass(frozen=True, eq=False, repr=False)
class AdaptationResult(Report):
    """A controller that was tuned on the simulator that recordings correct, and what it is worth there.

    ``report(folder)`` writes a bundle: controller.yaml, robot.yaml, soil.yaml and effects.yaml, which
    ``ddagr evaluate --controllers FOLDER`` and ``find_controller(FOLDER, turn)`` load, adaptation.json, and the page,
    index.html, which needs matplotlib and jinja2.

    Attributes:
        adapted: bundle, what was kept and why, turns before and after.
        corrected: the simulator that it was tuned on.
        turns: in that simulator.
    """

    adapted: Adapted
    corrected: Corrected
    turns: CorrectedTurns

    @property
    def kept(self) -> str:
        """What is kept: "nominal", "known", or "tuned" (B6) or "taught" (B4)."""
        return self.adapted.kept

    @property
    def headline(self) -> str:
        """Radius error and success before and after, in a sentence."""
        from ddagr_gym.reporting.adaptation_text import headline

        return headline(self.adapted, self.corrected)

    def tables(self) -> list[Table]:
        """Before and after; what was taken from the diagnosis."""
        from ddagr_gym.reporting import adaptation_text as text

        return [
            Table(text.OUTCOME_HEADER, text.outcome_rows(self.adapted)),
            Table(text.TAKEN_HEADER, text.taken_rows(self.adapted, self.corrected)),
        ]

    def __str__(self) -> str:
        from ddagr_gym.reporting.adaptation_text import adaptation_text

        return adaptation_text(self.adapted, self.corrected)

    def _fill(self, folder: Path, progress: Callable[[str], None] | None) -> None:
        from ddagr_gym.adaptation.files import NAME, as_json
        from ddagr_gym.files import write_json
        from ddagr_gym.reporting.adaptation_page import write_page

        self.adapted.bundle.save(folder, f"adapted: {self.corrected.sentence}")
        write_json(folder / NAME, as_json(self.adapted, self.corrected))
        write_page(folder, self.adapted, self.corrected, self.turns)


def adapt(
    recordings: Sources | None = None,
    robot: RobotLike | None = None,
    soil: SoilLike | None = None,
    *,
    diagnosis: str | os.PathLike[str] | None = None,
    calibration: str | os.PathLike[str] | None = None,
    ground: str = "",
    controller: str = "B4",
    radius: float = 0.8,
    speed: float = 0.2,
    row_heading: float = 0.0,
    turns: int = 20,
    anyway: bool = False,
    seed: int = 0,
    threads: int = 1,
    column_map: str | os.PathLike[str] | None = None,
    progress: Callable[[str], None] | None = None,
    cache: str | os.PathLike[str] | None = None,
) -> AdaptationResult:
    """Diagnose recordings and tune a controller on the simulator that they correct.

    The controller gets the refitted robot, a prior of the refitted soil for its filter, and what was named: errors
    of sensors and commands are taken from readings and commands, and load, delay, slope and drag go into its model. The
    filter of B6 reckons also with the noise of accelerometer and gyro that the recordings show, where recordings are
    given. The gains are then searched, and B4 is taught a feed-forward, on turns in the corrected simulator, where
    sizes are drawn from their intervals. What does worse there than the nominal controller is not kept.

    Args:
        recordings: one or several recordings of the robot on the ground in question; None with a diagnosis or
            calibration that is finished.
        robot: nominal: name, YAML file or object; with a diagnosis, that with which the drives were diagnosed, which is
            taken where it is None; of recordings None as in :func:`ddagr_gym.diagnose`.
        soil: nominal, likewise.
        diagnosis: folder that ``ddagr diagnose`` wrote, in place of recordings.
        calibration: folder that ``ddagr calibrate`` wrote, in place of robot and soil: alone, or with recordings that
            are compared with its ordinary drives.
        ground: of the calibration, on which the turns are driven; may be left out where there is only one.
        controller: B4, the force balance, or B6, the path tracker.
        radius: of the turns [m].
        speed: of the turns [m/s].
        row_heading: direction of the rows in the world of the recordings' poses [rad]; without poses that world begins
            at the start of the first recording. It matters for slopes.
        turns: driven by the nominal and by the adapted controller for the report.
        anyway: adapt although the recordings hold something that has no name: to the refitted robot and soil alone.
        seed: of all draws.
        threads: of the diagnosis.
        column_map: of files that are not imported yet.
        progress: called with a line of text from time to time.
        cache: folder in which finished steps are kept, so that the same call goes on after an interruption; of
            recordings against a calibration the turns alone.

    Returns:
        The controller, what was kept and why, turns before and after; ``report`` writes the bundle.

    Raises:
        InputError: recordings that cannot be diagnosed, a diagnosis that says "unknown", a turn that the robot cannot
            make, another controller, a robot or soil beside a calibration.
        InputWarning: (a warning) the diagnosis is not complete, or names what the controller does not use.

    Examples:
        >>> import ddagr_gym
        >>> names = ("arcs", "s_weave")
        >>> drives = [ddagr_gym.simulate(name, effects="slope=0.05", pose_rate=5.0) for name in names]
        >>> result = ddagr_gym.adapt(drives, controller="B4", turns=6)
        >>> result.kept
        'taught'
        >>> result.adapted.used
        ('slope',)
    """
    from ddagr_gym.adaptation.measured_noise import measured_sensors
    from ddagr_gym.adaptation.run import Effort, adapted, nominal_settings
    from ddagr_gym.adaptation.turns import CorrectedTurns, MeasuredTurns

    at_least(turns=(turns, 2), seed=(seed, 0), threads=(threads, 1))
    need("matplotlib", "jinja2")
    nominal_settings(controller)
    _check_sources(recordings, diagnosis, calibration, ground)
    if calibration is not None:
        check_left_out(Path(calibration), robot, soil)
    place = None if cache is None else expanded(cache)
    if recordings is not None:
        options = {"seed": seed, "threads": threads, "column_map": column_map, "progress": progress}
        found, answer = _diagnosed(recordings, robot, soil, calibration, ground, place, options)
        if controller == "B6":
            taken = recordings_from(recordings, None if calibration is not None else found.robot, column_map)
            found = replace(found, sensors=measured_sensors(taken, found.robot))
    elif diagnosis is not None:
        found, answer = _read_diagnosis(Path(diagnosis))
    else:
        assert calibration is not None
        found, answer = corrected_by_calibration(Path(calibration), ground), None
    usable = _usable(found, anyway)
    if calibration is not None or answer is None:
        nominal = usable.robot, usable.soil
    else:
        nominal = _nominal_of(answer, robot, soil)
        _check_same_robot(usable, nominal[0])
    effort = Effort(report=turns)
    simulated = CorrectedTurns(usable, radius, speed, seed)
    with counting(effort.turns(controller), "turns", progress) as counter:
        measured = MeasuredTurns(simulated, None if place is None else place / _journal(usable, radius, speed, seed),
                                 counter.advance)  # fmt: skip
        result = adapted(
            usable, *nominal, measured, controller=controller, row_heading=row_heading, effort=effort, seed=seed
        )
    return AdaptationResult(result, usable, simulated)


def _journal(corrected: Corrected, radius: float, speed: float, seed: int) -> str:
    """File of the turns that a simulator gives."""
    import hashlib

    text = repr((corrected, radius, speed, seed))
    return f"turns_{hashlib.sha256(text.encode()).hexdigest()[:12]}.jsonl"


def _check_sources(recordings: object, diagnosis: object, calibration: object, ground: str) -> None:
    if recordings is None and diagnosis is None and calibration is None:
        raise InputError("there is nothing to adapt to: give recordings, a diagnosis or a calibration.")
    if diagnosis is not None and (recordings is not None or calibration is not None):
        raise InputError("a diagnosis and recordings or a calibration are given: leave out one of them.")
    if ground and calibration is None:
        raise InputError(f"the ground is {ground!r} and there is no calibration: give its folder.")


def _check_same_robot(found: Corrected, nominal: Robot) -> None:
    if found.robot.name != nominal.name:
        raise InputError(
            f"the diagnosis is of the robot {found.robot.name!r} and the controller knew {nominal.name!r}: name the "
            "robot with whose data sheet the drives were diagnosed, and its soil."
        )


def _nominal_of(answer: Diagnosis, robot: RobotLike | None, soil: SoilLike | None) -> tuple[Robot, Soil]:
    """Robot and soil as given, else those with which drives were diagnosed."""
    known_robot, known_soil = diagnosed_with(answer)
    return robot_from(known_robot if robot is None else robot), soil_from(known_soil if soil is None else soil)


def _diagnosed(
    recordings: Sources,
    robot: RobotLike | None,
    soil: SoilLike | None,
    calibration: str | os.PathLike[str] | None,
    ground: str,
    cache: Path | None,
    options: Mapping[str, Any],
) -> tuple[Corrected, Diagnosis]:
    """What recordings say: against the nominal simulator, or against a calibration's ordinary drives."""
    from ddagr_gym.adaptation.corrected import Corrected
    from ddagr_gym.api.diagnose import diagnose
    from ddagr_gym.diagnosis.pipeline import effect_intervals

    steps = None if cache is None else cache / "diagnosis"
    if calibration is None:
        result = diagnose(recordings, robot, soil, names_only=True, cache=steps, **options)
        if result.robot is None or result.soil is None:
            raise InputError(f"there is no corrected simulator to tune on, {result.refit_note}: check the recordings.")
        base = Corrected(result.robot, result.soil)
    else:
        base = corrected_by_calibration(Path(calibration), ground)
        result = diagnose(recordings, calibration=calibration, ground=ground, names_only=True, **options)
    found = replace(
        base,
        effects=result.effects,
        intervals=tuple(effect_intervals(result.diagnosis, result.effects)),
        **_answer(result.diagnosis),
    )
    return found, result.diagnosis


def _answer(diagnosis: Diagnosis) -> dict[str, Any]:
    return {"verdict": tuple(diagnosis.verdict), "complete": diagnosis.complete, "sentence": diagnosis.sentence}


def corrected_by_diagnosis(folder: Path) -> Corrected:
    """The corrected simulator of a folder that ``ddagr diagnose`` wrote, or of the diagnosis.json in one.

    Raises:
        InputError: a file is missing or wrong.
    """
    return _read_diagnosis(folder)[0]


def _read_diagnosis(folder: Path) -> tuple[Corrected, Diagnosis]:
    """The corrected simulator and the answer; as :func:`corrected_by_diagnosis`."""
    from ddagr_gym.adaptation.corrected import Corrected
    from ddagr_gym.diagnosis.result.files import load
    from ddagr_gym.physics.effects import load_effects, load_intervals
    from ddagr_gym.presets import get_robot, get_soil

    place = folder.expanduser()
    place = place.parent if place.is_file() else place
    answer = load(place / "diagnosis.json")
    if answer.change is not None:
        raise InputError(
            f"{place} compares with ordinary drives and holds no corrected simulator: give the recordings themselves "
            "and --calibration with its folder."
        )
    for name in ("robot.yaml", "soil.yaml", "effects.yaml"):
        if not (place / name).is_file():
            raise InputError(f"{place} holds no {name}, so that there is no corrected simulator: diagnose again.")
    found = Corrected(
        get_robot(str(place / "robot.yaml")),
        get_soil(str(place / "soil.yaml")),
        load_effects(place / "effects.yaml"),
        load_intervals(place / "effects.yaml"),
        **_answer(answer),
    )
    return found, answer


def corrected_by_calibration(folder: Path, ground: str = "") -> Corrected:
    """The simulator of a folder that ``ddagr calibrate`` wrote; InputError as :func:`load_soil`."""
    from ddagr_gym.adaptation.corrected import Corrected
    from ddagr_gym.calibration.files import load_slope, load_soil
    from ddagr_gym.envs.calibrated_draws import EFFECTS, load_draws
    from ddagr_gym.physics.effects import load_effects

    chosen, soil = load_soil(folder, ground)
    draws = load_draws(folder, ground)
    return Corrected(
        draws.robot,
        soil,
        load_slope(folder, chosen),
        sentence=f"the calibration {folder.name}",
        calibration=folder,
        ground=ground,
        ordinary=load_effects(folder / EFFECTS),
    )


def _usable(found: Corrected, anyway: bool) -> Corrected:
    """What may be tuned on; warnings where the answer is not the whole one.

    Raises:
        InputError: nothing has a name and nobody said ``anyway``.
    """
    if _UNKNOWN in found.verdict and not anyway:
        raise InputError(
            "the recordings hold something that no effect explains (verdict: unknown), so that the corrected simulator "
            "is not the robot's: record the drive that `ddagr next-drive` proposes, or say --anyway (anyway=True) to "
            "adapt to the refitted robot and soil alone."
        )
    if not found.complete:
        warnings.warn(
            "the diagnosis is not complete: the recordings hold more than was named, or a name is doubtful, as its "
            "sentence says; the controller is tuned on what was named.",
            InputWarning,
            stacklevel=3,
        )
    return found
