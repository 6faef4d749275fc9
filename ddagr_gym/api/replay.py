"""``ddagr_gym.replay``: recorded drives driven again in the simulator, and what it gets wrong."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ddagr_gym.api.inputs import Sources, recordings_from
from ddagr_gym.api.nominal import (
    DEFAULT_ROBOT,
    DEFAULT_SOIL,
    RobotLike,
    SoilLike,
    check_left_out,
    recorded_robot,
    robot_from,
    soil_from,
    soil_label,
)
from ddagr_gym.api.results import Report, Table
from ddagr_gym.api.simulate import EffectsLike
from ddagr_gym.errors import InputError, at_least
from ddagr_gym.files import atomic_path, write_text
from ddagr_gym.parameters import Robot
from ddagr_gym.progress import counting
from ddagr_gym.recordings.schema import Recording

if TYPE_CHECKING:
    from ddagr_gym.physics.effects import Effect
    from ddagr_gym.replay_analysis.report import HorizonError, ReplayReport
    from ddagr_gym.replay_analysis.run import RunResult

NAME = "replay.json"


@dataclass(frozen=True, eq=False, repr=False)
class ReplayResult(Report):
    """Residuals, error growth, refit and baselines of replayed drives.

    ``report`` writes replay.json, figures as PNG and SVG, and a page, index.html.

    Attributes:
        document: what ``replay.json`` holds (:mod:`ddagr_gym.replay_analysis.report`): errors at the horizons,
            residuals, fitted parameters and speed, by run and drive mode.
        runs: windows, predictions and residuals behind it, one per recording, or one for all together.
    """

    document: ReplayReport
    runs: tuple[RunResult, ...]

    def errors(self, horizon: float = 5.0, metric: str = "heading", driven_by: str = "commands") -> list[HorizonError]:
        """Errors of every model after a horizon, on the part of the drives that no fit has seen, run by run.

        Args:
            horizon: 1, 5 or 30 [s].
            metric: of :data:`ddagr_gym.replay_analysis.horizons.METRICS`, such as position or heading.
            driven_by: commands or encoders.
        """
        modes = [mode for run in self.document.runs for mode in run.arms if mode.drive == driven_by]
        return [e for mode in modes for e in mode.horizons if (e.horizon, e.metric) == (horizon, metric)]

    @property
    def headline(self) -> str:
        """What was replayed."""
        sources = ", ".join(source for run in self.document.runs for source in run.sources)
        seconds = sum(run.seconds for run in self.document.runs)
        fit = "refitted" if self.document.refit else "nominal"
        return f"{sources}: {seconds:.0f} s by {self.document.robot} on {self.document.soil}, {fit}"

    def tables(self) -> Sequence[Table]:
        """Heading errors after 5 s of every model."""
        from ddagr_gym.reporting.replay_text import LEAD_HEADER, lead_rows

        return [Table(LEAD_HEADER, lead_rows(self.document))]

    def __str__(self) -> str:
        from ddagr_gym.reporting.replay_text import summary

        return "\n".join(summary(self.document))

    def to_json(self, path: str | os.PathLike[str]) -> None:
        """Write the document as JSON, whole or not at all."""
        from ddagr_gym.replay_analysis.report import save_report

        with atomic_path(path) as part:
            save_report(self.document, part)

    def _fill(self, folder: Path, progress: Callable[[str], None] | None) -> None:
        from ddagr_gym.reporting.replay_page import replay_page

        figures = _draw(self.runs, folder, progress)
        self.to_json(folder / NAME)
        write_text(folder / "index.html", replay_page(self.document, figures))


def replay(
    recordings: Sources,
    robot: RobotLike | None = None,
    soil: SoilLike | None = None,
    *,
    effects: EffectsLike = (),
    calibration: str | os.PathLike[str] | None = None,
    ground: str = "",
    window: float = 2.0,
    refit: bool = False,
    together: bool = False,
    threads: int = 1,
    seed: int = 0,
    column_map: str | os.PathLike[str] | None = None,
    progress: Callable[[str], None] | None = None,
) -> ReplayResult:
    """Drive recordings again in the simulator.

    The simulator is driven by the recorded commands and, in a second drive mode, by the recorded wheel speeds: in short
    windows with free initial states, and from the state at a start over 1, 5 and 30 s and over every whole stretch.
    Parameters and baselines are fitted on one part of each recording and judged on the other.

    Args:
        recordings: one or several recordings, tables with the schema's columns, paths of files or folders.
        robot: that drove: name, YAML file or object; the recordings' own when it is None.
        soil: nominal: name, YAML file or object; None with a calibration, and for the ddagr on thesis_a1.
        effects: missing physics to add: ``name=size`` texts, objects (``result.effects`` of a diagnosis) or a file.
        calibration: folder that ``ddagr calibrate`` wrote, whose robot, soil and sensors are taken as they are.
        ground: of the calibration; may be left out where it has only one.
        window: length of the windows with free initial states [s].
        refit: fit soil and uncertain robot parameters.
        together: let all recordings share one set of fitted parameters; otherwise each is fitted on its own.
        threads: of the simulator.
        seed: of the resampled intervals.
        column_map: shipped map by name or the path of one's own, for files that are not imported yet.
        progress: called with a line of text at every tenth of the work; ``print`` will do.

    Returns:
        Errors and fitted parameters, with page and figures.

    Raises:
        InputError: no recording, one of another robot, unknown names, or nothing that can be replayed.

    Examples:
        >>> import ddagr_gym
        >>> drive = ddagr_gym.simulate("arcs", effects="slope=0.08", rate=25.0, pose_rate=5.0)
        >>> level = ddagr_gym.replay(drive, soil="thesis_a1")
        >>> sloping = ddagr_gym.replay(drive, soil="thesis_a1", effects="slope=0.08")
        >>> before, after = (result.errors(5.0, "position")[0].error.rms for result in (level, sloping))
        >>> after < 0.5 * before  # metres
        True
    """
    from ddagr_gym.physics.effects import load_effects
    from ddagr_gym.recordings.pose_frames import in_one_frame
    from ddagr_gym.replay_analysis.drive_mode import ReplaySettings
    from ddagr_gym.replay_analysis.run import make_report, replay_run, steps

    at_least(threads=(threads, 1), seed=(seed, 0))
    slopes: tuple[Effect, ...] = ()
    if calibration is not None:
        robot, soil, known, slopes = _calibrated(Path(calibration), ground, robot, soil)
        effects = (*known, *load_effects(effects))
    elif ground:
        raise InputError(f"the ground is {ground!r} and there is no calibration: name its folder with --calibration.")
    found = recordings_from(recordings, robot, column_map)
    added = (*load_effects(effects), *(slopes if slopes and in_one_frame(found) else ()))
    nominal = driven_robot(robot, found)
    if soil is None and nominal.name != DEFAULT_ROBOT:
        raise InputError(f"no soil is given for the robot {nominal.name}: name one, or the folder of a calibration.")
    soil = DEFAULT_SOIL if soil is None else soil
    settings = ReplaySettings(window, refit, added, threads=threads, seed=seed)
    groups = [found] if together else [(recording,) for recording in found]
    with counting(steps(len(groups)), "replaying", progress) as count:
        runs = tuple(replay_run(group, nominal, soil_from(soil), settings, count.advance) for group in groups)
    return ReplayResult(make_report(runs, nominal.name, soil_label(soil), settings), runs)


def _calibrated(
    folder: Path, ground: str, robot: RobotLike | None, soil: SoilLike | None
) -> tuple[Robot, Path, tuple[Effect, ...], tuple[Effect, ...]]:
    """Robot, soil file, sensors and slope of a calibration; InputError where robot or soil are given besides."""
    from ddagr_gym.calibration.files import load_robot, load_slope, load_soil, soil_file
    from ddagr_gym.envs.calibrated_draws import EFFECTS
    from ddagr_gym.physics.effects import load_effects

    check_left_out(folder, robot, soil)
    chosen, _ = load_soil(folder, ground)
    return load_robot(folder), folder / soil_file(chosen), load_effects(folder / EFFECTS), load_slope(folder, chosen)


def driven_robot(robot: RobotLike | None, recordings: Sequence[Recording]) -> Robot:
    """Robot that drove: the one given, else the recordings' own.

    Raises:
        InputError: recordings of two robots, none named, or one that is not built in.
    """
    chosen = recorded_robot(recordings) if robot is None else robot
    if chosen is None:
        raise InputError("the recordings do not say which robot drove: name it with --robot (robot=... in Python).")
    return robot_from(chosen)


def _draw(
    runs: Sequence[RunResult], folder: Path, progress: Callable[[str], None] | None
) -> dict[tuple[int, str], list[Path]]:
    from ddagr_gym.reporting.figures import house_style, save_figure
    from ddagr_gym.reporting.recorded_currents import currents_figure, has_currents
    from ddagr_gym.reporting.replay_figures import replay_overview, replay_residuals
    from ddagr_gym.reporting.replay_page import RECORDED
    from ddagr_gym.reporting.replay_text import DRIVEN_BY

    figures: dict[tuple[int, str], list[Path]] = {}
    with counting(sum(len(run.drive_modes) for run in runs), "drawing", progress) as steps:
        for number, run in enumerate(runs):
            stem = _stem(run, number, len(runs))
            for mode in run.drive_modes:
                title = f"{', '.join(run.report.sources)}, driven by {DRIVEN_BY[mode.report.drive]}"
                overview, _ = replay_overview(mode, folder / f"{stem}_{mode.report.drive}", title)
                detail, _ = replay_residuals(mode, folder / f"{stem}_{mode.report.drive}_residuals", title)
                figures[number, mode.report.drive] = [overview, detail]
                steps.advance()
            measured = [recording for recording in run.prepared.recordings if has_currents(recording)]
            if measured:
                with house_style():
                    figures[number, RECORDED] = [save_figure(currents_figure(measured), folder / f"{stem}_currents")[0]]
    return figures


def _stem(run: RunResult, number: int, count: int) -> str:
    name = Path(run.report.sources[0]).name.split(".", 1)[0] or "run"
    name = f"{name}_and_{len(run.report.sources) - 1}_more" if len(run.report.sources) > 1 else name
    return f"{number + 1}_{name}" if count > 1 else name
