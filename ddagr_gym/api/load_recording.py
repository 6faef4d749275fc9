"""``ddagr_gym.load_recording``: a file of any kind as a recording."""

from __future__ import annotations

import os

from ddagr_gym.api.inputs import recording_from
from ddagr_gym.api.nominal import RobotLike
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits
from ddagr_gym.recordings.schema import Recording


def load_recording(
    path: str | os.PathLike[str],
    column_map: str | os.PathLike[str] | None = None,
    robot: RobotLike | None = None,
    maximum_rows: int = DEFAULT_LIMITS.rows,
    maximum_bytes: int = DEFAULT_LIMITS.bytes,
) -> Recording:
    """Recording from a file or folder, as ``ddagr import`` reads it.

    Args:
        path: CSV or gzip CSV, Parquet, ROS bag (.bag, .db3, folder of a ROS 2 bag), or MCAP.
        column_map: shipped map by name (schema, drive_steps, drive_continuous, concealed, topics_default), or the path
            of one's own YAML file; a table without one takes the shipped map that fits its columns.
        robot: that drove, for body-speed commands: name, YAML file or object; the map's own when it is None.
        maximum_rows: refuse a recording with more rows or messages.
        maximum_bytes: refuse a recording that unpacks to more bytes.

    Returns:
        The recording in the common schema: SI units, radians, NaN where a channel has no new sample
        (:mod:`ddagr_gym.recordings.schema`).

    Raises:
        InputError: a file that is missing, damaged or too large; a map or a robot that does not fit.

    Examples:
        >>> import ddagr_gym, pathlib
        >>> sample = pathlib.Path(ddagr_gym.__file__).parent / "data" / "replay_demo.parquet"
        >>> recording = ddagr_gym.load_recording(sample)
        >>> recording.meta.robot, len(recording)
        ('ddagr', 6750)
    """
    return recording_from(path, robot, column_map, Limits(maximum_rows, maximum_bytes))
