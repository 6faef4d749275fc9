"""What is taken from ROS messages: stamps and schema channels, for rosbags' objects and for parsed JSON alike.

Frames are REP 103's, which ROS messages follow: x forward, y left, z up.
"""

from __future__ import annotations

import fnmatch
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.schema import RobotGeometry, bank_speeds
from ddagr_gym.recordings.topic_map import TopicSource

Sample = dict[str, float]
Extractor = Callable[[Any], Sample]

EARTH_RADIUS = 6378137.0
"""WGS 84 equatorial radius [m]."""
EARTH_ECCENTRICITY_SQUARED = 6.69437999014e-3
"""WGS 84 first eccentricity squared [-]."""


def field_of(message: Any, path: str) -> Any:
    """Value at a dotted path of attributes or keys; None where a part is missing."""
    for part in path.split("."):
        message = message.get(part) if isinstance(message, Mapping) else getattr(message, part, None)
        if message is None:
            return None
    return message


def header_stamp(message: Any) -> float | None:
    """Header stamp [s]; None where the message has no header or a stamp of 0 (never filled in)."""
    stamp = field_of(message, "header.stamp")
    if stamp is None:
        return None
    seconds = _first(stamp, "sec", "secs")
    nanoseconds = _first(stamp, "nanosec", "nsec", "nsecs")
    total = seconds + 1e-9 * (nanoseconds if math.isfinite(nanoseconds) else 0.0)
    return total if math.isfinite(total) and total != 0 else None


def _first(message: Any, *names: str) -> float:
    return next((_number(message, name) for name in names if field_of(message, name) is not None), math.nan)


def _number(message: Any, path: str) -> float:
    value = field_of(message, path)
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan


def imu(source: TopicSource) -> Extractor:
    """sensor_msgs/Imu: specific force, yaw rate, and roll and pitch where the map asks for them."""

    def extract(message: Any) -> Sample:
        sample = {f"specific_force_{axis}": _number(message, f"linear_acceleration.{axis}") for axis in "xyz"}
        sample["yaw_rate"] = _number(message, "angular_velocity.z")
        if source.orientation:
            sample["roll"], sample["pitch"], _ = _attitude(message, "orientation")
        return sample

    return extract


def joint_state(source: TopicSource) -> Extractor:
    """sensor_msgs/JointState: mean speed of the joints whose names match each bank's patterns."""

    def extract(message: Any) -> Sample:
        names = [str(name) for name in field_of(message, "name") or ()]
        speeds = field_of(message, "velocity")
        if speeds is None or len(speeds) != len(names):
            raise InputError(
                f"a JointState message has {len(names)} joints and {0 if speeds is None else len(speeds)} speeds: "
                "record the wheel joints' velocity."
            )
        return {
            "encoder_right": _bank_mean("right", names, speeds, source.right),
            "encoder_left": _bank_mean("left", names, speeds, source.left),
        }

    return extract


def _bank_mean(bank: str, names: Sequence[str], speeds: Sequence[float], patterns: tuple[str, ...]) -> float:
    lowered = tuple(pattern.lower() for pattern in patterns)
    matched = [
        float(speed)
        for name, speed in zip(names, speeds, strict=True)
        if any(fnmatch.fnmatchcase(name.lower(), pattern) for pattern in lowered)
    ]
    if not matched:
        raise InputError(
            f"no joint of {', '.join(names[:20]) or 'an empty JointState'} matches the {bank} bank's patterns "
            f"{', '.join(patterns)}: give patterns under topics, wheels, {bank}."
        )
    return math.fsum(matched) / len(matched)


def twist(prefix: str, geometry: RobotGeometry) -> Extractor:
    """geometry_msgs/Twist or TwistStamped: body-speed commands as bank speeds."""

    def extract(message: Any) -> Sample:
        right, left = bank_speeds(
            _number(message, f"{prefix}linear.x"), _number(message, f"{prefix}angular.z"), geometry
        )
        return {"command_right": float(right), "command_left": float(left)}

    return extract


def pose(prefix: str) -> Extractor:
    """nav_msgs/Odometry (``pose.pose``) or geometry_msgs/PoseStamped (``pose``): position and attitude."""

    def extract(message: Any) -> Sample:
        sample = {f"pose_{axis}": _number(message, f"{prefix}.position.{axis}") for axis in "xy"}
        sample["roll"], sample["pitch"], sample["pose_yaw"] = _attitude(message, f"{prefix}.orientation")
        return sample

    return extract


def nav_sat_fix() -> Extractor:
    """sensor_msgs/NavSatFix: metres east (x) and north (y) of the first fix, by WGS 84's radii of curvature there."""
    origin: list[float] = []

    def extract(message: Any) -> Sample:
        latitude, longitude = _number(message, "latitude"), _number(message, "longitude")
        status = _number(message, "status.status")
        if status < 0 or not (abs(latitude) <= 90 and abs(longitude) <= 180):
            return {"pose_x": math.nan, "pose_y": math.nan}
        if not origin:
            origin.extend((latitude, longitude))
        east, north = metres_from(origin[0], origin[1], latitude, longitude)
        return {"pose_x": east, "pose_y": north}

    return extract


def metres_from(latitude_0: float, longitude_0: float, latitude: float, longitude: float) -> tuple[float, float]:
    """East and north [m] of a point from an origin, both in degrees, on the tangent plane (good to some km)."""
    sine = math.sin(math.radians(latitude_0))
    w = 1.0 - EARTH_ECCENTRICITY_SQUARED * sine * sine
    prime_vertical = EARTH_RADIUS / math.sqrt(w)
    meridian = prime_vertical * (1.0 - EARTH_ECCENTRICITY_SQUARED) / w
    turn = (longitude - longitude_0 + 180.0) % 360.0 - 180.0
    east = math.radians(turn) * prime_vertical * math.cos(math.radians(latitude_0))
    return east, math.radians(latitude - latitude_0) * meridian


def _attitude(message: Any, path: str) -> tuple[float, float, float]:
    """Roll, pitch, yaw [rad] of a quaternion; NaN where it is not one (all zero means "not known" in ROS)."""
    x, y, z, w = (_number(message, f"{path}.{name}") for name in "xyzw")
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if not 0.5 < norm < 2.0:
        return math.nan, math.nan, math.nan
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return roll, pitch, yaw


def extractor(message_type: str, source: TopicSource, geometry: RobotGeometry | None, file_name: str) -> Extractor:
    """Function that takes the channels out of one message.

    Args:
        message_type: type's name without its package.
        source: entry of the topic map.
        geometry: robot's; needed for Twist.
        file_name: for the message.

    Raises:
        InputError: a Twist without the robot's geometry.
    """
    if message_type in ("Twist", "TwistStamped"):
        if geometry is None:
            raise InputError(
                f"{file_name} holds body-speed commands: name the robot (--robot) whose wheel radius and track turn "
                "them into bank speeds."
            )
        return twist("twist." if message_type == "TwistStamped" else "", geometry)
    makers: dict[str, Callable[[], Extractor]] = {
        "Imu": lambda: imu(source),
        "JointState": lambda: joint_state(source),
        "Odometry": lambda: pose("pose.pose"),
        "PoseStamped": lambda: pose("pose"),
        "NavSatFix": nav_sat_fix,
    }
    return makers[message_type]()
