"""Coordinate frames of a bag (tf2): how sensors are mounted, and where the robot is in a map.

Transforms come as edges of a tree, from a frame to its parent. ``/tf_static`` holds those that never change.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice, takewhile
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.bag import Bag
from ddagr_gym.recordings.message_fields import field_of, number
from ddagr_gym.recordings.schema import FloatArray
from ddagr_gym.recordings.topic_map import TRANSFORMS, Topic

STATIC = "tf_static"
_MOST = 5000
"""Messages of /tf that are read for transforms that never change, where there is no /tf_static (ours)."""


class FrameTree:
    """Latest known transforms, (4, 4) matrices that take coordinates of a frame to those of its parent."""

    def __init__(self) -> None:
        self._edges: dict[str, tuple[str, FloatArray]] = {}
        self._static: set[str] = set()

    def add(self, message: Any, static: bool = False) -> bool:
        """Take a TransformStamped.

        Args:
            message: of geometry_msgs/TransformStamped.
            static: whether it comes from /tf_static.

        Returns:
            Whether it changed anything.
        """
        child = frame_name(field_of(message, "child_frame_id"))
        edge = frame_name(field_of(message, "header.frame_id")), _matrix(message)
        before = self._edges.get(child)
        self._edges[child] = edge
        if static:
            self._static.add(child)
        return before is None or before[0] != edge[0] or not np.array_equal(before[1], edge[1])

    def frames(self) -> set[str]:
        """Names of all frames."""
        return {*self._edges, *(parent for parent, _ in self._edges.values())}

    def chain(self, frame: str) -> tuple[str, ...]:
        """The frame and those above it, upward to the root."""
        found = [frame]
        while found[-1] in self._edges and len(found) <= len(self._edges):
            found.append(self._edges[found[-1]][0])
        return tuple(found)

    def moving(self, child: str, parent: str) -> tuple[str, ...]:
        """Frames between both whose transform to the next one up is not from /tf_static, upward; () where unknown."""
        chain = self.chain(child)
        if parent not in chain:
            return ()
        return tuple(frame for frame in chain[: chain.index(parent)] if frame not in self._static)

    def unknown_rotations(self) -> tuple[str, ...]:
        """Frames whose rotation to the next one up is not known."""
        return tuple(name for name, (_, matrix) in self._edges.items() if not np.isfinite(matrix[:3, :3]).all())

    def between(self, frame: str, other: str) -> FloatArray | None:
        """Matrix (4, 4) that takes coordinates of ``frame`` to those of ``other``; None where nothing connects them."""
        up, down = self.chain(frame), self.chain(other)
        if up[-1] != down[-1]:
            return None
        # what is above both may not be known
        shared = next(name for name in up if name in down)
        below = np.linalg.inv(self._to(shared, down))
        return np.asarray(below @ self._to(shared, up))

    def _to(self, top: str, chain: tuple[str, ...]) -> FloatArray:
        total = np.eye(4)
        for frame in chain[: chain.index(top)]:
            total = self._edges[frame][1] @ total
        return total


def frame_name(name: Any) -> str:
    """Name of a frame without the slash that ROS 1 allowed before it; "" for none."""
    return str(name or "").lstrip("/")


def transforms(message: Any) -> Iterator[Any]:
    """Transforms in a tf2_msgs/TFMessage."""
    yield from field_of(message, "transforms") or ()


def static_frames(bag: Bag, near: str) -> FrameTree:
    """Transforms of /tf_static.

    Args:
        bag: any.
        near: topic that needs them; of several robots' trees the one whose name has most in common with it is taken.
    """
    return _tree(bag, transform_topic(bag.topics, near, static=True))


def mounting_frames(bag: Bag, near: str) -> FrameTree:
    """As :func:`static_frames`, from the first transforms of /tf where a bag has no /tf_static."""
    topic = transform_topic(bag.topics, near, static=True)
    return _tree(bag, topic) if topic else _tree(bag, transform_topic(bag.topics, near), _MOST)


def _tree(bag: Bag, topic: Topic | None, most: int | None = None) -> FrameTree:
    tree = FrameTree()
    if topic is not None:
        for _, _, message in islice(bag.read({topic.name}), most):
            for transform in transforms(message):
                tree.add(transform, static=True)
    return tree


def transform_topic(topics: tuple[Topic, ...], near: str, static: bool = False) -> Topic | None:
    """The topic /tf, or /tf_static, that belongs to another topic; None where there is none."""
    found = [t for t in topics if t.message_type == TRANSFORMS and t.count and t.name.endswith(STATIC) == static]
    return max(found, key=lambda topic: _shared(topic.name, near), default=None)


def _shared(one: str, other: str) -> int:
    """Number of parts that two topics' names have in common at their beginning."""
    pairs = zip(one.strip("/").split("/"), other.strip("/").split("/"), strict=False)
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))


def turned_into(frame: str, tree: FrameTree, file_name: str) -> Callable[[Any], FloatArray]:
    """Function that gives the rotation (3, 3) from a message's frame into ``frame``.

    Args:
        frame: of the robot's body, "base_link".
        tree: transforms that do not change.
        file_name: for the message.

    Raises:
        InputError: at a message whose frame does not hang together with ``frame``, or by a rotation that is not known.
    """
    known: dict[str, FloatArray] = {}

    def rotation(message: Any) -> FloatArray:
        source = frame_name(field_of(message, "header.frame_id"))
        if source not in known:
            matrix = tree.between(source, frame)
            if matrix is None:
                raise InputError(
                    f"{file_name} has no transform from {source!r} to {frame!r} (it knows "
                    f"{', '.join(sorted(tree.frames())[:12]) or 'none'}): correct or leave out frame in the topic map."
                )
            if not np.isfinite(matrix[:3, :3]).all():
                raise InputError(
                    f"the rotation of {' or '.join(map(repr, tree.unknown_rotations()))} to the frame above in "
                    f"{file_name} has no quaternion of length 1 (all zeros mean that it is not known): correct it, or "
                    "leave out frame in the topic map."
                )
            known[source] = matrix[:3, :3]
        return known[source]

    return rotation


def _matrix(message: Any) -> FloatArray:
    quaternion = np.array([number(message, f"transform.rotation.{axis}") for axis in "xyzw"])
    matrix = np.eye(4)
    matrix[:3, 3] = [number(message, f"transform.translation.{axis}") for axis in "xyz"]
    norm = np.linalg.norm(quaternion)
    matrix[:3, :3] = Rotation.from_quat(quaternion / norm).as_matrix() if 0.5 < norm < 2.0 else np.nan
    return matrix
