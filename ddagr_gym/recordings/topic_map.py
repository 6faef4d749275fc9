"""Topic maps: which topics of a bag hold which sensor, written in YAML; by message type where none is named.

The shipped default is ``configs/recordings/topics_default.yaml``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from ddagr_gym.config import find_config, load_config
from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.recordings.channels import CHANNELS
from ddagr_gym.recordings.column_map import FOLDER

ROLE_TYPES: Mapping[str, tuple[str, ...]] = {
    "imu": ("Imu",),
    "wheels": ("JointState",),
    "command": ("TwistStamped", "Twist"),
    "pose": ("Odometry", "PoseStamped", "PoseWithCovarianceStamped", "NavSatFix", "TFMessage"),
}
"""Message types that can fill a role, the preferred one first."""

TRANSFORMS = "TFMessage"
"""Type of /tf and /tf_static."""
NAMED_ONLY = ("PoseWithCovarianceStamped", TRANSFORMS)
"""Types that fill a role only where a map names the topic: an initial pose and trees of frames are in most bags."""


@dataclass(frozen=True)
class TopicSource:
    """Topic of one role.

    Attributes:
        topic: its name, "" to take the only topic of a fitting type.
        optional: whether a bag may lack it.
        right: patterns of the right wheels' joint names (``*`` and ``?``; case does not matter).
        left: the same for the left wheels.
        orientation: whether roll and pitch are taken from an Imu message.
        frame: of the robot's body ("base_link"), into which an Imu's readings are turned by the bag's /tf_static; ""
            takes them as they are.
        parent: frame in which transforms (/tf) give the pose ("map").
        child: frame whose pose they give ("base_link").
    """

    topic: str = ""
    optional: bool = False
    right: tuple[str, ...] = ("*right*",)
    left: tuple[str, ...] = ("*left*",)
    orientation: bool = False
    frame: str = ""
    parent: str = ""
    child: str = ""


@dataclass(frozen=True)
class TopicMap:
    """Meaning of a bag's topics.

    Attributes:
        topics: source by role of :data:`ROLE_TYPES`.
        base: role whose stamps are the rows; only its range counts where ``rate`` is given.
        rate: rows per second [Hz] of a regular time base, 0 to use the stamps of ``base``.
        tolerance: largest distance between a sample and its row, in periods.
        stamps: header stamps where messages have one, or the times of receipt.
        signs: -1 by channel name for axes that point the other way.
        robot: robot to assume where none is named.
        description: for people.
        name: of the map; the file's name where absent.

    Raises:
        InputError: unknown roles or channels, or values out of range.
    """

    topics: Mapping[str, TopicSource]
    base: str = "imu"
    rate: float = 0.0
    tolerance: float = 0.5
    stamps: Literal["header", "receive"] = "header"
    signs: Mapping[str, Literal[1, -1]] = field(default_factory=dict)
    robot: str = ""
    description: str = field(default="", compare=False)
    name: str = ""

    def __post_init__(self) -> None:
        for role in self.topics:
            if role not in ROLE_TYPES:
                raise unknown_name("role under topics", role, ROLE_TYPES)
        if self.base not in self.topics:
            raise unknown_name("base (a role under topics)", self.base, self.topics)
        if not 0 <= self.rate <= 1e4:
            raise InputError(f"rate is {self.rate:g} Hz: give 0 to 10000.")
        if not 0.01 <= self.tolerance <= 10:
            raise InputError(f"tolerance is {self.tolerance:g} periods: give 0.01 to 10.")
        for channel in self.signs:
            if channel not in CHANNELS:
                raise unknown_name("channel under signs", channel, CHANNELS)


@dataclass(frozen=True)
class Topic:
    """One topic of a bag: name, message type without its package, and number of messages (-1 if unknown)."""

    name: str
    message_type: str
    count: int


def load_topic_map(name: str) -> TopicMap:
    """Shipped topic map by name, or one's own by the path of its ``.yaml`` file.

    Raises:
        InputError: no such map, or one that does not parse.
    """
    path = find_config(FOLDER, name)
    topic_map = load_config(path, TopicMap)
    return topic_map if topic_map.name else replace(topic_map, name=path.stem)


def choose_topics(topic_map: TopicMap, topics: tuple[Topic, ...], file_name: str) -> dict[str, Topic]:
    """Topic of every role that a bag can fill.

    Args:
        topic_map: what is wanted.
        topics: what the bag has.
        file_name: for messages.

    Raises:
        InputError: a required role without a topic, or several candidates; the sentence lists what is there.
    """
    chosen = {}
    for role, source in topic_map.topics.items():
        topic = _named(role, source, topics, file_name) if source.topic else _by_type(role, source, topics, file_name)
        if topic is not None:
            chosen[role] = topic
    return chosen


def listing(topics: tuple[Topic, ...]) -> str:
    """Topics as one line of text: name (type, messages)."""
    shown = [f"{t.name} ({t.message_type}{f', {t.count}' if t.count >= 0 else ''})" for t in topics[:40]]
    more = f" and {len(topics) - 40} more" if len(topics) > 40 else ""
    return (", ".join(shown) + more) if shown else "nothing"


def _named(role: str, source: TopicSource, topics: tuple[Topic, ...], file_name: str) -> Topic | None:
    for topic in topics:
        if topic.name == source.topic:
            if topic.message_type not in ROLE_TYPES[role]:
                raise InputError(
                    f"{file_name}: the topic {topic.name} for {role} is of type {topic.message_type}; name one of "
                    f"type {' or '.join(ROLE_TYPES[role])}, the bag holds {listing(topics)}."
                )
            return topic
    if source.optional:
        return None
    raise InputError(
        f"{file_name} lacks the topic {source.topic} for {role}; it holds {listing(topics)}: correct the map."
    )


def _by_type(role: str, source: TopicSource, topics: tuple[Topic, ...], file_name: str) -> Topic | None:
    for message_type in (kind for kind in ROLE_TYPES[role] if kind not in NAMED_ONLY):
        found = tuple(t for t in topics if t.message_type == message_type and t.count != 0)
        if len(found) == 1:
            return found[0]
        if found:
            raise InputError(
                f"{file_name} has several topics of type {message_type} for {role}, {listing(found)}: name one in a "
                f"topic map under topics, {role}, topic."
            )
    if source.optional:
        return None
    raise InputError(
        f"{file_name} has no topic of type {' or '.join(ROLE_TYPES[role])} for {role}; it holds {listing(topics)}: "
        "name one in a topic map or mark the role optional."
    )
