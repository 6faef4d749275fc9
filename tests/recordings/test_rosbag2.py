"""ROS 2 bags of several files and compressed ones: the same recording as the plain bag."""

from __future__ import annotations

import math

import numpy as np
import pytest
import yaml

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits
from ddagr_gym.recordings.load import load_recording
from tests.recordings.bags import IMU, JOINTS, STAMPED, TWIST, Sent, split, write

ENDINGS = {"sqlite3": "db3", "mcap": "mcap"}


def sent(command=TWIST):
    messages = []
    for k in range(200):
        t = 0.02 * k
        values = {"angular_velocity": {"z": math.sin(t)}, "linear_acceleration": {"x": t, "z": 9.8}}
        messages.append(Sent("/imu/data", IMU, t, values))
        if k % 2 == 0:
            messages.append(Sent("/joints", JOINTS, t, {"name": ["left", "right"], "velocity": [1.0 - t, 1.0 + t]}))
        if k % 5 == 0:
            twist = {"linear": {"x": 0.6}, "angular": {"z": 0.1 * t}}
            messages.append(Sent("/cmd_vel", command, t, {"twist": twist} if command == STAMPED else twist))
        if k % 7 == 0:
            messages.append(Sent("/battery", "my_msgs/msg/Battery", t, {"level": t}))
    return messages


def read(path, warthog, limits=DEFAULT_LIMITS):
    return load_recording(path, robot="warthog", limits=limits, geometry_of=lambda _: warthog)


@pytest.fixture(scope="module")
def plain(tmp_path_factory, warthog):
    return read(write(tmp_path_factory.mktemp("plain") / "run", sent()), warthog)


def assert_same(found, expected):
    np.testing.assert_array_equal(found.t, expected.t)
    assert set(found.channels) == set(expected.channels)
    for name, values in expected.channels.items():
        np.testing.assert_array_equal(found[name], values, err_msg=name)


@pytest.mark.parametrize("compression", ["none", "file", "message"])
@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
@pytest.mark.parametrize("parts", [1, 3])
def test_files_and_compressions_give_the_same_recording(tmp_path, plain, warthog, storage, compression, parts):
    path = split(tmp_path / "run", sent(), parts, storage, compression)
    assert len(list(path.glob("run_*"))) == parts
    found = read(path, warthog)
    assert_same(found, plain)
    assert len(found.meta.source_sha256) == 64
    assert found.meta.source == "run"
    np.testing.assert_allclose(found["yaw_rate"], np.sin(found.t), atol=1e-6)


@pytest.mark.parametrize("compression", ["file", "message"])
@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_a_compressed_file_by_itself(tmp_path, plain, warthog, storage, compression):
    folder = write(tmp_path / "run", sent(), storage, compression)
    (file,) = folder.glob(f"*.{ENDINGS[storage]}*")
    assert (file.suffix == ".zstd") == (compression == "file")
    found = read(file, warthog)
    assert_same(found, plain)
    assert found.meta.source == file.name


def test_a_stamped_twist_stands_at_its_stamp(tmp_path, plain, warthog):
    found = read(write(tmp_path / "run", sent(STAMPED)), warthog)
    assert "by header stamps: 40 messages" in " ".join(n for n in found.meta.notes if n.startswith("command"))
    assert_same(found, plain)


def test_old_metadata_with_the_folder_in_front_of_the_names(tmp_path, plain, warthog):
    path = split(tmp_path / "run", sent(), 2)
    change(path, relative_file_paths=["run/run_0.db3", "run/run_1.db3"])
    assert_same(read(path, warthog), plain)


def change(path, **entries):
    content = yaml.safe_load((path / "metadata.yaml").read_text())
    content["rosbag2_bagfile_information"].update(entries)
    (path / "metadata.yaml").write_text(yaml.safe_dump(content))


@pytest.mark.parametrize(
    ("entries", "words"),
    [
        ({"relative_file_paths": ["run_0.db3", "run_7.db3"]}, "lacks run_7.db3"),
        ({"relative_file_paths": []}, "names no file"),
        ({"relative_file_paths": ["/etc/passwd"]}, "outside its folder"),
        ({"storage_identifier": "rocksdb"}, "'rocksdb'"),
        ({"storage_identifier": "mcap"}, "damaged or truncated"),
        ({"version": None}, "version None"),
    ],
)
def test_what_the_metadata_say_wrong_is_one_sentence(tmp_path, warthog, entries, words):
    path = split(tmp_path / "run", sent(), 2)
    change(path, **entries)
    with pytest.raises(InputError, match=words) as caught:
        read(path, warthog)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_a_truncated_compressed_file_is_refused(tmp_path, warthog, storage):
    path = write(tmp_path / "run", sent(), storage, "file")
    (file,) = path.glob("*.zstd")
    file.write_bytes(file.read_bytes()[:-2000])
    with pytest.raises(InputError, match="damaged"):
        read(path, warthog)


def test_files_that_unpack_to_too_much_stop_at_the_limit(tmp_path, warthog):
    path = write(tmp_path / "run", sent(), "sqlite3", "file")
    with pytest.raises(InputError, match="--maximum-bytes"):
        read(path, warthog, Limits(bytes=10_000))


def test_messages_that_unpack_to_too_much_stop_at_the_limit(tmp_path, warthog):
    long = Sent("/joints", JOINTS, 0.0, {"name": ["left"] * 100_000, "velocity": [0.0] * 100_000})
    path = write(tmp_path / "run", [long, *sent()], "sqlite3", "message")
    with pytest.raises(InputError, match="--maximum-bytes"):
        read(path, warthog, Limits(bytes=200_000))


def test_compressed_files_that_are_no_bags(tmp_path, warthog):
    import zstandard

    path = tmp_path / "drive.csv.zst"
    path.write_bytes(zstandard.ZstdCompressor().compress(b"t,a\n1,2\n"))
    with pytest.raises(InputError, match="compressed with zstd and holds no bag"):
        read(path, warthog)


def test_nothing_is_left_of_unpacked_files(tmp_path, plain, warthog, monkeypatch):
    import tempfile

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "space"))
    (tmp_path / "space").mkdir()
    assert_same(read(write(tmp_path / "run", sent(), "mcap", "file"), warthog), plain)
    assert list((tmp_path / "space").iterdir()) == []
