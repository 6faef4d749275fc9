"""Numbers of a drive as JSON messages, one field a channel, which Foxglove and PlotJuggler plot as they are."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.verdict import Diagnosis
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.recordings.channels import CHANNELS as SCHEMA
from ddagr_gym.viewers.annotations import Annotation, finding_names, shows
from ddagr_gym.viewers.drive_traces import MODELS, DriveTraces
from ddagr_gym.viewers.mcap_messages import Message, nanoseconds

if TYPE_CHECKING:
    import foxglove

Array = NDArray[np.float64]


class NumberTopics:
    """JSON topics with one number a channel: the drive as it was read, what was compared, and what it was worth.

    Args:
        context: of the writer.
        diagnosis: whose findings have a number of their own: 1 where one shows.
    """

    def __init__(self, context: foxglove.Context, diagnosis: Diagnosis) -> None:
        from foxglove import Channel, Schema

        def channel(topic: str, name: str, fields: Mapping[str, str]) -> Channel:
            body = {"type": "object", "title": name, "properties": _properties(fields)}
            schema = Schema(name=name, encoding="jsonschema", data=json.dumps(body).encode())
            return Channel(topic, schema=schema, message_encoding="json", context=context)

        readings = {name: f"{item.description} [{item.unit}]" for name, item in SCHEMA.items()}
        compared = {name: readings[name] for name in CHANNELS}
        residuals = {
            name: f"{name.replace('_', ' ')}: measured less predicted, over its noise [-]" for name in CHANNELS
        }
        self._drive = channel("/drive", "ddagr.Readings", readings)
        self._values = {name: channel(f"/{name}", "ddagr.ComparedReadings", compared) for name in ("measured", *MODELS)}
        self._residuals = {name: channel(f"/residual/{name}", "ddagr.Residuals", residuals) for name in MODELS}
        self._names = finding_names(diagnosis)
        where = dict.fromkeys(self._names, "1 where it shows, else 0 [-]")
        self._shows = channel("/findings/shows", "ddagr.Findings", where) if self._names else None

    def of(self, drive: DriveTraces, number: int, found: Sequence[Annotation]) -> list[Iterator[Message]]:
        """Streams of one drive.

        Args:
            drive: with its predictions.
            number: of it, from 0.
            found: its annotations.
        """
        recording = drive.recording
        read = np.stack([recording[name] for name in SCHEMA], axis=1)
        streams = [_rows(self._drive, drive, number, recording.t, tuple(SCHEMA), read)]
        for name, topic in self._values.items():
            values = drive.measured if name == "measured" else drive.predictions[name]
            streams.append(_rows(topic, drive, number, drive.time, CHANNELS, values))
        for name, topic in self._residuals.items():
            streams.append(_rows(topic, drive, number, drive.time, CHANNELS, drive.residuals[name]))
        if self._shows is not None:
            values = shows(drive.time, self._names, found)
            streams.append(_rows(self._shows, drive, number, drive.time, self._names, values))
        return streams


def _properties(fields: Mapping[str, str]) -> dict[str, Any]:
    """JSON schema of the fields of a message."""
    return {
        "recording": {"type": "integer", "description": "number of the drive, from 1"},
        "time": {"type": "number", "description": "of the recording [s]"},
        **{name: {"type": "number", "description": text} for name, text in fields.items()},
    }


def _rows(
    topic: foxglove.Channel, drive: DriveTraces, number: int, time: Array, names: Sequence[str], values: Array
) -> Iterator[Message]:
    """A message for each row of (N, K) values that has any; what is not finite is left out."""
    finite = np.isfinite(values)
    for row in np.flatnonzero(finite.any(axis=1)).tolist():
        fields = {name: float(values[row, k]) for k, name in enumerate(names) if finite[row, k]}
        body = json.dumps({"recording": number + 1, "time": round(float(time[row]), 9), **fields}).encode()
        yield nanoseconds(drive, float(time[row])), 2, _sender(topic, body)


def _sender(topic: foxglove.Channel, body: bytes) -> Callable[[int], None]:
    return lambda stamp: topic.log(body, log_time=stamp)
