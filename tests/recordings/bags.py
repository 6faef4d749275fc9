"""ROS 2 bags for tests, written by rosbags: any message from its values, several files, compression."""

from __future__ import annotations

import itertools
import math
import shutil
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import yaml
from rosbags.interfaces import Nodetype
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

STORE = get_typestore(Stores.ROS2_HUMBLE)
STORE.register(get_types_from_msg("float64 level\n", "my_msgs/msg/Battery"))
START = 1_700_000_000.0
IMU, JOINTS, ODOMETRY = "sensor_msgs/msg/Imu", "sensor_msgs/msg/JointState", "nav_msgs/msg/Odometry"
TWIST, STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
LEVEL = np.eye(3)
TRANSFORMS = "tf2_msgs/msg/TFMessage"


@dataclass(frozen=True)
class Sent:
    """A message: topic, type, time [s] since START, values by field, frame of its header."""

    topic: str
    kind: str
    t: float
    values: dict = field(default_factory=dict)
    frame: str = "base_link"


def stamp(t: float) -> dict:
    nanoseconds = round((START + t) * 1e9)
    return {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}


def build(kind: str, values: dict):
    """Message of a type from nested values; what is not given is zero or empty."""
    return STORE.types[kind](**{name: _value(node, values.get(name)) for name, node in STORE.fielddefs[kind][1]})


def _value(node, given):
    kind, detail = node
    if kind == Nodetype.NAME:
        return build(detail, given or {})
    if kind == Nodetype.BASE:
        return str(given or "") if detail[0] == "string" else (float if "float" in detail[0] else int)(given or 0)
    (inner, what), size = detail
    if inner == Nodetype.NAME:
        return [build(what, item) for item in given or []]
    if what[0] == "string":
        return list(given or [])
    return np.array(np.zeros(size) if given is None else given, dtype=what[0])


def quaternion(yaw: float = 0.0, roll: float = 0.0) -> dict:
    """Roll about x, then yaw about z."""
    cy, sy, cr, sr = math.cos(yaw / 2), math.sin(yaw / 2), math.cos(roll / 2), math.sin(roll / 2)
    return {"x": cy * sr, "y": sy * sr, "z": sy * cr, "w": cy * cr}


def transform(t: float, parent: str, child: str, x=0.0, y=0.0, yaw=0.0, roll=0.0, topic="/tf") -> Sent:
    body = {"translation": {"x": x, "y": y}, "rotation": quaternion(yaw, roll)}
    header = {"stamp": stamp(t), "frame_id": parent}
    return Sent(topic, TRANSFORMS, t, {"transforms": [{"header": header, "child_frame_id": child, "transform": body}]})


def write(path: Path, messages, storage: str = "sqlite3", compression: str = "none") -> Path:
    """Bag in the folder ``path``; compression is none, file or message (zstd)."""
    writer = Writer(path, version=9, storage_plugin=StoragePlugin[storage.upper()])
    writer.set_compression(CompressionMode[compression.upper()], CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for m in sorted(messages, key=lambda m: m.t):
            if m.topic not in connections:
                connections[m.topic] = writer.add_connection(m.topic, m.kind, typestore=STORE)
            has_header = any(name == "header" for name, _ in STORE.fielddefs[m.kind][1])
            header = {"header": {"stamp": stamp(m.t), "frame_id": m.frame}} if has_header else {}
            data = STORE.serialize_cdr(build(m.kind, {**header, **m.values}), m.kind)
            writer.write(connections[m.topic], round((START + m.t) * 1e9), data)
    return path


def split(path: Path, messages, parts: int, storage: str = "sqlite3", compression: str = "none") -> Path:
    """The same messages as a bag of several files, as rosbag2 writes it with a largest size."""
    ordered = sorted(messages, key=lambda m: m.t)
    edges = np.linspace(0, len(ordered), parts + 1).astype(int)
    path.mkdir()
    files, content = [], None
    for k, (a, b) in enumerate(itertools.pairwise(edges)):
        part = write(path.with_name(f"{path.name}-{k}"), ordered[a:b], storage, compression)
        content = yaml.safe_load((part / "metadata.yaml").read_text())
        (name,) = content["rosbag2_bagfile_information"]["relative_file_paths"]
        ending = name.split(".", 1)[1]
        files.append(f"{path.name}_{k}.{ending}")
        (part / name).rename(path / files[-1])
        shutil.rmtree(part)
    content["rosbag2_bagfile_information"]["relative_file_paths"] = files
    (path / "metadata.yaml").write_text(yaml.safe_dump(content))
    return path


@dataclass(frozen=True)
class Drive:
    """A drive's columns as messages; what is None is left out."""

    columns: dict
    radius: float
    half_track: float

    def rows(self, *names):
        known = np.all([np.isfinite(self.columns[name]) for name in names], axis=0)
        return (
            (float(self.columns["t"][k]), [float(self.columns[n][k]) for n in names]) for k in np.flatnonzero(known)
        )

    def imu(self, topic="/imu/data", frame="imu_link", rotation=LEVEL, every=1, scale=1.0):
        """Readings of a sensor whose axes are ``rotation`` (rows: sensor axes in the body)."""
        names = ("specific_force_x", "specific_force_y", "yaw_rate")
        for k, (t, (x, y, w)) in enumerate(self.rows(*names)):
            if k % every == 0:
                force, turn = scale * rotation @ [x, y, 9.81], rotation @ [0.0, 0.0, w]
                vectors = {
                    "linear_acceleration": dict(zip("xyz", force, strict=True)),
                    "angular_velocity": dict(zip("xyz", turn, strict=True)),
                }
                yield Sent(topic, IMU, t, {**vectors, "orientation": quaternion()}, frame)

    def wheels(self, topic="/joint_states", joints=(("left_wheel", "left", 1), ("right_wheel", "right", 1)), every=2):
        """Joints with the bank whose speed each has, and its sign."""
        for k, (t, (right, left)) in enumerate(self.rows("encoder_right", "encoder_left")):
            if k % every == 0:
                speed = {"right": right, "left": left}
                velocity = [sign * speed[bank] if bank in speed else 0.0 for _, bank, sign in joints]
                names = [name for name, _, _ in joints]
                yield Sent(topic, JOINTS, t, {"name": names, "velocity": velocity, "position": velocity}, "")

    def twist(self, topic="/cmd_vel", kind=TWIST, source="command", every=5, late=0.0):
        """Twist of the banks' commands, or of their speeds (source="encoder")."""
        for k, (t, (right, left)) in enumerate(self.rows(f"{source}_right", f"{source}_left")):
            if k % every == 0:
                v, w = self.radius * (right + left) / 2, self.radius * (right - left) / (2 * self.half_track)
                twist = {"linear": {"x": v}, "angular": {"z": w}}
                yield Sent(topic, kind, t + late, {"twist": twist} if kind == STAMPED else twist)

    def odometry(self, topic="/odometry/gps", frame="map"):
        for t, (x, y, yaw) in self.rows("pose_x", "pose_y", "pose_yaw"):
            pose = {"pose": {"position": {"x": x, "y": y}, "orientation": quaternion(yaw)}}
            yield Sent(topic, ODOMETRY, t, {"pose": pose, "child_frame_id": "base_link"}, frame)

    def dead_reckoned(self, every=5):
        """Times and poses x, y, yaw by the wheels alone, as a controller of a differential drive computes them."""
        c = self.columns
        right, left = c["encoder_right"], c["encoder_left"]
        step = np.gradient(c["t"])
        yaw = np.cumsum(step * self.radius * (right - left) / (2 * self.half_track))
        v = self.radius * (right + left) / 2
        x, y = np.cumsum(step * v * np.cos(yaw)), np.cumsum(step * v * np.sin(yaw))
        return list(zip(c["t"][::every], x[::every], y[::every], yaw[::every], strict=True))

    def wheel_odometry(self, topic="/odom"):
        for t, x, y, yaw in self.dead_reckoned():
            pose = {"pose": {"position": {"x": x, "y": y}, "orientation": quaternion(yaw)}}
            yield Sent(topic, ODOMETRY, float(t), {"pose": pose, "child_frame_id": "base_link"}, "odom")

    def messages(self):
        """A usual bag: IMU, wheels, command and a pose in the map."""
        return [*self.imu(), *self.wheels(), *self.twist(), *self.odometry()]
