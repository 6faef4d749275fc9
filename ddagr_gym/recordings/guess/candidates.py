"""What a bag's topics could be: one candidate for each reading of a topic that a topic map can express."""

from __future__ import annotations

import glob
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.bag import Bag
from ddagr_gym.recordings.files import Limits
from ddagr_gym.recordings.frames import FrameTree, frame_name, mounting_frames, transform_topic, transforms
from ddagr_gym.recordings.guess.names import in_namespace, namespaces
from ddagr_gym.recordings.message_fields import field_of
from ddagr_gym.recordings.ros_messages import Extractor, joint_speeds
from ddagr_gym.recordings.schema import FloatArray, RobotGeometry
from ddagr_gym.recordings.streams import Samples, collect, topic_extractor
from ddagr_gym.recordings.topic_map import ROLE_TYPES, TRANSFORMS, Topic, TopicSource

BODIES = ("base_link", "base_footprint", "base", "body", "chassis_link")
"""Usual names of the robot's frame, REP 105's first."""
WORLDS = ("map", "utm", "world", "earth", "odom")
"""Usual names of frames in which a pose is given (REP 105), those without drift first."""
STAND_IN = RobotGeometry("", 0.2, 0.4)
"""Wheel radius and half track where no robot is named (ours): signs and correlations do not depend on them."""
_TURNED = 0.02
"""Largest entry of a rotation less the identity from which an IMU counts as mounted askew [-] (ours): a degree."""


@dataclass(frozen=True)
class Candidate:
    """A way to read a topic in a role.

    Attributes:
        role: of :data:`~ddagr_gym.recordings.topic_map.ROLE_TYPES`.
        topic: of the bag.
        source: entry of the topic map.
        samples: what the topic gives when it is read so; speeds of single joints for wheels.
        frame: of the first message, or the frame in which a pose is given; "" for none.
    """

    role: str
    topic: Topic
    source: TopicSource
    samples: Samples
    frame: str

    @property
    def rate(self) -> float:
        """Samples per second (median) [Hz]; 0 for fewer than two."""
        return rate_of(self.samples)

    @property
    def label(self) -> str:
        """Topic, with the frames where they matter."""
        frames = f" ({self.source.child} in {self.source.parent})" if self.source.parent else ""
        return f"{self.topic.name}{frames}"


@dataclass(frozen=True)
class Contents:
    """What a bag holds.

    Attributes:
        bag: it.
        topics: of one robot.
        candidates: in the order of roles and topics.
        stamps: "header" or "receive", whichever is common to the candidates.
        frames: of the first message, by topic.
        why_receive: why header stamps are not used; "" where they are.
    """

    bag: Bag
    topics: tuple[Topic, ...]
    candidates: tuple[Candidate, ...]
    stamps: Literal["header", "receive"]
    frames: dict[str, str]
    why_receive: str = ""

    def of(self, role: str) -> list[Candidate]:
        """Candidates of a role that have samples."""
        return [c for c in self.candidates if c.role == role and len(c.samples.t) >= 2]


def rate_of(samples: Samples) -> float:
    """Samples per second (median) [Hz]; 0 for fewer than two."""
    steps = np.diff(np.unique(np.array(samples.t)))
    return float(1.0 / np.median(steps)) if steps.size else 0.0


def contents(bag: Bag, geometry: RobotGeometry | None, limits: Limits, namespace: str = "") -> Contents:
    """Read everything that could be a channel, in one pass.

    Args:
        bag: open.
        geometry: robot's; where None, commands are read with a stand-in.
        limits: on the number of messages.
        namespace: of the robot, in a bag of several.

    Raises:
        InputError: no messages, no type that can be read, or several robots.
    """
    topics = _topics_of_one_robot(bag, namespace)
    firsts = _first_messages(bag, [t for t in topics if _is_readable(t)])
    frames = {name: frame_name(field_of(first, "header.frame_id")) for name, first in firsts.items()}
    readings = [
        (role, topic, source)
        for role, kinds in ROLE_TYPES.items()
        for topic in topics
        if topic.message_type in kinds and topic.name in firsts
        for source in _sources(role, topic, bag, frames)
    ]
    extractors = {
        number: (topic.name, _extractor(bag, topic, source, geometry or STAND_IN))
        for number, (_, topic, source) in enumerate(readings)
    }
    samples = collect(bag, extractors, True, limits)
    why_receive = _why_not_header(bag, [(readings[k][1], found) for k, found in samples.items()])
    if why_receive:
        samples = collect(bag, extractors, False, limits)
    candidates = tuple(
        Candidate(role, topic, source, samples[k], frame_name(source.parent) or frames[topic.name])
        for k, (role, topic, source) in enumerate(readings)
    )
    return Contents(bag, topics, candidates, "receive" if why_receive else "header", frames, why_receive)


def _topics_of_one_robot(bag: Bag, namespace: str) -> tuple[Topic, ...]:
    """Topics of the namespace, or all.

    Raises:
        InputError: see :func:`contents`.
    """
    name = bag.path.name
    if not any(topic.count for topic in bag.topics):
        raise InputError(f"{name} holds no messages ({len(bag.topics)} topics): record the drive again.")
    several = namespaces(bag.topics)
    if namespace:
        topics = tuple(topic for topic in bag.topics if in_namespace(topic, namespace))
        if not any(_is_readable(topic) and topic.message_type != TRANSFORMS for topic in topics):
            known = ", ".join(f"/{n}" for n in several) or "none that repeats"
            raise InputError(f"{name} has no topic of a known type below {namespace!r}: its namespaces are {known}.")
        return topics
    if several:
        raise InputError(
            f"{name} holds topics of {len(several)} robots, {', '.join(f'/{n}' for n in several)}: choose one of them "
            f"with --namespace /{several[0]}."
        )
    if not any(_is_readable(topic) for topic in bag.topics):
        kinds = sorted({topic.message_type for topic in bag.topics if topic.count})
        raise InputError(
            f"{name} holds no message that is read here, only {', '.join(kinds[:8])}: record Imu, JointState, Twist "
            "and Odometry messages."
        )
    return bag.topics


def _is_readable(topic: Topic) -> bool:
    return topic.count != 0 and any(topic.message_type in kinds for kinds in ROLE_TYPES.values())


def _first_messages(bag: Bag, topics: Sequence[Topic]) -> dict[str, Any]:
    """First message of each topic; the first transform of each that holds such."""
    found: dict[str, Any] = {}
    for topic, _, message in bag.read({t.name for t in topics}):
        if topic not in found:
            found[topic] = message
            if len(found) == len(topics):
                break
    return found


def _sources(role: str, topic: Topic, bag: Bag, frames: dict[str, str]) -> Iterator[TopicSource]:
    """Entries of a topic map that would read the topic in that role."""
    if role == "imu":
        yield TopicSource(topic=topic.name)
        body = _askew_to(mounting_frames(bag, topic.name), frames[topic.name])
        if body:
            yield TopicSource(topic=topic.name, frame=body)
    elif topic.message_type == TRANSFORMS:
        for parent, child in _poses_in(bag, topic):
            yield TopicSource(topic=topic.name, parent=parent, child=child, optional=True)
    else:
        yield TopicSource(topic=topic.name, optional=role in ("command", "pose"))


def _askew_to(tree: FrameTree, frame: str) -> str:
    """Frame of the body against which a sensor's is turned; "" where it is not, or where that is unknown."""
    for body in BODIES:
        matrix = tree.between(frame, body) if {body, frame} <= tree.frames() else None
        if matrix is not None:
            return body if np.max(np.abs(matrix[:3, :3] - np.eye(3))) > _TURNED else ""
    return ""


def _poses_in(bag: Bag, topic: Topic) -> Iterator[tuple[str, str]]:
    """World and body frames that a tree of transforms connects."""
    if topic != transform_topic(bag.topics, topic.name):
        return
    tree = mounting_frames(bag, topic.name)
    for number, (_, _, message) in enumerate(bag.read({topic.name})):
        for transform in transforms(message):
            tree.add(transform)
        if number > 1000:  # a tree is complete long before (ours)
            break
    body = next((name for name in BODIES if name in tree.frames()), "")
    for world in WORLDS:
        if body and world in tree.chain(body):
            yield world, body


def _extractor(bag: Bag, topic: Topic, source: TopicSource, geometry: RobotGeometry) -> Extractor:
    if topic.message_type == "JointState":
        return joint_speeds()
    return topic_extractor(bag, topic, source, geometry)


def _why_not_header(bag: Bag, found: Sequence[tuple[Topic, Samples]]) -> str:
    """Why header stamps cannot be used; "" where they can.

    Raises:
        InputError: times of receipt cannot be used either.
    """
    for topic, samples in found:
        if 0 < samples.stamped < len(samples.t):
            return f"{topic.name} has header stamps in {samples.stamped} of {len(samples.t)} messages only"
    for topic, samples in found:
        step = samples.step_back()
        if step is not None and step.received_too:
            raise step.refusal(f"{bag.path.name}, {topic.name}")
        if step is not None:
            return f"the header stamps of {topic.name} go back by {step.fall:.4g} s"
    return _by_two_clocks([(topic, samples) for topic, samples in found if len(samples.t) >= 2])


def _by_two_clocks(found: Sequence[tuple[Topic, Samples]]) -> str:
    """Which topics were recorded together and have no stamps in common; "" for none."""
    if not found:
        return ""
    longest, most = max(found, key=lambda pair: max(pair[1].t) - min(pair[1].t))
    for topic, samples in found:
        if _meet(samples.received, most.received) and not _meet(samples.t, most.t):
            return f"{_stamps_of(topic, samples)} and {_stamps_of(longest, most)} have no time in common"
    return ""


def _meet(one: Sequence[float], other: Sequence[float]) -> bool:
    return min(one) <= max(other) and min(other) <= max(one)


def _stamps_of(topic: Topic, samples: Samples) -> str:
    """What places a topic's samples in time, in words."""
    if samples.stamped:
        return f"the header stamps of {topic.name}"
    return f"the times of receipt of {topic.name}, which has no others,"


def as_wheels(candidate: Candidate, right: Sequence[str], left: Sequence[str]) -> Candidate:
    """A candidate for the wheels whose samples are the banks' mean speeds, of messages that have both.

    Args:
        candidate: with speeds of single joints.
        right: joints of the right bank.
        left: likewise.
    """
    speeds = {name: np.array(values) for name, values in candidate.samples.values.items()}
    banks = {
        "encoder_right": _mean_of_known([speeds[joint] for joint in right]),
        "encoder_left": _mean_of_known([speeds[joint] for joint in left]),
    }
    samples = candidate.samples.only(np.isfinite(banks["encoder_right"] + banks["encoder_left"]), banks)
    source = replace(candidate.source, right=tuple(map(_pattern, right)), left=tuple(map(_pattern, left)))
    return replace(candidate, source=source, samples=samples)


def _mean_of_known(columns: Sequence[FloatArray]) -> FloatArray:
    """Mean of those that are known in each row; NaN where none is."""
    known = np.isfinite(columns)
    with np.errstate(invalid="ignore"):
        mean: FloatArray = np.where(known, columns, 0.0).sum(axis=0) / known.sum(axis=0)
    return mean


def _pattern(joint: str) -> str:
    """Pattern that only this joint matches."""
    return glob.escape(joint)
