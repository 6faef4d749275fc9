"""Bags of all kinds: ROS 1 (.bag) and ROS 2 (folder, .db3, .mcap, each also with .zstd), without ROS."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.bag import Bag, Received
from ddagr_gym.recordings.compressed import unpacked_files
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits, kind_of
from ddagr_gym.recordings.mcap_reader import open_mcap
from ddagr_gym.recordings.rosbag2 import open_folder
from ddagr_gym.recordings.schema import Recording, RobotGeometry
from ddagr_gym.recordings.sqlite_reader import bag_errors, open_sqlite
from ddagr_gym.recordings.streams import recording_of
from ddagr_gym.recordings.topic_map import Topic, TopicMap

BAG_KINDS = ("rosbag", "sqlite", "folder", "mcap", "zstd")
"""Kinds of sources (:func:`~ddagr_gym.recordings.files.kind_of`) that are bags."""


def read_rosbag(
    path: Path,
    topic_map: TopicMap,
    geometry: RobotGeometry | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Recording:
    """Recording from a bag.

    Args:
        path: ``.bag``, ``.db3`` or ``.mcap`` file, or folder with ``metadata.yaml``.
        topic_map: which topics hold what.
        geometry: robot's wheel radius and track, for Twist commands.
        limits: on messages and unpacked bytes.

    Raises:
        InputError: damaged bag, missing topics, or messages that do not decode.
    """
    with open_bag(path, limits) as bag:
        return recording_of(bag, topic_map, geometry, limits)


@contextmanager
def open_bag(path: Path, limits: Limits = DEFAULT_LIMITS) -> Iterator[Bag]:
    """Topics and messages of a bag of any kind; they can be read while it is open.

    Args:
        path: as in :func:`read_rosbag`.
        limits: on unpacked bytes.

    Raises:
        InputError: no bag, or a damaged one.
    """
    kind = kind_of(path)
    if kind == "zstd":
        with unpacked_files([path], limits) as (inner,):
            if kind_of(inner) not in ("sqlite", "mcap"):
                raise InputError(
                    f"{path.name} is compressed with zstd and holds no bag: unpack or convert it to CSV, Parquet, MCAP "
                    "or a bag first."
                )
            with open_bag(inner, limits) as bag:
                yield Bag(path, bag.topics, bag.read)
    elif kind == "folder":
        with open_folder(path, limits) as bag:
            yield bag
    elif kind == "mcap":
        yield open_mcap(path, limits)
    elif kind == "sqlite":
        with open_sqlite(path, limits) as bag:
            yield bag
    elif kind == "rosbag":
        with _open_ros1(path, limits) as bag:
            yield bag
    else:
        raise InputError(f"{path.name} is no bag ({kind}): give a ROS bag or an MCAP file.")


@contextmanager
def _open_ros1(path: Path, limits: Limits) -> Iterator[Bag]:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    if path.suffix != ".bag":
        raise InputError(f"{path.name} is a ROS 1 bag without the ending .bag: rename it.")
    with ExitStack() as stack:
        with bag_errors(path):
            typestore = get_typestore(Stores.ROS1_NOETIC)
            reader = stack.enter_context(AnyReader([path], default_typestore=typestore))
            _bound_chunks(reader, limits, path)
            topics = _topics(reader)
        yield Bag(path, topics, partial(_messages, reader, path))


def _messages(reader: Any, path: Path, names: Collection[str]) -> Iterator[Received]:
    connections = [c for c in reader.connections if c.topic in names]
    with bag_errors(path):
        for connection, receive, data in reader.messages(connections=connections) if connections else ():
            yield connection.topic, receive * 1e-9, reader.deserialize(data, connection.msgtype)


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
