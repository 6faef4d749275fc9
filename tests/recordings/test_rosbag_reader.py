from __future__ import annotations

import math

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.files import Limits
from ddagr_gym.recordings.load import load_recording
from ddagr_gym.recordings.rosbag_reader import read_rosbag
from ddagr_gym.recordings.topic_map import load_topic_map

DEFAULT = "topics_default"


class Ros:
    """Builds ROS messages of one version from the plain messages of conftest."""

    def __init__(self, version):
        self.version = version
        self.store = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.ROS2_HUMBLE)

    def make(self, kind, **fields):
        return self.store.types[kind](**fields)

    def header(self, stamp):
        seconds = math.floor(stamp)
        nanoseconds = min(round((stamp - seconds) * 1e9), 999_999_999)
        time = self.make("builtin_interfaces/msg/Time", sec=int(seconds), nanosec=nanoseconds)
        extra = {"seq": 0} if self.version == 1 else {}
        return self.make("std_msgs/msg/Header", stamp=time, frame_id="base", **extra)

    def vector(self, x=0.0, y=0.0, z=0.0, kind="Vector3"):
        return self.make(f"geometry_msgs/msg/{kind}", x=float(x), y=float(y), z=float(z))

    def quaternion(self, yaw=0.0):
        return self.make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=math.sin(yaw / 2), w=math.cos(yaw / 2))

    def twist(self, v=0.0, w=0.0):
        return self.make("geometry_msgs/msg/Twist", linear=self.vector(v), angular=self.vector(z=w))

    def pose(self, x, y, yaw):
        return self.make(
            "geometry_msgs/msg/Pose", position=self.vector(x, y, kind="Point"), orientation=self.quaternion(yaw)
        )

    def build(self, message):
        v, header = message.values, self.header(message.stamp)
        nine, many = np.zeros(9), np.zeros(36)
        if message.kind.endswith("Imu"):
            return self.make(
                message.kind,
                header=header,
                orientation=self.quaternion(),
                orientation_covariance=nine,
                angular_velocity=self.vector(z=v["gz"]),
                angular_velocity_covariance=nine,
                linear_acceleration=self.vector(x=v["ax"], z=v["az"]),
                linear_acceleration_covariance=nine,
            )
        if message.kind.endswith("JointState"):
            speeds = np.array([v["left"], v["right"], v["left"] + 2, v["right"] + 2])
            names = [f"{end}_{side}_wheel" for end in ("front", "rear") for side in ("left", "right")]
            return self.make(
                message.kind, header=header, name=names, position=np.zeros(4), velocity=speeds, effort=np.zeros(4)
            )
        if message.kind.endswith("Odometry"):
            pose = self.make(
                "geometry_msgs/msg/PoseWithCovariance", pose=self.pose(v["x"], v["y"], v["yaw"]), covariance=many
            )
            twist = self.make("geometry_msgs/msg/TwistWithCovariance", twist=self.twist(), covariance=many)
            return self.make(message.kind, header=header, child_frame_id="b", pose=pose, twist=twist)
        if message.kind.endswith("PoseStamped"):
            return self.make(message.kind, header=header, pose=self.pose(v["x"], v["y"], v["yaw"]))
        if message.kind.endswith("TwistStamped"):
            return self.make(message.kind, header=header, twist=self.twist(v["v"], v["w"]))
        return self.twist(v["v"], v["w"])


def write_ros1(path, messages, compression=None):
    ros = Ros(1)
    writer = Writer1(path)
    if compression:
        writer.set_compression(compression)
    with writer:
        connections = {}
        for m in messages:
            if m.topic not in connections:
                connections[m.topic] = writer.add_connection(m.topic, m.kind, typestore=ros.store)
            data = ros.store.serialize_ros1(ros.build(m), m.kind)
            writer.write(connections[m.topic], round(m.receive * 1e9), data)
    return path


def write_ros2(path, messages, storage=StoragePlugin.SQLITE3):
    ros = Ros(2)
    with Writer2(path, version=9, storage_plugin=storage) as writer:
        connections = {}
        for m in messages:
            if m.topic not in connections:
                connections[m.topic] = writer.add_connection(m.topic, m.kind, typestore=ros.store)
            writer.write(connections[m.topic], round(m.receive * 1e9), ros.store.serialize_cdr(ros.build(m), m.kind))
    return path


def write(kind, folder, messages):
    if kind == "ros1":
        return write_ros1(folder / "run.bag", messages)
    if kind == "db3":
        return next(write_ros2(folder / "run", messages).glob("*.db3"))
    storage = StoragePlugin.MCAP if kind == "ros2 mcap" else StoragePlugin.SQLITE3
    return write_ros2(folder / "run", messages, storage)


def with_kind(messages, old, new):
    from dataclasses import replace

    return [replace(m, kind=new) if m.kind.endswith(old) else m for m in messages]


@pytest.mark.parametrize("kind", ["ros1", "ros2", "ros2 mcap", "db3"])
def test_what_was_written_is_read(tmp_path, messages, warthog, kind):
    path = write(kind, tmp_path, messages)
    recording = load_recording(path, robot="warthog", geometry_of=lambda _: warthog)
    t = recording.t
    assert len(recording) == 200
    np.testing.assert_allclose(t, np.arange(200) * 0.02, atol=1e-6)
    np.testing.assert_allclose(recording["yaw_rate"], 0.2 + t, atol=1e-6)
    np.testing.assert_allclose(recording["specific_force_x"], 0.1 * t, atol=1e-6)
    rows = np.flatnonzero(np.isfinite(recording["encoder_right"]))
    np.testing.assert_array_equal(rows, np.arange(0, 200, 5))
    # Front and rear wheels differ by 2 rad/s: the bank's speed is their mean.
    np.testing.assert_allclose(recording["encoder_right"][rows], 2.0 + t[rows], atol=1e-6)
    np.testing.assert_allclose(recording["encoder_left"][rows], 3.0 + t[rows], atol=1e-6)
    rows = np.flatnonzero(np.isfinite(recording["pose_x"]))
    np.testing.assert_array_equal(rows, np.arange(0, 200, 10))
    np.testing.assert_allclose(recording["pose_y"][rows], -t[rows], atol=1e-6)
    np.testing.assert_allclose(recording["pose_yaw"][rows], 0.1 * t[rows], atol=1e-6)
    command = recording["command_right"][np.isfinite(recording["command_right"])]
    np.testing.assert_allclose(command, (0.6 + 0.5 * 0.54) / 0.3)
    assert recording.meta.source == path.name
    assert len(recording.meta.source_sha256) == 64
    assert recording.validate() == ()


def test_header_stamps_count_and_twists_without_one_stand_at_their_receipt(tmp_path, messages, warthog):
    recording = read_rosbag(write("ros1", tmp_path, messages), load_topic_map(DEFAULT), warthog)
    notes = " ".join(recording.meta.notes)
    assert "imu is /imu/data (Imu) by header stamps" in notes
    assert "command is /cmd_vel (Twist) by times of receipt" in notes
    assert recording.meta.start_time == pytest.approx(1.7e9)
    # Commands every 50 ms, received 50 ms late: the first stands at the row of 0.05 s or its neighbours.
    assert recording.t[np.flatnonzero(np.isfinite(recording["command_right"]))[0]] == pytest.approx(0.05, abs=0.011)


def test_times_of_receipt_on_request(tmp_path, messages, warthog):
    own = tmp_path / "topics.yaml"
    own.write_text("stamps: receive\ntopics: {imu: {}, wheels: {}, command: {}, pose: {}}\n")
    recording = read_rosbag(write("ros1", tmp_path, messages), load_topic_map(str(own)), warthog)
    assert recording.meta.start_time == pytest.approx(1.7e9 + 0.05)


def test_a_regular_grid_and_signs_on_request(tmp_path, messages, warthog):
    own = tmp_path / "topics.yaml"
    own.write_text("rate: 10\nsigns: {yaw_rate: -1}\ntopics: {imu: {}, wheels: {}}\n")
    recording = read_rosbag(write("ros2", tmp_path, messages), load_topic_map(str(own)), warthog)
    assert recording.period == pytest.approx(0.1)
    np.testing.assert_allclose(recording["yaw_rate"], -(0.2 + recording.t), atol=1e-6)
    assert not recording.command_valid.any()
    assert "command_right" not in recording.channels


@pytest.mark.parametrize("compression", [Writer1.CompressionFormat.BZ2, Writer1.CompressionFormat.LZ4])
def test_compressed_ros_1_bags_and_their_limit(tmp_path, messages, warthog, compression):
    path = write_ros1(tmp_path / "run.bag", messages, compression)
    assert len(read_rosbag(path, load_topic_map(DEFAULT), warthog)) == 200
    with pytest.raises(InputError, match="--maximum-bytes"):
        read_rosbag(path, load_topic_map(DEFAULT), warthog, Limits(bytes=1000))


@pytest.mark.parametrize(
    ("old", "new"), [("Odometry", "geometry_msgs/msg/PoseStamped"), ("Twist", "geometry_msgs/msg/TwistStamped")]
)
def test_other_message_types_of_a_role(tmp_path, messages, warthog, old, new):
    path = write("ros2", tmp_path, with_kind(messages, old, new))
    recording = read_rosbag(path, load_topic_map(DEFAULT), warthog)
    assert recording.has("pose_x", "command_right")
    assert new.rsplit("/", 1)[-1] in " ".join(recording.meta.notes)


@pytest.mark.parametrize("kind", ["ros1", "ros2", "ros2 mcap"])
def test_a_missing_topic_lists_what_is_there(tmp_path, messages, warthog, kind):
    path = write(kind, tmp_path, [m for m in messages if m.topic != "/joint_states"])
    with pytest.raises(InputError, match=r"JointState for wheels.*/imu/data \(Imu, 200\).*/odom \(Odometry, 20\)"):
        read_rosbag(path, load_topic_map(DEFAULT), warthog)


def test_several_candidates_must_be_chosen(tmp_path, messages, warthog):
    from dataclasses import replace

    more = messages + [replace(m, topic="/imu/raw") for m in messages if m.topic == "/imu/data"]
    path = write("ros2", tmp_path, sorted(more, key=lambda m: m.receive))
    with pytest.raises(InputError, match=r"several topics of type Imu.*/imu/data.*/imu/raw"):
        read_rosbag(path, load_topic_map(DEFAULT), warthog)
    own = tmp_path / "topics.yaml"
    own.write_text("topics: {imu: {topic: /imu/raw}, wheels: {}}\n")
    assert len(read_rosbag(path, load_topic_map(str(own)), warthog)) == 200


def test_a_named_topic_of_the_wrong_type_is_refused(tmp_path, messages, warthog):
    own = tmp_path / "topics.yaml"
    own.write_text("topics: {imu: {topic: /odom}, wheels: {}}\n")
    with pytest.raises(InputError, match="type Odometry"):
        read_rosbag(write("ros1", tmp_path, messages), load_topic_map(str(own)), warthog)


def test_too_many_messages_are_refused(tmp_path, messages, warthog):
    with pytest.raises(InputError, match="--maximum-rows"):
        read_rosbag(write("ros1", tmp_path, messages), load_topic_map(DEFAULT), warthog, Limits(rows=100))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.replace("- run.db3", "- ../run.db3"), "outside"),
        (lambda text: text.replace("compression_format: ''", "compression_format: lz4", 1), "'lz4'"),
        (lambda text: "a: !!python/object/apply:os.system [true]", "not a ROS 2 bag"),
        (lambda text: "[" * 1200, "not a ROS 2 bag"),
        (lambda text: "", "not a ROS 2 bag"),
        (lambda text: text.replace("version: 9", "version: 99"), "version 99"),
    ],
)
def test_hostile_metadata_gets_one_sentence(tmp_path, messages, warthog, change, words):
    path = write("ros2", tmp_path, messages)
    metadata = path / "metadata.yaml"
    changed = change(metadata.read_text())
    assert changed != metadata.read_text()
    metadata.write_text(changed)
    with pytest.raises(InputError, match=words) as caught:
        read_rosbag(path, load_topic_map(DEFAULT), warthog)
    assert "\n" not in str(caught.value)


def test_a_folder_that_is_no_bag(tmp_path, warthog):
    with pytest.raises(InputError, match=r"metadata\.yaml"):
        read_rosbag(tmp_path, load_topic_map(DEFAULT), warthog)


@pytest.mark.parametrize(("kind", "ending"), [("ros1", ".bag"), ("db3", ".db3")])
def test_a_bag_with_another_ending_says_so(tmp_path, messages, warthog, kind, ending):
    path = write(kind, tmp_path, messages)
    renamed = path.rename(path.with_suffix(".data"))
    with pytest.raises(InputError, match=f"without the ending {ending}"):
        load_recording(renamed, robot="warthog", geometry_of=lambda _: warthog)


@pytest.mark.parametrize("kind", ["ros1", "db3"])
def test_fuzzed_and_truncated_bags_never_end_in_another_error(tmp_path, messages, warthog, kind):
    path = write(kind, tmp_path, messages[:60])
    source = path.read_bytes()
    rng = np.random.default_rng(3)
    refused = 0
    for _ in range(60):
        data = bytearray(source)
        for place in rng.integers(16, len(data), rng.integers(1, 30)):
            data[place] = rng.integers(0, 256)
        path.write_bytes(bytes(data[: len(data) if rng.random() < 0.6 else rng.integers(16, len(data))]))
        try:
            read_rosbag(path, load_topic_map(DEFAULT), warthog)
        except InputError as error:
            refused += 1
            assert "\n" not in str(error)  # noqa: PT017
    assert refused > 15
