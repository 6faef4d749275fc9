"""One SQLite file (.db3) of a ROS 2 bag through the ``rosbags`` library, without ROS."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.bag import Bag, Received
from ddagr_gym.recordings.cdr import Decoder, cdr_decoder
from ddagr_gym.recordings.compressed import unpacked_message
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits, damaged
from ddagr_gym.recordings.topic_map import Topic


@contextmanager
def open_sqlite(path: Path, limits: Limits = DEFAULT_LIMITS) -> Iterator[Bag]:
    """Topics and messages of a file; they can be read while it is open.

    Args:
        path: file that ends in .db3.
        limits: on a message's unpacked bytes.

    Raises:
        InputError: damaged file, or messages that do not decode.
    """
    from rosbags.rosbag2 import Reader

    if path.suffix != ".db3":
        raise InputError(
            f"{path.name} is an SQLite file without the ending .db3 of a ROS 2 bag: rename it if it is one."
        )
    with ExitStack() as stack:
        with bag_errors(path):
            reader = stack.enter_context(Reader(path))
            topics = [Topic(c.topic, c.msgtype.rsplit("/", 1)[-1], c.msgcount) for c in reader.connections]
        yield Bag(path, tuple(sorted(topics, key=lambda topic: topic.name)), partial(_messages, reader, path, limits))


@contextmanager
def bag_errors(path: Path) -> Iterator[None]:
    """Whatever rosbags raises about a damaged bag becomes an :class:`InputError`."""
    try:
        yield
    except (InputError, GeneratorExit):
        raise
    except Exception as error:  # rosbags lets struct, unicode, key and assertion errors of damaged bags through
        raise damaged(path, error, "is damaged or not a bag", "reindex it or record it again") from None


def _messages(reader: Any, path: Path, limits: Limits, names: Collection[str]) -> Iterator[Received]:
    wanted = [c for c in reader.connections if c.topic in names]
    decoders: dict[int, Decoder] = {}
    with bag_errors(path):
        for connection, receive, data in reader.messages(connections=wanted) if wanted else ():
            if connection.id not in decoders:
                decoders[connection.id] = _decoder(connection, path)
            message = decoders[connection.id](unpacked_message(bytes(data), limits, path))
            yield connection.topic, receive * 1e-9, message


def _decoder(connection: Any, path: Path) -> Decoder:
    """Decoder by the definition in the file, by ROS 2's own where it has none.

    Raises:
        InputError: messages in another encoding than CDR.
    """
    encoding = connection.ext.serialization_format
    if encoding != "cdr":
        raise InputError(f"{path.name}, topic {connection.topic}, is encoded as {encoding!r}: convert it to cdr.")
    definition = connection.msgdef.data if connection.msgdef.format.name == "MSG" else ""
    return cdr_decoder(connection.msgtype, definition)
