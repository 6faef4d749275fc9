"""``ddagr_gym.export``: a corrected simulator for MuJoCo, for Gazebo, or as ranges for randomisation."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from ddagr_gym.api.nominal import RobotLike, SoilLike, robot_from, soil_from
from ddagr_gym.api.results import Report, Table
from ddagr_gym.errors import at_least, unknown_name

if TYPE_CHECKING:
    from ddagr_gym.exporting.carried_over import CarriedOver
    from ddagr_gym.exporting.comparison import Comparison
    from ddagr_gym.exporting.corrected import Corrected
    from ddagr_gym.exporting.outcome import Outcome
    from ddagr_gym.exporting.ranges import Range


@dataclass(frozen=True, eq=False, repr=False)
class ExportResult(Report):
    """A corrected simulator as another simulator can have it.

    ``report`` writes the files of the format and the page, index.html, which says what carries over, with which error,
    and what does not.

    Attributes:
        outcome: numbers with ranges, the comparison, and files.
    """

    outcome: Outcome

    @property
    def carried_over(self) -> CarriedOver:
        """Numbers that carry over."""
        return self.outcome.carried_over

    @property
    def ranges(self) -> dict[str, Range]:
        """The same with their ranges, by name."""
        return self.outcome.ranges

    @property
    def comparison(self) -> Comparison:
        """Drives in our simulator and in the other one, or in the kinematic model where the other did not run."""
        return self.outcome.comparison

    @property
    def files(self) -> dict[str, str]:
        """Text of the files by name."""
        return self.outcome.files

    @property
    def headline(self) -> str:
        """What was exported and how well it turns."""
        from ddagr_gym.reporting.export_text import headline

        return headline(self.outcome)

    def tables(self) -> Sequence[Table]:
        """Drives that were compared, and numbers with ranges."""
        from ddagr_gym.reporting.export_text import COMPARED_HEADER, RANGE_HEADER, compared_rows, range_rows

        return [
            Table(COMPARED_HEADER, compared_rows(self.comparison.drives)),
            Table(RANGE_HEADER, range_rows(self.ranges)),
        ]

    def __str__(self) -> str:
        from ddagr_gym.reporting.export_text import export_text

        return export_text(self.outcome)

    def _fill(self, folder: Path, progress: Callable[[str], None] | None) -> None:
        from ddagr_gym.reporting.export_page import write_page

        for name, text in self.files.items():
            (folder / name).write_text(text, encoding="utf-8")
        write_page(folder, self.outcome)


def export(
    source: str | os.PathLike[str],
    to: str,
    *,
    ground: str = "",
    robot: RobotLike | None = None,
    soil: SoilLike | None = None,
    speed: float | None = None,
    draws: int = 100,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> ExportResult:
    """Take what carries over of a corrected simulator to another one.

    Args:
        source: folder that ``ddagr diagnose`` or ``ddagr calibrate`` wrote.
        to: ``mujoco``, ``gazebo`` or ``randomisation``.
        ground: of a calibration with several.
        robot: in place of the diagnosis's robot.yaml, or where it has none.
        soil: in place of the diagnosis's soil.yaml, or where it has none.
        speed: rim speed of the working point [m/s]; 0.3 times the largest by default.
        draws: number of draws that ranges come from.
        seed: of the draws.
        progress: called with a line of text from time to time.

    Returns:
        Numbers with ranges, and the comparison; ``report`` writes files and page. A MuJoCo model is stepped for the
        comparison where the package ``mujoco`` is installed.

    Raises:
        InputError: no such folder, an unknown format or ground, a speed that the robot does not reach, or a turn that
            no friction makes.

    Examples:
        >>> import tempfile
        >>> import ddagr_gym
        >>> from pathlib import Path
        >>> from ddagr_gym.physics.effects import load_effects, save_effects
        >>> folder = Path(tempfile.mkdtemp())
        >>> save_effects(folder / "effects.yaml", load_effects("gyro_scale=1.02"))
        >>> _ = (folder / "diagnosis.json").write_text("{}")
        >>> result = ddagr_gym.export(folder, "gazebo", robot="ddagr", soil="thesis_a1", draws=2)
        >>> 1.3 < result.carried_over.effective_track < 1.8  # metres; the geometric track is 1.16
        True
    """
    from ddagr_gym.config import dump_config
    from ddagr_gym.exporting import files
    from ddagr_gym.exporting.carried_over import carried_over
    from ddagr_gym.exporting.comparison import compare, kinematic_motion
    from ddagr_gym.exporting.corrected import load_corrected
    from ddagr_gym.exporting.mujoco_drives import drive_mujoco
    from ddagr_gym.exporting.outcome import Outcome
    from ddagr_gym.exporting.randomisation import VERSION, RandomisationFile
    from ddagr_gym.exporting.ranges import ranges_of
    from ddagr_gym.exporting.working_point import working_speed

    if to not in files.FORMATS:
        raise unknown_name("format", to, files.FORMATS)
    at_least(draws=(draws, 2), seed=(seed, 0))
    corrected = load_corrected(
        source, ground, None if robot is None else robot_from(robot), None if soil is None else soil_from(soil)
    )
    mean_speed = working_speed(corrected.found, speed)
    found, drives = carried_over(corrected.found, mean_speed)
    texts = _models(to, corrected, found)
    ran = to == files.MUJOCO and find_spec("mujoco") is not None
    other = drive_mujoco(texts[files.MUJOCO_FILE], drives.commands) if ran else kinematic_motion(found, drives.commands)
    ranges = ranges_of(corrected, found, mean_speed, draws=draws, seed=seed, progress=progress)
    if to == files.RANDOMISATION:
        name, source = corrected.found.robot.name, corrected.source
        content = RandomisationFile(VERSION, name, source, mean_speed, draws, seed, ranges)
        texts = {files.RANDOMISATION_FILE: dump_config(content)}
    comparison = compare(drives, other)
    return ExportResult(Outcome(to, corrected, mean_speed, found, comparison, ranges, draws, seed, texts))


def _models(to: str, corrected: Corrected, found: CarriedOver) -> dict[str, str]:
    """Models by the name of their file; none for ranges."""
    from ddagr_gym.exporting import files
    from ddagr_gym.exporting.gazebo_model import gazebo_config, gazebo_model
    from ddagr_gym.exporting.mujoco_model import mujoco_model

    name = corrected.found.robot.name
    if to == files.MUJOCO:
        return {files.MUJOCO_FILE: mujoco_model(name, found)}
    if to == files.GAZEBO:
        model = gazebo_model(name, found)
        return {files.GAZEBO_FILE: model, files.GAZEBO_CONFIG: gazebo_config(name, corrected.source)}
    return {}
