"""``ddagr_gym.simulate``: one drive of a robot by open-loop commands."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ddagr_gym.api.nominal import RobotLike, SoilLike, robot_from, soil_from, soil_label
from ddagr_gym.api.results import Result, Table
from ddagr_gym.control.manoeuvres import Manoeuvre, find_manoeuvre
from ddagr_gym.errors import InputError, at_least
from ddagr_gym.parameters import Imu, Numerics, PoseReceiver, Robot, Sensors, WheelEncoder
from ddagr_gym.recordings.schema import Recording

if TYPE_CHECKING:
    from ddagr_gym.physics.effects import Effect

Array: TypeAlias = npt.NDArray[np.float64]

EffectsLike: TypeAlias = "str | os.PathLike[str] | Effect | Iterable[str | Effect]"
"""Effects: ``name=size`` texts, objects (``result.effects`` of a diagnosis), or the path of an effects file."""


@dataclass(frozen=True, eq=False, repr=False)
class SimulationResult(Result):
    """A simulated drive: what its recording holds, and the truth.

    Attributes:
        columns: (T,) by name, ``t`` [s] first: commands and readings in the schema's units (NaN where a channel has no
            new sample), and ``true_...``.
        robot: that drove.
        soil_name: on which.
        title: of the drive.
    """

    columns: Mapping[str, Array]
    robot: Robot
    soil_name: str
    title: str

    @cached_property
    def recording(self) -> Recording:
        """The drive in the common schema, as check, replay, diagnose and estimate take it; the truth is in extras."""
        return Recording.from_columns(self.columns, self.robot)

    @property
    def truth(self) -> dict[str, Array]:
        """Columns that no sensor reads, by name without ``true_``."""
        return {name.removeprefix("true_"): v for name, v in self.columns.items() if name.startswith("true_")}

    @property
    def headline(self) -> str:
        """What was driven, how long and where it ended."""
        last = {name: float(values[-1]) for name, values in self.columns.items()}
        return (
            f"{self.title}, {self.robot.name} on {self.soil_name}: {last['t']:.1f} s, "
            f"at x {last['true_x']:.2f} m, y {last['true_y']:.2f} m in the end"
        )

    def tables(self) -> Sequence[Table]:
        """State at the end, largest slip ratio and sinkage."""
        from ddagr_gym.reporting.drive_text import HEADER, end_rows

        return [Table(HEADER, end_rows(self.columns))]

    def __str__(self) -> str:
        from ddagr_gym.reporting.drive_text import drive_text

        return drive_text(self.columns)

    def to_pandas(self) -> Any:
        """All columns as a pandas.DataFrame, which check, replay and diagnose take."""
        from ddagr_gym.api.tables import pandas_of

        return pandas_of(self.columns)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the drive as .parquet (a recording in the common schema) or .csv, whole or not at all."""
        from ddagr_gym.recordings.storage import save_drive

        save_drive(_path(path, ".parquet", ".csv"), self.columns, self.robot)

    def figure(self, path: str | os.PathLike[str]) -> None:
        """Draw path, speeds, slip and sinkage as .png, with an .svg beside it; needs matplotlib."""
        from ddagr_gym.reporting.drive_figure import drive_figure

        drive_figure(
            dict(self.columns), _path(path, ".png"), robot=self.robot, soil_name=self.soil_name, title=self.title
        )

    def video(self, path: str | os.PathLike[str]) -> None:
        """Film the drive as .mp4; needs pygame and imageio-ffmpeg."""
        from ddagr_gym.rendering.render import SceneRenderer
        from ddagr_gym.rendering.scene import open_stage, scenes
        from ddagr_gym.rendering.video import write_video

        target, columns = _path(path, ".mp4"), dict(self.columns)
        stage = open_stage(columns["true_x"], columns["true_y"], self.robot, self.soil_name, self.title)
        renderer = SceneRenderer()
        write_video(target, (renderer.draw(scene) for scene in scenes(columns, stage)))
        renderer.close()


def _path(path: str | os.PathLike[str], *allowed: str) -> Path:
    if Path(path).suffix.lower() not in allowed:
        raise InputError(f"the file is {path}: give a path that ends in {' or '.join(allowed)}.")
    return Path(path)


def simulate(
    manoeuvre: str | os.PathLike[str] | Manoeuvre | npt.ArrayLike = "table_6_2",
    robot: RobotLike = "ddagr",
    soil: SoilLike = "thesis_a1",
    effects: EffectsLike = (),
    *,
    rate: float = 125.0,
    pose_rate: float = 0.0,
    noise: bool = True,
    seed: int = 0,
    fine: bool = False,
) -> SimulationResult:
    """Simulate one drive.

    Args:
        manoeuvre: name of a built-in drive; CSV with columns t, command_right, command_left [s, rad/s]; a
            :class:`~ddagr_gym.control.manoeuvres.Manoeuvre`; or (T, 2) right and left bank speed commands at ``rate``
            [rad/s].
        robot: name, YAML file or object.
        soil: name, YAML file or object.
        effects: missing physics: ``name=size`` texts, objects such as a diagnosis's ``effects``, or an effects file.
        rate: sensor samples per second [Hz].
        pose_rate: fixes of a pose receiver per second [Hz]; 0 for none.
        noise: sensor noise; False for ideal sensors.
        seed: of the sensor noise.
        fine: converged numerics, about forty times slower, instead of the default (nine in ten force errors below
            1.3e-3).

    Returns:
        Columns of the drive, its recording, figure and video.

    Raises:
        InputError: an unknown name, a file that is missing, or values that make no drive.

    Examples:
        >>> import ddagr_gym
        >>> drive = ddagr_gym.simulate("straight", soil="lete_sand_wong", effects="slope=0.05", rate=50.0)
        >>> drive.recording.has("yaw_rate", "encoder_right")
        True
        >>> bool(drive.truth["sinkage_1"].max() > 0.005)  # metres
        True
    """
    from ddagr_gym.physics.effects import load_effects
    from ddagr_gym.simulator import simulate as simulated

    at_least(seed=(seed, 0))
    found = robot_from(robot)
    sensors = _sensors(rate, pose_rate, noise)  # refuses a rate at which there are no commands
    commands, title = _commands(manoeuvre, rate)
    columns = simulated(
        found,
        soil_from(soil),
        commands,
        sensors=sensors,
        effects=load_effects(effects),
        numerics=Numerics.finest() if fine else Numerics(),
        seed=seed,
    )
    return SimulationResult(columns, found, soil_label(soil), title)


def _commands(manoeuvre: Any, rate: float) -> tuple[Any, str]:
    """(T, 2) commands at the rate, and what the drive is called."""
    if isinstance(manoeuvre, str | os.PathLike):
        manoeuvre = find_manoeuvre(str(manoeuvre))
    if isinstance(manoeuvre, Manoeuvre):
        return manoeuvre.commands(rate), manoeuvre.name
    return manoeuvre, "own commands"


def _sensors(rate: float, pose_rate: float, noise: bool) -> Sensors:
    for name, value in (("rate", rate), ("pose_rate", pose_rate)):
        if not value >= 0.0:
            raise InputError(f"{name} is {value:g} Hz: give 0 or more.")
    if pose_rate > rate:
        raise InputError(f"pose_rate is {pose_rate:g} Hz: give at most the {rate:g} Hz of the other sensors.")
    imu, encoder, pose = Imu(sample_rate=rate), WheelEncoder(), PoseReceiver(rate=pose_rate)
    if not noise:
        imu = replace(imu, accelerometer_noise=0.0, gyro_noise=0.0, accelerometer_resolution=0.0, gyro_resolution=0.0)
        encoder = replace(encoder, counts_per_revolution=0.0)
        pose = replace(pose, position_noise=0.0, yaw_noise=0.0)
    return Sensors(imu, encoder, pose)
