"""Recordings from what a caller has: recordings, tables, simulated drives, files and folders."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, Union

from ddagr_gym.api.nominal import RobotLike
from ddagr_gym.api.tables import is_table, recording_of_table
from ddagr_gym.errors import InputError
from ddagr_gym.files import expanded
from ddagr_gym.parameters import Robot
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits
from ddagr_gym.recordings.schema import Recording, RobotGeometry

if TYPE_CHECKING:
    import pandas
    import pyarrow

    from ddagr_gym.api.simulate import SimulationResult

Source: TypeAlias = Union[
    Recording,
    "SimulationResult",
    "pandas.DataFrame",
    "pyarrow.Table",
    Mapping[str, Any],
    str,
    os.PathLike[str],
]
"""One recording: as it is, a simulated drive, a table or a mapping with the schema's columns, or a path."""

Sources: TypeAlias = Source | Sequence[Source]
"""One recording or several; the path of a folder stands for the recordings in it."""

ENDINGS = (".csv", ".csv.gz", ".parquet", ".mcap", ".bag")
"""Of the files that are taken from a folder; ROS 2 bags, which are folders themselves, are taken too."""


def recordings_from(
    given: Sources,
    robot: RobotLike | None = None,
    column_map: str | os.PathLike[str] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> tuple[Recording, ...]:
    """Recordings of one or several sources.

    Args:
        given: see :data:`Sources`.
        robot: that drove; the recordings' own where it is None.
        column_map: shipped map by name or the path of one's own, for files that are not imported yet.
        limits: on rows and bytes of files.

    Raises:
        InputError: nothing given, a file that cannot be read, a table without time, another robot's recording.
    """
    found: list[Recording] = []
    for item in sources_in(given):
        found.append(_recording(item, f"table {len(found) + 1}", robot, column_map, limits))
    if not found:
        raise InputError("no recording is given: name one or more files, or a folder of them.")
    return tuple(found)


def recording_from(
    given: Source,
    robot: RobotLike | None = None,
    column_map: str | os.PathLike[str] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Recording:
    """The recording of one source; otherwise as :func:`recordings_from`."""
    found = recordings_from(given, robot, column_map, limits)
    if len(found) > 1:
        raise InputError(f"{len(found)} recordings are given: name a single one.")
    return found[0]


def is_folder_of_drives(item: Any) -> bool:
    """Whether this is the path of a folder that is no recording itself (a ROS 2 bag)."""
    path = expanded(item) if isinstance(item, str | os.PathLike) else None
    return path is not None and path.is_dir() and not _is_bag(path)


def _is_bag(path: Path) -> bool:
    """Whether a folder is a ROS 2 bag."""
    return path.is_dir() and ((path / "metadata.yaml").exists() or any(path.glob("*.db3")))


def _is_recording(path: Path) -> bool:
    """Whether something in a folder of drives is one."""
    return _is_bag(path) or (path.is_file() and path.name.endswith(ENDINGS))


def sources_in(given: Sources) -> list[Any]:
    """Sources one by one, with the recordings of a folder in its place.

    Args:
        given: see :data:`Sources`.

    Returns:
        Recordings and tables as they are given; paths with ``~`` written out.

    Raises:
        InputError: a folder without recordings, or a path whose ``~`` names no user.
    """
    several = isinstance(given, Sequence) and not isinstance(given, str)
    items: list[Any] = list(given) if several else [given]  # type: ignore[arg-type]
    found: list[Any] = []
    for item in items:
        path = expanded(item) if isinstance(item, str | os.PathLike) else None
        if path is None or not is_folder_of_drives(path):
            found.append(item if path is None else path)
            continue
        inside = sorted(filter(_is_recording, path.iterdir()))
        if not inside:
            kinds = f"{', '.join(ENDINGS)}, or the folder of a ROS 2 bag"
            raise InputError(f"the folder {path} holds no recording ({kinds}): name another one.")
        found += inside
    return found


def _recording(
    item: Any, name: str, robot: RobotLike | None, column_map: str | os.PathLike[str] | None, limits: Limits
) -> Recording:
    from ddagr_gym.recordings.load import load_recording, with_robot

    label, geometry_of = _robot(robot)
    if isinstance(item, str | os.PathLike):
        path, given = Path(item), None if column_map is None else str(column_map)
        return _named_as(load_recording(path, given, label, limits, geometry_of), path)
    if not isinstance(item, Recording):
        item = item.recording if _is_simulated(item) else _from_table(item, name)
    return item if label is None else with_robot(item, label, geometry_of)


def _named_as(recording: Recording, path: Path) -> Recording:
    """Recording by the name of its file: many are imported from logs of one name."""
    meta = recording.meta
    if path.name == meta.source:
        return recording
    return recording.with_meta(source=path.name, notes=(*meta.notes, f"imported from {meta.source}."))


def _is_simulated(item: Any) -> bool:
    from ddagr_gym.api.simulate import SimulationResult

    return isinstance(item, SimulationResult)


def _from_table(item: Any, name: str) -> Recording:
    if not is_table(item):
        raise InputError(
            f"a recording is given as {type(item).__name__}: give a path, a Recording, a pandas.DataFrame, a "
            "pyarrow.Table or a mapping of columns."
        )
    return recording_of_table(item, name)


def _robot(robot: RobotLike | None) -> tuple[str | None, Any]:
    """Robot's name as readers take it, and where its geometry comes from."""
    from ddagr_gym.recordings.load import preset_geometry

    if isinstance(robot, Robot):
        return robot.name, lambda name: RobotGeometry.of(robot)
    return (None if robot is None or str(robot) == "" else str(robot)), preset_geometry
