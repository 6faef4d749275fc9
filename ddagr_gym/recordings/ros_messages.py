"""What is taken from ROS messages: schema channels, for rosbags' objects and for parsed JSON alike.

Frames are REP 103's, which ROS messages follow: x forward, y left, z up.
"""

from __future__ import annotations

import fnmatch
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.frames import FrameTree, frame_name, turned_into
from ddagr_gym.recordings.message_fields import as_number, field_of, is_unknown, number
from ddagr_gym.recordings.schema import FloatArray, RobotGeometry, bank_speeds
from ddagr_gym.recordings.topic_map import TRANSFORMS, TopicSource

Sample = dict[str, float]
Extractor = Callable[[Any], Sample | None]
"""Channels of a message; None where a message brings no sample."""
Rotations = Callable[[Any], FloatArray]
"""From a message to the rotation (3, 3) of its frame into the robot's."""

EARTH_RADIUS = 6378137.0
"""WGS 84 equatorial radius [m]."""
EARTH_ECCENTRICITY_SQUARED = 6.69437999014e-3
"""WGS 84 first eccentricity squared [-]."""
MOST_NAMED = 20
"""Joints that a message to the user names (ours)."""
MOST_JOINTS = 200
"""Joints of one topic beyond which further names are not joints of a robot (ours)."""
_LISTS = (list, tuple, np.ndarray)


def imu(source: TopicSource, rotations: Rotations | None = None) -> Extractor:
    """sensor_msgs/Imu: specific force, yaw rate, and roll and pitch where the map asks for them.

    Args:
        source: entry of the topic map.
        rotations: turns the readings into the robot's frame; None leaves them as they are.
    """

    def extract(message: Any) -> Sample:
        force, turn = _vector(message, "linear_acceleration"), _vector(message, "angular_velocity")
        rotation = None if rotations is None else rotations(message)
        if rotation is not None:
            force, turn = (rotation @ force).tolist(), (rotation @ turn).tolist()
        sample = {f"specific_force_{axis}": value for axis, value in zip("xyz", force, strict=True)}
        sample["yaw_rate"] = turn[2]
        if source.orientation:
            known = not is_unknown(message, "orientation")
            found = attitude(message, "orientation", rotation) if known else (math.nan, math.nan, math.nan)
            sample["roll"], sample["pitch"], _ = found
        return sample

    return extract


def _vector(message: Any, field: str) -> list[float]:
    """Reading (3,) of an Imu message; NaN where it has none."""
    if is_unknown(message, field):
        return [math.nan] * 3
    return [number(message, f"{field}.{axis}") for axis in "xyz"]


class BankSpeeds:
    """Takes the mean speed of the joints whose names match each bank's patterns out of a sensor_msgs/JointState.

    Several nodes may publish on one topic, each its own joints: a message without joints of both banks is no sample.

    Args:
        source: entry of the topic map.
    """

    def __init__(self, source: TopicSource) -> None:
        self._patterns = {"right": source.right, "left": source.left}
        self._messages = 0
        self._seen: dict[str, None] = {}

    def __call__(self, message: Any) -> Sample | None:
        """Channels of a message; None where it lacks a bank."""
        speeds = joint_velocities(message)
        banks = {bank: [v for name, v in speeds if _matches(name, p)] for bank, p in self._patterns.items()}
        if all(banks.values()):
            return {f"encoder_{bank}": _mean(found) for bank, found in banks.items()}
        self._messages += 1
        if len(self._seen) < MOST_NAMED:
            self._seen.update(dict.fromkeys(name for name, _ in speeds))
        return None

    def complaint(self) -> str:
        """Why none of the messages so far is a sample; "" without messages."""
        if not self._messages:
            return ""
        names = list(self._seen)
        if not names:
            return f"none of {self._messages} messages has a speed for each of its joints: record the wheels' velocity."
        for bank, patterns in self._patterns.items():
            if not any(_matches(name, patterns) for name in names):
                return (
                    f"no joint of {', '.join(names[:MOST_NAMED])} matches the {bank} bank's patterns "
                    f"{', '.join(patterns)}: give patterns under topics, wheels, {bank}."
                )
        return (
            f"none of {self._messages} messages has joints of both banks ({', '.join(names[:MOST_NAMED])}): publish "
            "right and left wheels in one JointState."
        )


def joint_speeds() -> Extractor:
    """sensor_msgs/JointState: the speed of each joint by its name; no sample where a message has none."""
    known: set[str] = set()

    def extract(message: Any) -> Sample | None:
        speeds = dict(joint_velocities(message))
        known.update([name for name in speeds if name not in known][: MOST_JOINTS - len(known)])
        return {name: speed for name, speed in speeds.items() if name in known} or None

    return extract


def joint_velocities(message: Any) -> list[tuple[str, float]]:
    """Names and speeds [rad/s] of a JointState's joints, NaN where unknown; none where it has not one for each."""
    names, speeds = field_of(message, "name"), field_of(message, "velocity")
    lists = isinstance(names, _LISTS) and isinstance(speeds, _LISTS)
    if not lists or len(names) != len(speeds):
        return []
    return [(str(name), as_number(speed)) for name, speed in zip(names, speeds, strict=True)]


def _matches(joint: str, patterns: tuple[str, ...]) -> bool:
    return any(fnmatch.fnmatchcase(joint.lower(), pattern.lower()) for pattern in patterns)


def _mean(speeds: Sequence[float]) -> float:
    """Mean; NaN where it is no number (infinities of both signs)."""
    try:
        return math.fsum(speeds) / len(speeds)
    except (ValueError, OverflowError):
        return math.nan


def twist(prefix: str, geometry: RobotGeometry) -> Extractor:
    """geometry_msgs/Twist or TwistStamped: body-speed commands as bank speeds."""

    def extract(message: Any) -> Sample:
        right, left = bank_speeds(number(message, f"{prefix}linear.x"), number(message, f"{prefix}angular.z"), geometry)
        return {"command_right": float(right), "command_left": float(left)}

    return extract


def pose(prefix: str) -> Extractor:
    """nav_msgs/Odometry (``pose.pose``) or geometry_msgs/PoseStamped (``pose``): position and attitude."""

    def extract(message: Any) -> Sample:
        sample = {f"pose_{axis}": number(message, f"{prefix}.position.{axis}") for axis in "xy"}
        sample["roll"], sample["pitch"], sample["pose_yaw"] = attitude(message, f"{prefix}.orientation")
        return sample

    return extract


def nav_sat_fix() -> Extractor:
    """sensor_msgs/NavSatFix: metres east (x) and north (y) of the first fix, by WGS 84's radii of curvature there."""
    origin: list[float] = []

    def extract(message: Any) -> Sample:
        latitude, longitude = number(message, "latitude"), number(message, "longitude")
        status = number(message, "status.status")
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


def transform(source: TopicSource, tree: FrameTree) -> Extractor:
    """geometry_msgs/TransformStamped of a tf2 tree: the pose of the frame ``child`` in the frame ``parent``.

    Where several transforms between both change (map to odom by a localisation, odom to base_link by the wheels), a
    sample comes only after an upper one has changed: in between the lower one alone would tell of motion, and wheels
    are what a pose is held against. It carries the stamp of the lowest.

    Args:
        source: entry of the topic map, with ``parent`` and ``child``.
        tree: the transforms that do not change; further ones are put into it.
    """
    renewed = False

    def extract(message: Any) -> Sample | None:
        nonlocal renewed
        changed, frame = tree.add(message), frame_name(field_of(message, "child_frame_id"))
        moving = tree.moving(source.child, source.parent)
        if not moving or frame not in moving:
            return None
        if frame != moving[0]:
            renewed |= changed
            return None
        if len(moving) > 1 and not renewed:
            return None
        matrix = tree.between(source.child, source.parent)
        if matrix is None or not np.isfinite(matrix).all():
            return None
        renewed = False
        return _pose_of_matrix(matrix)

    return extract


def _pose_of_matrix(matrix: FloatArray) -> Sample:
    roll, pitch, yaw = angles(*Rotation.from_matrix(matrix[:3, :3]).as_quat())
    return {"pose_x": float(matrix[0, 3]), "pose_y": float(matrix[1, 3]), "roll": roll, "pitch": pitch, "pose_yaw": yaw}


def attitude(message: Any, path: str, mounting: FloatArray | None = None) -> tuple[float, float, float]:
    """Roll, pitch, yaw [rad] of the quaternion at a dotted path; NaN where it is not one or the mounting is not known.

    Args:
        message: any.
        path: of the quaternion, which turns the sensor's axes into the world's.
        mounting: rotation (3, 3) of the sensor's axes into the robot's; None where they are the same.
    """
    if mounting is not None and not np.isfinite(mounting).all():
        return math.nan, math.nan, math.nan
    quaternion = [number(message, f"{path}.{name}") for name in "xyzw"]
    if mounting is None or not 0.5 < math.hypot(*quaternion) < 2.0:
        return angles(*quaternion)
    return angles(*(Rotation.from_quat(quaternion) * Rotation.from_matrix(mounting.T)).as_quat())


def angles(x: float, y: float, z: float, w: float) -> tuple[float, float, float]:
    """Roll, pitch, yaw [rad] of a quaternion; NaN where it is not one (all zero means "not known" in ROS)."""
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if not 0.5 < norm < 2.0:
        return math.nan, math.nan, math.nan
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return roll, pitch, yaw


def extractor(
    message_type: str,
    source: TopicSource,
    geometry: RobotGeometry | None,
    file_name: str,
    tree: FrameTree | None = None,
) -> Extractor:
    """Function that takes the channels out of one message.

    Args:
        message_type: type's name without its package.
        source: entry of the topic map.
        geometry: robot's; needed for Twist.
        file_name: for the message.
        tree: transforms of the bag that do not change, for what ``source`` says of frames.

    Raises:
        InputError: a Twist without the robot's geometry, or transforms without names of frames.
    """
    if message_type in ("Twist", "TwistStamped"):
        if geometry is None:
            raise InputError(
                f"{file_name} holds body-speed commands: name the robot (--robot) whose wheel radius and track turn "
                "them into bank speeds."
            )
        return twist("twist." if message_type == "TwistStamped" else "", geometry)
    frames = FrameTree() if tree is None else tree
    if message_type == TRANSFORMS and not (source.parent and source.child):
        raise InputError(
            f"{file_name}: the topic {source.topic} holds transforms: name the frames under topics, pose, as parent "
            "(map) and child (base_link)."
        )
    makers: dict[str, Callable[[], Extractor]] = {
        "Imu": lambda: imu(source, turned_into(source.frame, frames, file_name) if source.frame else None),
        "JointState": lambda: BankSpeeds(source),
        "Odometry": lambda: pose("pose.pose"),
        "PoseWithCovarianceStamped": lambda: pose("pose.pose"),
        "PoseStamped": lambda: pose("pose"),
        "NavSatFix": nav_sat_fix,
        TRANSFORMS: lambda: transform(source, frames),
    }
    return makers[message_type]()
