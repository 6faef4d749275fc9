"""One door for every kind of recording: what the file is decides which reader takes it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.column_map import ColumnMap, load_column_map, most_specific_map
from ddagr_gym.recordings.conversion import RawTable, build_recording
from ddagr_gym.recordings.csv_head import csv_head
from ddagr_gym.recordings.csv_reader import read_csv
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits, kind_of, sha256_of
from ddagr_gym.recordings.parquet_reader import parquet_columns, read_parquet
from ddagr_gym.recordings.rosbag_reader import BAG_KINDS, read_rosbag
from ddagr_gym.recordings.schema import Recording, RobotGeometry
from ddagr_gym.recordings.storage import is_recording, load_parquet
from ddagr_gym.recordings.topic_map import load_topic_map

DEFAULT_TOPICS = "topics_default"

GeometryByName = Callable[[str], RobotGeometry]


def preset_geometry(name: str) -> RobotGeometry:
    """Geometry of a preset robot.

    Raises:
        InputError: unknown robot.
    """
    from ddagr_gym.presets import get_robot

    return RobotGeometry.of(get_robot(name))


def load_recording(
    source: str | Path,
    map_name: str | None = None,
    robot: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
    geometry_of: GeometryByName = preset_geometry,
) -> Recording:
    """Recording from a file or folder of any kind that a reader takes.

    Args:
        source: recording in Parquet, CSV (also gzip), foreign Parquet, ROS 1 or 2 bag, MCAP.
        map_name: shipped map's name or a map's path; a table without one takes the shipped map that explains
            most of its columns, a bag the default topic map.
        robot: robot's name or its YAML file; the map's own where absent.
        limits: on rows and bytes.
        geometry_of: where a robot's geometry comes from.

    Raises:
        InputError: whatever is wrong with the file, the map or the robot, in one sentence.
    """
    path = Path(source)
    kind = kind_of(path)
    if kind in BAG_KINDS:
        topic_map = load_topic_map(map_name or DEFAULT_TOPICS)
        geometry = _geometry(robot or topic_map.robot, geometry_of)
        return read_rosbag(path, topic_map, geometry, limits)
    if kind == "parquet" and is_recording(path, limits):
        recording = load_parquet(path, limits)
        return recording if robot is None else with_robot(recording, robot, geometry_of)
    table, column_map = _table(path, kind, map_name, limits)
    geometry = _geometry(robot or column_map.robot, geometry_of)
    try:
        return build_recording(table, column_map, geometry, source=path.name, source_sha256=sha256_of(path))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _geometry(robot: str, geometry_of: GeometryByName) -> RobotGeometry | None:
    return geometry_of(robot) if robot else None


def with_robot(recording: Recording, robot: str, geometry_of: GeometryByName = preset_geometry) -> Recording:
    """A recording with the geometry of a robot.

    Args:
        recording: of that robot, or of one that it does not name.
        robot: its name or YAML file.
        geometry_of: where its geometry comes from.

    Raises:
        InputError: the recording is of another robot.
    """
    geometry = geometry_of(robot)
    if recording.meta.robot not in ("", geometry.name):
        raise InputError(
            f"{recording.meta.source} was imported for the robot {recording.meta.robot!r}, not {geometry.name!r}: "
            "give --robot with that one, or import it again."
        )
    return recording.with_meta(robot=geometry.name, geometry=geometry)


def _table(path: Path, kind: str, map_name: str | None, limits: Limits) -> tuple[RawTable, ColumnMap]:
    if map_name is not None:
        column_map = load_column_map(map_name)
    else:
        names = parquet_columns(path, limits) if kind == "parquet" else csv_head(path, limits).names
        column_map = most_specific_map(names, path.name)
    read = read_parquet if kind == "parquet" else read_csv
    return read(path, column_map, limits), column_map
