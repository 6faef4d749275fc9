"""``ddagr simulate``: one drive of a robot by open-loop commands."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import tyro

from ddagr_gym.commands.output import atomic_path, format_table
from ddagr_gym.errors import InputError

EXAMPLES = (
    "ddagr simulate --manoeuvre table_6_2 --soil thesis_a1 --output run.parquet",
    "ddagr simulate --manoeuvre arcs --soil lete_sand_wong --effect towed_drag=80 --effect slope=0.05 --video a.mp4",
    "ddagr simulate --manoeuvre commands.csv --robot husky --soil firm_ground --output run.csv --video run.mp4",
)


@dataclass(frozen=True)
class Arguments:
    """Simulate a drive and write its recording, figure or video.

    Attributes:
        manoeuvre: name of a built-in drive, or a CSV with columns t, command_right, command_left [s, rad/s].
        soil: name of a soil (ddagr soils), or the path of a YAML file with one's own.
        robot: name of a robot (ddagr robots), or the path of a YAML file with one's own.
        effect: missing physics, name=size or name=size,parameter=value, or an effects file; may be repeated.
        output: recording to write, .parquet or .csv.
        figure: figure to write, .png (an .svg stands beside it).
        video: video to write, .mp4.
        rate: sensor samples per second [Hz].
        pose_rate: fixes of a pose receiver per second [Hz]; 0 for none.
        noise: sensor noise; --no-noise for ideal sensors.
        seed: of the sensor noise.
        fine: converged numerics, about forty times slower, instead of the default (force errors below 1e-3).
    """

    manoeuvre: str = "table_6_2"
    soil: str = "thesis_a1"
    robot: str = "ddagr"
    effect: Annotated[tuple[str, ...], tyro.conf.UseAppendAction, tyro.conf.arg(aliases=("--effects",))] = ()
    output: Path | None = None
    figure: Path | None = None
    video: Path | None = None
    rate: float = 125.0
    pose_rate: float = 0.0
    noise: bool = True
    seed: int = 0
    fine: bool = False


def run(arguments: Arguments) -> None:
    """Simulate, write what was asked for, and print where the drive ended."""
    from ddagr_gym.control.manoeuvres import find_manoeuvre
    from ddagr_gym.parameters import Numerics
    from ddagr_gym.presets import get_robot, get_soil
    from ddagr_gym.simulator import simulate

    _check_suffix("output", arguments.output, (".parquet", ".csv"))
    _check_suffix("figure", arguments.figure, (".png",))
    _check_suffix("video", arguments.video, (".mp4",))
    robot = get_robot(arguments.robot)
    sensors = _sensors(arguments)
    manoeuvre = find_manoeuvre(arguments.manoeuvre)
    columns = simulate(
        robot,
        get_soil(arguments.soil),
        manoeuvre.commands(arguments.rate),
        sensors=sensors,
        effects=arguments.effect,
        numerics=Numerics.finest() if arguments.fine else Numerics(),
        seed=arguments.seed,
    )
    _write(arguments, columns, robot, manoeuvre.name)
    print(_summary(columns))


def _check_suffix(option: str, path: Path | None, allowed: tuple[str, ...]) -> None:
    if path is not None and path.suffix.lower() not in allowed:
        raise InputError(f"--{option} {path}: give a path that ends in {' or '.join(allowed)}.")


def _sensors(arguments: Arguments) -> Any:
    from ddagr_gym.parameters import Imu, PoseReceiver, Sensors, WheelEncoder

    imu, encoder, pose = Imu(sample_rate=arguments.rate), WheelEncoder(), PoseReceiver(rate=arguments.pose_rate)
    if not arguments.noise:
        imu = replace(imu, accelerometer_noise=0.0, gyro_noise=0.0, accelerometer_resolution=0.0, gyro_resolution=0.0)
        encoder = replace(encoder, counts_per_revolution=0.0)
        pose = replace(pose, position_noise=0.0, yaw_noise=0.0)
    return Sensors(imu, encoder, pose)


def _write(arguments: Arguments, columns: Any, robot: Any, title: str) -> None:
    if arguments.output is not None:
        write_recording(arguments.output, columns, robot)
    if arguments.figure is not None:
        from ddagr_gym.reporting.drive_figure import drive_figure

        drive_figure(columns, arguments.figure, robot=robot, soil_name=arguments.soil, title=title)
    if arguments.video is not None:
        from ddagr_gym.rendering.render import SceneRenderer
        from ddagr_gym.rendering.scene import open_stage, scenes
        from ddagr_gym.rendering.video import write_video

        stage = open_stage(columns["true_x"], columns["true_y"], robot, arguments.soil, title)
        renderer = SceneRenderer()
        write_video(arguments.video, (renderer.draw(scene) for scene in scenes(columns, stage)))
        renderer.close()


def write_recording(path: Path, columns: Any, robot: Any) -> None:
    """Write a simulated drive as Parquet in the recordings' schema, or as CSV, by the suffix."""
    if path.suffix.lower() == ".parquet":
        from ddagr_gym.recordings.schema import Recording
        from ddagr_gym.recordings.storage import save_parquet

        save_parquet(Recording.from_columns(columns, robot), path)
        return
    import numpy as np

    with atomic_path(path) as temporary:
        table = np.column_stack(list(columns.values()))
        np.savetxt(temporary, table, delimiter=",", fmt="%.9g", header=",".join(columns), comments="")


def _summary(columns: Any) -> str:
    import numpy as np

    last = {name: float(values[-1]) for name, values in columns.items()}
    slip = max(float(np.abs(columns[f"true_slip_ratio_{i}"]).max()) for i in (1, 2, 3, 4))
    sinkage = max(float(columns[f"true_sinkage_{i}"].max()) for i in (1, 2, 3, 4))
    bogged = any(columns[f"true_bogged_{i}"].any() for i in (1, 2, 3, 4))
    rows = [
        ("time", last["t"], "s"),
        ("position x", last["true_x"], "m"),
        ("position y", last["true_y"], "m"),
        ("heading", np.degrees(last["true_yaw"]), "deg"),
        ("speed", float(np.hypot(last["true_v_x"], last["true_v_y"])), "m/s"),
        ("yaw rate", last["true_yaw_rate"], "rad/s"),
        ("largest slip ratio", slip, "-"),
        ("largest sinkage", 1e3 * sinkage, "mm"),
    ]
    note = "\nA wheel bogged down: no sinkage carried its load." if bogged else ""
    return format_table(("at the end", "value", "unit"), rows) + note
