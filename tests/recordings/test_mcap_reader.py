from __future__ import annotations

import json
import time
from dataclasses import replace

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.files import Limits
from ddagr_gym.recordings.load import load_recording
from ddagr_gym.recordings.mcap_reader import read_mcap
from ddagr_gym.recordings.topic_map import load_topic_map
from tests.recordings.bags import quaternion

DEFAULT = "topics_default"


def body(message):
    v = message.values
    header = {"stamp": {"sec": int(message.stamp), "nanosec": round((message.stamp % 1) * 1e9)}, "frame_id": "b"}
    if message.kind.endswith("Imu"):
        return {
            "header": header,
            "linear_acceleration": {"x": v["ax"], "y": 0.0, "z": v["az"]},
            "angular_velocity": {"x": 0.0, "y": 0.0, "z": v["gz"]},
        }
    if message.kind.endswith("JointState"):
        names = v.get("names", ["right", "left"])
        return {"header": header, "name": names, "velocity": [v.get(name) for name in names]}
    if message.kind.endswith("Odometry"):
        orientation = quaternion(v["yaw"], v.get("roll", 0.0))
        return {
            "header": header,
            "pose": {"pose": {"position": {"x": v["x"], "y": v["y"]}, "orientation": orientation}},
        }
    return {"linear": {"x": v["v"]}, "angular": {"z": v["w"]}}


def write_json(path, messages, compression=CompressionType.NONE, encoding="json", finish=True, **options):
    with open(path, "wb") as stream:
        writer = Writer(stream, compression=compression, chunk_size=8192, **options)
        writer.start()
        channels = {}
        for m in messages:
            if m.topic not in channels:
                name = m.kind.replace("/msg/", ".")
                schema = writer.register_schema(name=name, encoding="jsonschema", data=b"{}")
                channels[m.topic] = writer.register_channel(topic=m.topic, message_encoding=encoding, schema_id=schema)
            at = round(m.receive * 1e9)
            writer.add_message(
                channel_id=channels[m.topic], log_time=at, publish_time=at, data=json.dumps(body(m)).encode()
            )
        if finish:
            writer.finish()
    return path


@pytest.mark.parametrize("compression", list(CompressionType))
def test_json_messages_are_read(tmp_path, messages, warthog, compression):
    path = write_json(tmp_path / "run.mcap", messages, compression)
    recording = load_recording(path, robot="warthog", geometry_of=lambda _: warthog)
    t = recording.t
    np.testing.assert_allclose(t, np.arange(200) * 0.02, atol=1e-6)
    np.testing.assert_allclose(recording["yaw_rate"], 0.2 + t, atol=1e-6)
    rows = np.flatnonzero(np.isfinite(recording["encoder_right"]))
    np.testing.assert_allclose(recording["encoder_right"][rows], 1.0 + t[rows], atol=1e-6)
    rows = np.flatnonzero(np.isfinite(recording["pose_yaw"]))
    np.testing.assert_allclose(recording["pose_yaw"][rows], 0.1 * t[rows], atol=1e-6)
    assert recording.command_valid.all()


def test_files_without_chunks_or_summary_are_read(tmp_path, messages, warthog):
    path = write_json(tmp_path / "run.mcap", messages, use_chunking=False)
    assert len(read_mcap(path, load_topic_map(DEFAULT), warthog)) == 200


def test_messages_out_of_order_are_sorted_by_their_stamps(tmp_path, messages, warthog):
    shuffled = [messages[i] for i in np.random.default_rng(0).permutation(len(messages))]
    recording = read_mcap(write_json(tmp_path / "run.mcap", shuffled), load_topic_map(DEFAULT), warthog)
    np.testing.assert_allclose(recording["yaw_rate"], 0.2 + recording.t, atol=1e-6)


def test_a_missing_topic_lists_what_is_there(tmp_path, messages, warthog):
    path = write_json(tmp_path / "run.mcap", [m for m in messages if m.topic != "/imu/data"])
    with pytest.raises(InputError, match=r"Imu for imu; it holds /cmd_vel \(Twist, 80\)"):
        read_mcap(path, load_topic_map(DEFAULT), warthog)


def test_other_encodings_say_what_to_convert_to(tmp_path, messages, warthog):
    path = write_json(tmp_path / "run.mcap", messages, encoding="protobuf")
    with pytest.raises(InputError, match="protobuf"):
        read_mcap(path, load_topic_map(DEFAULT), warthog)


def test_messages_that_do_not_decode_name_their_topic(tmp_path, messages, warthog):
    path = write_json(tmp_path / "run.mcap", messages)
    path.write_bytes(path.read_bytes().replace(b'"angular_velocity"', b'"angular_velocity ', 1))
    with pytest.raises(InputError, match="/imu/data"):
        read_mcap(path, load_topic_map(DEFAULT), warthog)


def test_half_stamped_streams_are_refused(tmp_path, messages, warthog):
    mixed = [replace(m, stamp=0.0) if m.topic == "/imu/data" and i % 2 else m for i, m in enumerate(messages)]
    with pytest.raises(InputError, match="stamps: receive"):
        read_mcap(write_json(tmp_path / "run.mcap", mixed), load_topic_map(DEFAULT), warthog)


@pytest.mark.parametrize("compression", [CompressionType.ZSTD, CompressionType.LZ4])
def test_a_chunk_that_unpacks_to_much_stops_at_the_limit(tmp_path, messages, warthog, compression):
    path = tmp_path / "bomb.mcap"
    with open(path, "wb") as stream:
        writer = Writer(stream, compression=compression, chunk_size=2**30)
        writer.start()
        schema = writer.register_schema(name="sensor_msgs/msg/Imu", encoding="jsonschema", data=b"{}")
        channel = writer.register_channel(topic="/imu", message_encoding="json", schema_id=schema)
        writer.add_message(channel_id=channel, log_time=0, publish_time=0, data=b" " * 50_000_000)
        writer.finish()
    assert path.stat().st_size < 1_000_000
    with pytest.raises(InputError, match="--maximum-bytes"):
        read_mcap(path, load_topic_map(DEFAULT), warthog, Limits(bytes=10_000_000))


def test_a_file_cut_off_while_recording_is_refused(tmp_path, messages, warthog):
    path = write_json(tmp_path / "run.mcap", messages)
    path.write_bytes(path.read_bytes()[:-2000])
    with pytest.raises(InputError, match="mcap recover"):
        read_mcap(path, load_topic_map(DEFAULT), warthog)


@pytest.mark.parametrize("compression", list(CompressionType))
def test_fuzzed_and_truncated_files_never_end_in_another_error(tmp_path, messages, warthog, compression):
    path = write_json(tmp_path / "run.mcap", messages[:60], compression)
    source = path.read_bytes()
    rng = np.random.default_rng(4)
    refused = 0
    for _ in range(80):
        data = bytearray(source)
        for place in rng.integers(8, len(data), rng.integers(1, 20)):
            data[place] = rng.integers(0, 256)
        path.write_bytes(bytes(data[: len(data) if rng.random() < 0.6 else rng.integers(8, len(data))]))
        try:
            read_mcap(path, load_topic_map(DEFAULT), warthog)
        except InputError as error:
            refused += 1
            assert "\n" not in str(error)  # noqa: PT017
    assert refused > 40


def test_a_small_file_that_unpacks_to_gigabytes_is_refused_at_once(tmp_path, warthog):
    path = tmp_path / "bomb.mcap"
    with open(path, "wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD, chunk_size=2**24)
        writer.start()
        schema = writer.register_schema(name="Imu", encoding="jsonschema", data=b"{}")
        channel = writer.register_channel(topic="/imu", message_encoding="json", schema_id=schema)
        for k in range(12):
            writer.add_message(channel, log_time=k, publish_time=k, data=bytes(2**23))
        writer.finish()
    assert path.stat().st_size < 2**18
    began = time.process_time()
    with pytest.raises(InputError, match="more than 200 times its size"):
        read_mcap(path, load_topic_map("topics_default"), warthog)
    assert time.process_time() - began < 10.0


def test_simulated_stamps_and_commands_without_a_header_are_refused(tmp_path, messages, warthog):
    simulated = [replace(m, stamp=m.stamp - 1_699_999_990.0) for m in messages]
    path = write_json(tmp_path / "run.mcap", simulated)
    with pytest.raises(InputError, match=r"/cmd_vel: none of its 80 messages is near a row.*stamps: receive") as caught:
        read_mcap(path, load_topic_map(DEFAULT), warthog)
    assert "\n" not in str(caught.value)
    by_receipt = replace(load_topic_map(DEFAULT), stamps="receive")
    recording = read_mcap(path, by_receipt, warthog)
    assert recording.has("command_right")
    assert recording.command_valid.all()


def test_commands_without_values_are_not_valid(tmp_path, messages, warthog):
    null = [replace(m, values={"v": None, "w": None}) if m.topic == "/cmd_vel" else m for m in messages]
    assert not read_mcap(write_json(tmp_path / "run.mcap", null), load_topic_map(DEFAULT), warthog).command_valid.any()


def joints(messages, others):
    """Messages with other ones on the topic of the joints, 1 ms before each of its own, the first one included."""
    wheels = [m for m in messages if m.topic == "/joint_states"]
    arms = [replace(m, stamp=m.stamp - 1e-3, receive=m.receive - 1e-3, values=others) for m in wheels]
    return sorted([*messages, *arms], key=lambda m: m.receive)


@pytest.mark.parametrize("names", [["arm_1", "arm_2"], []])
def test_joints_of_other_nodes_on_the_topic_of_the_wheels_do_no_harm(tmp_path, messages, warthog, names):
    path = write_json(tmp_path / "run.mcap", joints(messages, {"names": names, "arm_1": 0.0, "arm_2": 0.1}))
    recording = read_mcap(path, load_topic_map(DEFAULT), warthog)
    rows = np.flatnonzero(np.isfinite(recording["encoder_right"]))
    np.testing.assert_array_equal(rows, np.arange(0, 200, 5))
    np.testing.assert_allclose(recording["encoder_left"][rows], 2.0 + recording.t[rows], atol=1e-6)


def test_a_topic_with_no_wheels_at_all_is_refused(tmp_path, messages, warthog):
    arms = {"names": ["arm_1"], "arm_1": 0.0}
    only = [replace(m, values=arms) if m.topic == "/joint_states" else m for m in messages]
    with pytest.raises(InputError, match=r"run\.mcap, /joint_states: no joint of arm_1 matches the right bank's"):
        read_mcap(write_json(tmp_path / "run.mcap", only), load_topic_map(DEFAULT), warthog)


def test_a_speed_that_is_null_is_not_known(tmp_path, messages, warthog):
    third = [m for m in messages if m.topic == "/joint_states"][2]
    null = [replace(m, values={"right": None, "left": 1.0}) if m is third else m for m in messages]
    recording = read_mcap(write_json(tmp_path / "run.mcap", null), load_topic_map(DEFAULT), warthog)
    assert np.count_nonzero(np.isfinite(recording["encoder_right"])) == 39
    assert np.count_nonzero(np.isfinite(recording["encoder_left"])) == 40


def test_a_planar_pose_measures_neither_roll_nor_pitch(tmp_path, messages, warthog):
    recording = read_mcap(write_json(tmp_path / "run.mcap", messages), load_topic_map(DEFAULT), warthog)
    assert recording.has("pose_yaw")
    assert not {"roll", "pitch"} & set(recording.channels)
    rolled = [replace(m, values={**m.values, "roll": 0.01}) if m.topic == "/odom" else m for m in messages]
    recording = read_mcap(write_json(tmp_path / "rolled.mcap", rolled), load_topic_map(DEFAULT), warthog)
    assert recording["roll"][0] == pytest.approx(0.01)
    assert recording.has("roll", "pitch")


@pytest.mark.parametrize(("both", "remedy"), [(False, "set stamps: receive"), (True, r"anew: cut the bag there\.$")])
def test_a_clock_that_is_set_back_in_mid_drive_is_refused(tmp_path, messages, warthog, both, remedy):
    half = messages[0].stamp + 2.0

    def moved(m):
        back = 1.5 if m.stamp >= half else 0.0
        return replace(m, stamp=m.stamp - back, receive=m.receive - both * back)

    path = write_json(tmp_path / "run.mcap", map(moved, messages))
    with pytest.raises(InputError, match=rf"/imu/data: its .*back by 1\.48 s, 1\.98 s after.*{remedy}") as caught:
        read_mcap(path, load_topic_map(DEFAULT), warthog)
    assert "\n" not in str(caught.value)
    if not both:
        recording = read_mcap(path, replace(load_topic_map(DEFAULT), stamps="receive"), warthog)
        np.testing.assert_allclose(recording["yaw_rate"], 0.2 + recording.t, atol=1e-6)
