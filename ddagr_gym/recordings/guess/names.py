"""What names of topics and joints say, by the habits of ROS (ours)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from ddagr_gym.recordings.topic_map import ROLE_TYPES, Topic

LEFT, RIGHT = "left", "right"
_COMMAND = ("cmd", "command", "setpoint", "reference", "desired", "target")
_MEASURED = ("odom", "measured", "feedback", "actual", "filtered", "estimate", "state", "current", "velocity_body")
_ASIDE = ("joy", "teleop", "nav", "input", "raw", "unstamped", "key", "mux", "web", "safe", "smooth")
_INSIDE = ("camera", "realsense", "zed", "ouster", "velodyne", "lidar", "livox", "gps", "gnss", "phone")
_WHEEL = ("wheel", "track", "sprocket", "motor")
_NO_WHEEL = ("caster", "castor", "steer", "arm", "gripper", "pan", "tilt", "mast")


def side_of(joint: str) -> str:
    """Side that a joint's name tells: "left", "right", or "" where it does not."""
    lowered = joint.lower()
    if (LEFT in lowered) != (RIGHT in lowered):
        return LEFT if LEFT in lowered else RIGHT
    letters = {_letter_side(token) for token in re.split(r"[^a-z]+", lowered)} - {""}
    return letters.pop() if len(letters) == 1 else ""


def _letter_side(token: str) -> str:
    """Side of l, r, and of both letters of fl, rl, bl, lf, lr, fr, rr and so on: the other letter is a place."""
    if len(token) > 2 or not set(token) <= set("lrfbm"):
        return ""
    if "l" in token:
        return LEFT
    return RIGHT if token in ("r", "fr", "rf", "br", "rb", "mr", "rm", "rr") else ""


def wheel_joints(joints: Sequence[str]) -> tuple[str, ...]:
    """Joints that may be driven wheels: those that are called so, else all that are not called something else."""
    left = [joint for joint in joints if not _has(joint, _NO_WHEEL)]
    called = [joint for joint in left if any(word in joint.lower() for word in _WHEEL)]
    return tuple(called if len(called) >= 2 else left)


def command_rank(topic: str) -> int:
    """How much a Twist's name speaks for what the robot was commanded: 2 a command, 1 open, 0 a source before it.

    A joystick's or navigation's command goes through a multiplexer, which may pass on another one.
    """
    if _has(topic, _ASIDE):
        return 0
    return 2 if _has(topic, _COMMAND) else 1


def is_measured(topic: str) -> bool:
    """Whether a Twist's name says that it was measured rather than commanded."""
    return _has(topic, _MEASURED) and not _has(topic, _COMMAND)


def is_inside_sensor(topic: str) -> bool:
    """Whether an IMU's name says that it sits in a camera, lidar or receiver."""
    return _has(topic, _INSIDE)


def _has(name: str, words: Iterable[str]) -> bool:
    lowered = name.lower()
    return any(re.search(rf"(?<![a-z]){word}", lowered) for word in words)


def namespaces(topics: Sequence[Topic]) -> tuple[str, ...]:
    """Namespaces of several robots in one bag: first parts of names behind which two roles or more repeat.

    Two IMUs in /front and /rear are no two robots; /a/imu, /a/joint_states beside /b/imu, /b/joint_states are.
    """
    seen: dict[str, set[tuple[str, str]]] = {}
    for topic in topics:
        first, _, rest = topic.name.lstrip("/").partition("/")
        for role, kinds in ROLE_TYPES.items():
            if rest and topic.count and topic.message_type in kinds and not topic.name.endswith(("tf", "tf_static")):
                seen.setdefault(first, set()).add((role, rest))
    twins = {
        name
        for name, roles in seen.items()
        for other, theirs in seen.items()
        if name != other and len({role for role, _ in roles & theirs}) >= 2
    }
    return tuple(sorted(twins))


def in_namespace(topic: Topic, namespace: str) -> bool:
    """Whether a topic belongs to a robot: below its namespace, or a tree of frames that all share."""
    return topic.name.startswith(f"/{namespace.strip('/')}/") or topic.name in ("/tf", "/tf_static")
