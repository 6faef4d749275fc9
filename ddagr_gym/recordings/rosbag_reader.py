"""ROS 1 bags (.bag) and ROS 2 bags (folder or .db3) through the ``rosbags`` library, without ROS."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits, damaged, kind_of, open_source, sha256_of
from ddagr_gym.recordings.mcap_reader import read_mcap
from ddagr_gym.recordings.schema import Recording, RobotGeometry
from ddagr_gym.recordings.streams import recording_of
from ddagr_gym.recordings.topic_map import Topic, TopicMap

_LARGEST_METADATA = 4 * 2**20  # bytes (ours): about ten thousand topics; more is no metadata


def read_rosbag(
    path: Path,
    topic_map: TopicMap,
    geometry: RobotGeometry | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Recording:
    """Recording from a ROS 1 or ROS 2 bag.

    Args:
        path: ``.bag`` file, ``.db3`` file, or folder with ``metadata.yaml``.
        topic_map: which topics hold what.
        geometry: robot's wheel radius and track, for Twist commands.
        limits: on messages and unpacked bytes.

    Raises:
        InputError: damaged bag, missing topics, or messages that do not decode.
    """
    inner = _storage(path)
    if inner is not None:
        return read_mcap(inner, topic_map, geometry, limits).with_meta(source=path.name, source_sha256=sha256_of(path))
    with _open(path, limits) as reader:
        return recording_of(path, _topics(reader), partial(_messages, reader), topic_map, geometry, limits)


def _messages(reader: Any, names: Collection[str]) -> Iterator[tuple[str, float, Any]]:
    """Topic, time of receipt [s] and decoded message of every message of the named topics."""
    connections = [c for c in reader.connections if c.topic in names]
    for connection, receive, data in reader.messages(connections=connections):
        yield connection.topic, receive * 1e-9, reader.deserialize(data, connection.msgtype)


def _storage(path: Path) -> Path | None:
    """MCAP file inside a ROS 2 bag's folder, None where the bag is not stored as MCAP."""
    if not path.is_dir():
        return None
    if not (path / "metadata.yaml").is_file():
        raise InputError(f"the folder {path.name} has no metadata.yaml: give a ROS 2 bag's folder or a file.")
    information = _information(path)
    files = [str(name) for name in information.get("relative_file_paths") or ()]
    for name in files:
        if Path(name).is_absolute() or ".." in Path(name).parts:
            raise InputError(f"{path.name}/metadata.yaml names the file {name!r} outside its folder: correct it.")
    if str(information.get("compression_mode") or "none").lower() != "none":
        raise InputError(f"{path.name} is a compressed ROS 2 bag: unpack it with `ros2 bag convert` first.")
    if information.get("storage_identifier") != "mcap":
        return None
    if len(files) != 1:
        raise InputError(f"{path.name} has {len(files)} MCAP files: import them one by one.")
    return path / files[0]


def _information(path: Path) -> dict[str, Any]:
    """Content of a ROS 2 bag's metadata.yaml."""
    import yaml

    with open_source(path / "metadata.yaml") as stream:
        data = stream.read(_LARGEST_METADATA + 1)
    try:
        content = yaml.safe_load(data.decode("utf-8")) if len(data) <= _LARGEST_METADATA else None
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError, ValueError):
        content = None
    information = content.get("rosbag2_bagfile_information") if isinstance(content, dict) else None
    if not isinstance(information, dict) or not isinstance(information.get("relative_file_paths"), list):
        raise InputError(f"{path.name}/metadata.yaml is not a ROS 2 bag's: restore it with `ros2 bag reindex`.")
    return information


@contextmanager
def _open(path: Path, limits: Limits) -> Iterator[Any]:
    """An open ``rosbags`` reader; every error that a damaged bag causes becomes an InputError."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    kind = kind_of(path)
    if kind == "rosbag" and path.suffix != ".bag":
        raise InputError(f"{path.name} is a ROS 1 bag without the ending .bag: rename it.")
    if kind == "sqlite" and path.suffix != ".db3":
        raise InputError(
            f"{path.name} is an SQLite file without the ending .db3 of a ROS 2 bag: rename it if it is one."
        )
    try:
        reader = AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE))
        with reader:
            _bound_chunks(reader, limits, path)
            yield reader
    except InputError:
        raise
    except Exception as error:  # rosbags lets struct, unicode, key and assertion errors of damaged bags through
        raise damaged(path, error, "is damaged or not a bag", "reindex it or record it again") from None


def _topics(reader: Any) -> tuple[Topic, ...]:
    return tuple(
        Topic(name, (info.msgtype or "several types").rsplit("/", 1)[-1], info.msgcount)
        for name, info in sorted(reader.topics.items())
    )


def _bound_chunks(reader: Any, limits: Limits, path: Path) -> None:
    """Make a ROS 1 bag's chunks unpack to no more than the limit (rosbags itself sets none)."""
    import bz2

    import lz4.frame  # type: ignore[import-untyped]

    def bounded(make: Any) -> Any:
        def unpack(data: bytes) -> bytes:
            unpacked: bytes = make().decompress(data, limits.bytes + 1)
            if len(unpacked) > limits.bytes:
                raise InputError(
                    f"{path.name} has a chunk that unpacks to more than {limits.bytes:,} bytes: raise --maximum-bytes "
                    "if that is right."
                )
            return unpacked

        return unpack

    makers = {bz2.decompress: bz2.BZ2Decompressor, lz4.frame.decompress: lz4.frame.LZ4FrameDecompressor}
    for single in reader.readers:
        chunks = getattr(single, "chunks", {})
        for position, chunk in chunks.items():
            if chunk.decompressor in makers:
                chunks[position] = chunk._replace(decompressor=bounded(makers[chunk.decompressor]))
