"""MCAP files with JSON or ROS 2 (CDR) messages through the ``mcap`` library, read from front to back."""

from __future__ import annotations

import io
import json
from collections import Counter
from collections.abc import Collection, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.bag import Bag, Received
from ddagr_gym.recordings.cdr import Decoder, cdr_decoder
from ddagr_gym.recordings.compressed import allowed_bytes, too_large, unpacked_message
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits, damaged, open_source
from ddagr_gym.recordings.schema import Recording, RobotGeometry
from ddagr_gym.recordings.streams import recording_of
from ddagr_gym.recordings.topic_map import Topic, TopicMap


def read_mcap(
    path: Path,
    topic_map: TopicMap,
    geometry: RobotGeometry | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Recording:
    """Recording from an MCAP file.

    Args:
        path: MCAP file.
        topic_map: which topics hold what.
        geometry: robot's wheel radius and track, for Twist commands.
        limits: on messages and unpacked bytes.

    Raises:
        InputError: damaged file, missing topics, or an encoding other than JSON and CDR.
    """
    return recording_of(open_mcap(path, limits), topic_map, geometry, limits)


def open_mcap(path: Path, limits: Limits = DEFAULT_LIMITS) -> Bag:
    """Topics and messages of an MCAP file.

    Args:
        path: MCAP file.
        limits: on unpacked bytes.

    Raises:
        InputError: damaged file; while messages are read, an encoding other than JSON and CDR.
    """
    return Bag(path, _topics(path, limits), partial(_messages, path, limits))


def _topics(path: Path, limits: Limits) -> tuple[Topic, ...]:
    """Topics with their message types and counts."""
    contents = _Contents()
    counts = Counter(message.channel_id for message in contents.messages(path, limits))
    totals: Counter[tuple[str, str]] = Counter()
    for number, channel in contents.channels.items():
        totals[channel.topic, contents.message_type(channel)] += counts[number]
    return tuple(Topic(name, kind, count) for (name, kind), count in sorted(totals.items()))


def _messages(path: Path, limits: Limits, names: Collection[str]) -> Iterator[Received]:
    """Every message of the named topics."""
    contents, decoders = _Contents(), _Decoders(path, limits)
    for message in contents.messages(path, limits):
        channel = contents.channels.get(message.channel_id)
        if channel is not None and channel.topic in names:
            decoded = decoders.decode(channel, contents.schemas.get(channel.schema_id), message.data)
            yield channel.topic, message.log_time * 1e-9, decoded


class _Contents:
    """Schemas and channels met so far."""

    def __init__(self) -> None:
        self.schemas: dict[int, Any] = {}
        self.channels: dict[int, Any] = {}

    def messages(self, path: Path, limits: Limits) -> Iterator[Any]:
        """Messages of a file from front to back; schemas and channels before a message are known when it comes."""
        from mcap.records import Channel, Message, Schema

        for record in _records(path, limits):
            if isinstance(record, Schema):
                self.schemas[record.id] = record
            elif isinstance(record, Channel):
                self.channels[record.id] = record
            elif isinstance(record, Message):
                yield record

    def message_type(self, channel: Any) -> str:
        """Type's name without its package, as in sensor_msgs/msg/Imu, sensor_msgs.Imu or Imu."""
        schema = self.schemas.get(channel.schema_id)
        name = schema.name if schema is not None else channel.metadata.get("type", "unknown")
        return str(name).replace(".", "/").rsplit("/", 1)[-1]


class _Decoders:
    """One decoder for each channel, made when its first message comes."""

    def __init__(self, path: Path, limits: Limits) -> None:
        self._path, self._limits = path, limits
        self._decoders: dict[int, Decoder] = {}

    def decode(self, channel: Any, schema: Any, data: bytes) -> Any:
        """Message as an object or a mapping.

        Raises:
            InputError: unknown encoding, or data that do not decode.
        """
        try:
            if channel.id not in self._decoders:
                self._decoders[channel.id] = self._make(channel, schema)
            return self._decoders[channel.id](unpacked_message(data, self._limits, self._path))
        except InputError:
            raise
        except Exception as error:  # decoders of generated types raise whatever the bytes lead them to
            complaint = f", topic {channel.topic}: a message does not decode"
            raise damaged(self._path, error, complaint, "record it again") from None

    def _make(self, channel: Any, schema: Any) -> Decoder:
        if channel.message_encoding == "json":
            return json.loads
        if channel.message_encoding == "cdr" and schema is not None and schema.encoding == "ros2msg":
            return cdr_decoder(schema.name, schema.data.decode("utf-8"))
        encoding = schema.encoding if schema is not None else "no schema"
        raise InputError(
            f"{self._path.name}, topic {channel.topic}, is encoded as {channel.message_encoding!r} ({encoding!r}): "
            "convert it to JSON or to ROS 2 (cdr with ros2msg)."
        )


def _records(path: Path, limits: Limits) -> Iterator[Any]:
    """Records of the file and of its chunks; chunks unpack to no more than the limit."""
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader

    unpacked = 0
    allowed = allowed_bytes(path.stat().st_size, limits)
    try:
        with open_source(path) as stream:
            for record in StreamReader(stream, emit_chunks=True, record_size_limit=limits.bytes).records:
                if not isinstance(record, Chunk):
                    yield record
                    continue
                data = _unpack(record, allowed - unpacked, path)
                unpacked += len(data)
                yield from _inner(data)
    except (InputError, GeneratorExit):
        raise
    except Exception as error:  # McapError, and struct, unicode and codec errors of damaged files
        raise damaged(path, error, "is damaged or truncated", "run `mcap recover` or record it again") from None


def _inner(data: bytes) -> Iterator[Any]:
    from mcap.exceptions import EndOfFile
    from mcap.stream_reader import StreamReader

    stream = io.BytesIO(data)
    records = StreamReader(stream, skip_magic=True).records
    while stream.tell() < len(data):
        try:
            yield next(records)
        except EndOfFile:
            raise ValueError("a chunk ends inside a record") from None


def _unpack(chunk: Any, limit: int, path: Path) -> bytes:
    """Content of a chunk.

    Raises:
        InputError: more than ``limit`` bytes, or an unknown compression.
    """
    if chunk.compression == "":
        data = bytes(chunk.data)
    elif chunk.compression == "zstd":
        import zstandard

        data = zstandard.ZstdDecompressor().stream_reader(chunk.data, read_size=2**16).read(limit + 1)
    elif chunk.compression == "lz4":
        import lz4.frame  # type: ignore[import-untyped]

        data = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, limit + 1)
    else:
        raise InputError(f"{path.name} is compressed with {chunk.compression!r}: convert it to zstd, lz4 or none.")
    if len(data) > limit:
        raise too_large(path)
    if len(data) != chunk.uncompressed_size:
        raise ValueError(f"a chunk unpacks to {len(data)} bytes, not {chunk.uncompressed_size}")
    return data
