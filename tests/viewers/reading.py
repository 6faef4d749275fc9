"""MCAP files through the readers of the project that defines them, and through that of protocol buffers."""

from __future__ import annotations

import json
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest


@dataclass
class Read:
    """Content of a file: decoded messages by topic with their stamps [s], schemas, metadata and attachments."""

    messages: dict[str, list[tuple[float, Any]]]
    schemas: dict[str, Any]
    metadata: dict[str, str]
    attached: dict[str, bytes]
    stamps: list[int]

    def column(self, topic: str, name: str) -> np.ndarray:
        """(n, 3) stamp, time of the recording and value of the messages that have the field."""
        rows = [(stamp, item["time"], item[name]) for stamp, item in self.messages[topic] if name in item]
        return np.array(rows)


def read(path: Path) -> Read:
    """Everything in a file."""
    reading = pytest.importorskip("mcap.reader", reason="needs the extra io")
    decoding = pytest.importorskip("mcap_protobuf.decoder", reason="needs the extra dev")
    messages, stamps = defaultdict(list), []
    with path.open("rb") as stream:
        reader = reading.make_reader(stream, decoder_factories=[decoding.DecoderFactory()])
        summary = reader.get_summary()
        schemas = {item.topic: summary.schemas[item.schema_id] for item in summary.channels.values()}
        for _, channel, message in reader.iter_messages(log_time_order=False):
            stamps.append(message.log_time)
            if channel.message_encoding == "json":
                messages[channel.topic].append((message.log_time * 1e-9, json.loads(message.data)))
        for _, channel, message, decoded in reader.iter_decoded_messages(
            topics=[topic for topic, schema in schemas.items() if schema.encoding == "protobuf"]
        ):
            messages[channel.topic].append((message.log_time * 1e-9, decoded))
        (metadata,) = [item.metadata for item in reader.iter_metadata()]
        attached = {item.name: item.data for item in reader.iter_attachments()}
    return Read(messages, schemas, metadata, attached, stamps)
