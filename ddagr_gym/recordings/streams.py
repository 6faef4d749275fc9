"""From the messages of a bag to a recording: shared by the rosbag and MCAP readers."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.alignment import Stream, align, regular_base
from ddagr_gym.recordings.files import Limits, sha256_of
from ddagr_gym.recordings.ros_messages import Extractor, extractor, header_stamp
from ddagr_gym.recordings.schema import COMMANDS, FloatArray, Recording, RobotGeometry
from ddagr_gym.recordings.topic_map import Topic, TopicMap, choose_topics


@dataclass
class _Samples:
    """Growing samples of one topic, eight bytes a number."""

    extract: Extractor
    t: array[float] = field(default_factory=lambda: array("d"))
    values: dict[str, array[float]] = field(default_factory=dict)
    stamped: int = 0

    def add(self, receive: float, message: Any, header_stamps: bool) -> None:
        stamp = header_stamp(message) if header_stamps else None
        sample = self.extract(message)
        self.stamped += stamp is not None
        self.t.append(receive if stamp is None else stamp)
        for name, value in sample.items():
            self.values.setdefault(name, array("d")).append(value)


def recording_of(
    path: Path,
    topics: tuple[Topic, ...],
    messages: Callable[[Collection[str]], Iterable[tuple[str, float, Any]]],
    topic_map: TopicMap,
    geometry: RobotGeometry | None,
    limits: Limits,
) -> Recording:
    """Recording of the messages of a bag.

    Args:
        path: of the bag.
        topics: that it holds.
        messages: takes names of topics and gives topic, time of receipt [s] and decoded message of each message.
        topic_map: which topics hold what.
        geometry: robot's wheel radius and track, for Twist commands.
        limits: on the number of messages.

    Raises:
        InputError: missing topics, too many messages, or none in the role that gives the time base.
    """
    chosen = choose_topics(topic_map, topics, path.name)
    collector = _StreamCollector(topic_map, chosen, geometry, limits, path)
    for topic, receive, message in messages({topic.name for topic in chosen.values()}):
        collector.add(topic, receive, message)
    return collector.recording(sha256_of(path))


class _StreamCollector:
    """Takes messages one by one and gives the recording at the end; ``chosen`` is the topic of each role."""

    def __init__(
        self,
        topic_map: TopicMap,
        chosen: dict[str, Topic],
        geometry: RobotGeometry | None,
        limits: Limits,
        path: Path,
    ) -> None:
        self._map, self._chosen, self._geometry = topic_map, chosen, geometry
        self._limits, self._path = limits, path
        self._roles = {topic.name: role for role, topic in chosen.items()}
        self._samples = {
            role: _Samples(extractor(topic.message_type, topic_map.topics[role], geometry, path.name))
            for role, topic in chosen.items()
        }
        self._messages = 0

    def add(self, topic: str, receive: float, message: Any) -> None:
        """Take one message of a chosen topic, received at ``receive`` [s]."""
        self._messages += 1
        self._limits.check_rows(self._messages, self._path)
        self._samples[self._roles[topic]].add(receive, message, self._map.stamps == "header")

    def recording(self, source_sha256: str) -> Recording:
        """The recording on one time base.

        Raises:
            InputError: no message in the role that gives the time base.
        """
        streams = {role: self._stream(role) for role in self._samples}
        base, period = self._base(streams)
        channels, lost = align(base, streams, self._map.tolerance * period)
        columns = {"t": base, **{n: v * self._map.signs.get(n, 1.0) for n, v in channels.items()}}
        have_commands = all(name in channels for name in COMMANDS)
        recording = Recording.from_columns(
            columns,
            self._geometry,
            source=self._path.name,
            command_valid=np.full(len(base), have_commands),
            notes=self._notes(streams, lost, period),
        )
        return replace(recording, meta=replace(recording.meta, source_sha256=source_sha256, column_map=self._map.name))

    def _stream(self, role: str) -> Stream:
        samples = self._samples[role]
        # Receive times and header stamps may come from two clocks: never mix them inside one stream.
        if 0 < samples.stamped < len(samples.t):
            raise InputError(
                f"{self._path.name}, {self._chosen[role].name}: only {samples.stamped} of {len(samples.t)} messages "
                "have a header stamp; set stamps: receive in the topic map."
            )
        return Stream(np.array(samples.t), {name: np.array(v) for name, v in samples.values.items()})

    def _base(self, streams: dict[str, Stream]) -> tuple[FloatArray, float]:
        base = streams[self._map.base].sorted().t if self._map.base in streams else np.empty(0)
        if base.size < 2:
            raise InputError(
                f"{self._path.name} has {base.size} messages for {self._map.base}, which gives the time base: name "
                "another role under base in the topic map."
            )
        if self._map.rate:
            base = regular_base(float(base[0]), float(base[-1]), self._map.rate, self._limits.rows)
            return base, 1.0 / self._map.rate
        return base, float(np.median(np.diff(base)))

    def _notes(self, streams: dict[str, Stream], lost: dict[str, int], period: float) -> Iterable[str]:
        for role, topic in self._chosen.items():
            stamped = self._samples[role].stamped
            clock = "header stamps" if stamped else "times of receipt"
            repeats = len(streams[role].t) - len(streams[role].sorted().t)
            yield (
                f"{role} is {topic.name} ({topic.message_type}) by {clock}: {len(streams[role].t)} messages, "
                f"{repeats} with a repeated stamp, {lost[role]} without a row of their own."
            )
        where = f"a regular {self._map.rate:g} Hz grid" if self._map.rate else f"the stamps of {self._map.base}"
        yield (
            f"rows are {where}; the other samples are at their nearest row within "
            f"{self._map.tolerance * period:.4g} s, none is interpolated."
        )
        for name, sign in self._map.signs.items():
            if sign < 0:
                yield f"{name} was multiplied by -1."
