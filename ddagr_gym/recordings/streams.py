"""From the messages of a bag to a recording: samples of topics, then samples on one time base."""

from __future__ import annotations

import math
from array import array
from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.alignment import Stream, align, regular_base
from ddagr_gym.recordings.arrival import StepBack, step_back
from ddagr_gym.recordings.bag import Bag
from ddagr_gym.recordings.channels import COMMANDS
from ddagr_gym.recordings.files import Limits, sha256_of
from ddagr_gym.recordings.frames import mounting_frames, static_frames, transforms
from ddagr_gym.recordings.message_fields import header_stamp
from ddagr_gym.recordings.ros_messages import BankSpeeds, Extractor, extractor
from ddagr_gym.recordings.row_times import longest_period
from ddagr_gym.recordings.schema import FloatArray, Recording, RobotGeometry
from ddagr_gym.recordings.topic_map import TRANSFORMS, Topic, TopicMap, TopicSource, choose_topics

Label = TypeVar("Label", bound=Hashable)


@dataclass
class Samples:
    """Growing samples of one topic, eight bytes a number.

    Attributes:
        extract: takes channels out of a message.
        t: stamps [s].
        received: times of receipt [s], as long as ``t``.
        values: channels, each as long as ``t``; NaN where a message has none of it.
        stamped: number of samples with a header stamp; the others stand at their receipt.
    """

    extract: Extractor
    t: array[float] = field(default_factory=lambda: array("d"))
    received: array[float] = field(default_factory=lambda: array("d"))
    values: dict[str, array[float]] = field(default_factory=dict)
    stamped: int = 0

    def add(self, receive: float, message: Any, header_stamps: bool) -> None:
        """Take one message, received at ``receive`` [s]."""
        sample = self.extract(message)
        if sample is None:
            return
        stamp = header_stamp(message) if header_stamps else None
        self.stamped += stamp is not None
        for name in sample:
            if name not in self.values:
                self.values[name] = array("d", [math.nan]) * len(self.t)
        self.t.append(receive if stamp is None else stamp)
        self.received.append(receive)
        for name, column in self.values.items():
            column.append(sample.get(name, math.nan))

    def step_back(self) -> StepBack | None:
        """Where the stamps go back in mid-drive."""
        return step_back(np.array(self.t), np.array(self.received))

    def only(self, rows: npt.NDArray[np.bool_], values: Mapping[str, FloatArray]) -> Samples:
        """Some of the samples, with other channels.

        Args:
            rows: which (n,).
            values: channels (n,) by name.
        """
        t, received = (array("d", np.array(times)[rows]) for times in (self.t, self.received))
        channels = {name: array("d", column[rows]) for name, column in values.items()}
        return Samples(self.extract, t, received, channels, len(t) if self.stamped else 0)

    def stream(self) -> Stream:
        """What was taken so far."""
        return Stream(np.array(self.t), {name: np.array(v) for name, v in self.values.items()})


def recording_of(bag: Bag, topic_map: TopicMap, geometry: RobotGeometry | None, limits: Limits) -> Recording:
    """Recording of the messages of a bag.

    Args:
        bag: open.
        topic_map: which topics hold what.
        geometry: robot's wheel radius and track, for Twist commands.
        limits: on the number of messages.

    Raises:
        InputError: missing topics, too many messages, or none in the role that gives the time base.
    """
    chosen = choose_topics(topic_map, bag.topics, bag.path.name)
    extractors = {
        role: (topic.name, topic_extractor(bag, topic, topic_map.topics[role], geometry))
        for role, topic in chosen.items()
    }
    samples = collect(bag, extractors, topic_map.stamps == "header", limits)
    recording = assemble(bag.path, topic_map, chosen, samples, geometry, limits)
    return recording.with_meta(source_sha256=sha256_of(bag.path))


def topic_extractor(bag: Bag, topic: Topic, source: TopicSource, geometry: RobotGeometry | None) -> Extractor:
    """Function that takes the channels out of a topic's messages, with the bag's transforms where it needs them.

    Args:
        bag: open.
        topic: of the bag.
        source: what the map says of it.
        geometry: robot's, for Twist commands.

    Raises:
        InputError: as :func:`~ddagr_gym.recordings.ros_messages.extractor`.
    """
    tree = None
    if topic.message_type == TRANSFORMS:
        tree = static_frames(bag, topic.name)
    elif source.frame:
        tree = mounting_frames(bag, topic.name)
    return extractor(topic.message_type, source, geometry, bag.path.name, tree)


def collect(
    bag: Bag, extractors: Mapping[Label, tuple[str, Extractor]], header_stamps: bool, limits: Limits
) -> dict[Label, Samples]:
    """Samples of topics, in one pass through a bag.

    Args:
        bag: open.
        extractors: topic and what takes channels out of its messages, under any labels.
        header_stamps: whether header stamps count where messages have one.
        limits: on the number of messages.

    Returns:
        Samples by label.

    Raises:
        InputError: too many messages.
    """
    samples = {label: Samples(extract) for label, (_, extract) in extractors.items()}
    takers: dict[str, list[Samples]] = {}
    for label, (topic, _) in extractors.items():
        takers.setdefault(topic, []).append(samples[label])
    transform_topics = {topic.name for topic in bag.topics if topic.message_type == TRANSFORMS}
    count = 0
    for topic, receive, message in bag.read(set(takers)):
        for part in transforms(message) if topic in transform_topics else (message,):
            count += 1
            limits.check_rows(count, bag.path)
            for taker in takers[topic]:
                taker.add(receive, part, header_stamps)
    return samples


def assemble(
    path: Path,
    topic_map: TopicMap,
    chosen: Mapping[str, Topic],
    samples: Mapping[str, Samples],
    geometry: RobotGeometry | None,
    limits: Limits,
) -> Recording:
    """Recording of samples on one time base; the hash of its source is left empty.

    Args:
        path: of the bag.
        topic_map: with the time base, tolerance and signs.
        chosen: topic by role.
        samples: by role.
        geometry: robot's.
        limits: on the number of rows.

    Raises:
        InputError: no sample in the role that gives the time base, stamps of two kinds in one topic, stamps that go
            back, a JointState without the wheels, or a role whose stamps lie where no rows are.
    """
    return _Assembly(path, topic_map, chosen, samples, limits).recording(geometry)


@dataclass(frozen=True)
class _Assembly:
    path: Path
    map: TopicMap
    chosen: Mapping[str, Topic]
    samples: Mapping[str, Samples]
    limits: Limits

    def recording(self, geometry: RobotGeometry | None) -> Recording:
        streams = {role: self._stream(role) for role in self.samples}
        base, period = self._base(streams)
        channels, lost = align(base, streams, self.map.tolerance * period)
        self._refuse_elsewhere(base, streams, lost)
        columns = {"t": base, **{n: v * self.map.signs.get(n, 1.0) for n, v in channels.items()}}
        have_commands = all(name in channels and np.isfinite(channels[name]).any() for name in COMMANDS)
        recording = Recording.from_columns(
            columns,
            geometry,
            source=self.path.name,
            command_valid=np.full(len(base), have_commands),
            notes=self._notes(streams, lost, period),
        )
        return replace(recording, meta=replace(recording.meta, column_map=self.map.name))

    def _stream(self, role: str) -> Stream:
        samples, place = self.samples[role], f"{self.path.name}, {self.chosen[role].name}"
        complaint = samples.extract.complaint() if isinstance(samples.extract, BankSpeeds) else ""
        if complaint and not samples.t:
            raise InputError(f"{place}: {complaint}")
        # Receive times and header stamps may come from two clocks: never mix them inside one stream.
        if 0 < samples.stamped < len(samples.t):
            raise InputError(
                f"{place}: only {samples.stamped} of {len(samples.t)} messages have a header stamp; set stamps: "
                "receive in the topic map."
            )
        step = samples.step_back()
        if step is not None:
            raise step.refusal(place)
        return _measured(samples.stream()) if role == "pose" else samples.stream()

    def _refuse_elsewhere(self, base: FloatArray, streams: Mapping[str, Stream], lost: Mapping[str, int]) -> None:
        """Refuse a role whose samples, several, all lie where no rows are: by another clock, or not in this drive."""
        for role, stream in streams.items():
            if not 1 < len(stream.t) == lost[role]:
                continue
            receive = "set stamps: receive in the topic map, or " if self.map.stamps == "header" else ""
            raise InputError(
                f"{self.path.name}, {self.chosen[role].name}: none of its {len(stream.t)} messages is near a row, its "
                f"stamps are {stream.t.min():.3f} to {stream.t.max():.3f} s and the rows' {base[0]:.3f} to "
                f"{base[-1]:.3f} s: {receive}leave {role} out of the map."
            )

    def _base(self, streams: dict[str, Stream]) -> tuple[FloatArray, float]:
        base = streams[self.map.base].sorted().t if self.map.base in streams else np.empty(0)
        if base.size < 2:
            raise InputError(
                f"{self.path.name} has {base.size} messages for {self.map.base}, which gives the time base: name "
                "another role under base in the topic map."
            )
        if self.map.rate:
            base = regular_base(float(base[0]), float(base[-1]), self.map.rate, self.limits.rows)
            return base, 1.0 / self.map.rate
        return base, longest_period(np.diff(base))

    def _notes(self, streams: dict[str, Stream], lost: dict[str, int], period: float) -> Iterable[str]:
        for role, topic in self.chosen.items():
            stamped = self.samples[role].stamped
            clock = "header stamps" if stamped else "times of receipt"
            repeats = len(streams[role].t) - len(streams[role].sorted().t)
            yield (
                f"{role} is {topic.name} ({topic.message_type}) by {clock}: {len(streams[role].t)} messages, "
                f"{repeats} with a repeated stamp, {lost[role]} without a row of their own."
            )
            yield from _frame_notes(self.map.topics[role], topic)
        where = f"a regular {self.map.rate:g} Hz grid" if self.map.rate else f"the stamps of {self.map.base}"
        yield (
            f"rows are {where}; the other samples are at their nearest row within "
            f"{self.map.tolerance * period:.4g} s, none is interpolated."
        )
        for name, sign in self.map.signs.items():
            if sign < 0:
                yield f"{name} was multiplied by -1."


def _measured(pose: Stream) -> Stream:
    """Pose without roll and pitch where both are exactly 0 throughout: planar odometry measures neither."""
    planar = {name: v for name, v in pose.channels.items() if name in ("roll", "pitch") and not np.nan_to_num(v).any()}
    kept = {name: v for name, v in pose.channels.items() if name not in planar}
    return Stream(pose.t, kept) if len(planar) == 2 else pose


def _frame_notes(source: TopicSource, topic: Topic) -> Iterable[str]:
    if source.frame:
        yield f"the readings of {topic.name} were turned into {source.frame}; where the sensor sits was not corrected."
    if topic.message_type == TRANSFORMS:
        yield f"the pose is that of {source.child} in {source.parent}."
