"""A bag as the readers give it: topics and a way to their messages, whatever the files behind it are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ddagr_gym.recordings.topic_map import Topic

Received = tuple[str, float, Any]
"""Topic, time of receipt [s] and decoded message."""


@dataclass(frozen=True)
class Bag:
    """Topics and messages of one drive.

    Attributes:
        path: file or folder that was given.
        topics: that it holds, with their numbers of messages.
        read: takes names of topics and gives their messages in the order of the files.
    """

    path: Path
    topics: tuple[Topic, ...]
    read: Callable[[Collection[str]], Iterator[Received]]


def joined(path: Path, parts: Iterable[Bag]) -> Bag:
    """One bag of several files.

    Args:
        path: of the whole.
        parts: in the order in which they were recorded.
    """
    bags = tuple(parts)
    counts: Counter[tuple[str, str]] = Counter()
    for bag in bags:
        for topic in bag.topics:
            counts[topic.name, topic.message_type] += max(topic.count, 0)

    def read(names: Collection[str]) -> Iterator[Received]:
        for bag in bags:
            yield from bag.read(names)

    return Bag(path, tuple(Topic(name, kind, count) for (name, kind), count in sorted(counts.items())), read)
