"""Poses, frames and paths of a drive as messages of Foxglove."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.location import Place
from ddagr_gym.diagnosis.answer.verdict import Diagnosis
from ddagr_gym.rendering import palette
from ddagr_gym.viewers.annotations import Annotation
from ddagr_gym.viewers.drive_traces import CORRECTED, MODELS, POSE, DriveTraces
from ddagr_gym.viewers.mcap_messages import WORLD, Message, nanoseconds, timestamp

if TYPE_CHECKING:
    import foxglove
    from foxglove import messages

Array = NDArray[np.float64]

COLOURS = {
    "measured": palette.GREEN,
    "nominal": "#9AA1A8",
    "refitted": palette.VERMILLION,
    "corrected": palette.SKY_BLUE,
}
"""Of the page, but for those that cannot be seen on a dark ground."""

_LEVELS = {name: 0.01 * level for level, name in enumerate(COLOURS)}
"""Heights of the paths [m], so that none hides another (ours)."""

_PATH, _STRETCH = 2.0, 7.0
"""Widths of lines [pixels]."""

_FONT = 14.0
"""Height of texts [pixels]."""


class PoseTopics:
    """Topics with places: the robot's frames, its poses, the paths, and findings where they show.

    Args:
        context: of the writer.
    """

    def __init__(self, context: foxglove.Context) -> None:
        from foxglove.channels import FrameTransformChannel, PoseInFrameChannel, SceneUpdateChannel

        self._frames = FrameTransformChannel("/tf", context=context)
        self._poses = {name: PoseInFrameChannel(f"/pose/{name}", context=context) for name in COLOURS}
        self._paths = SceneUpdateChannel("/paths", context=context)
        self._findings = SceneUpdateChannel("/findings/scene", context=context)

    def motion(self, drive: DriveTraces) -> list[Iterator[Message]]:
        """Streams of poses and frames of one drive, measured and by each model."""
        poses = {"measured": drive.measured[:, POSE], **{name: drive.predictions[name][:, POSE] for name in MODELS}}
        return [self._moved(drive, name, values) for name, values in poses.items()]

    def _moved(self, drive: DriveTraces, name: str, poses: Array) -> Iterator[Message]:
        from foxglove.messages import FrameTransform, Pose, PoseInFrame, Vector3

        for row in np.flatnonzero(np.isfinite(poses).all(axis=1)).tolist():
            ns = nanoseconds(drive, float(drive.time[row]))
            (x, y, yaw), stamp = poses[row].tolist(), timestamp(ns)
            place, turn = Vector3(x=x, y=y, z=0.0), _turn(yaw)
            frame = FrameTransform(
                timestamp=stamp, parent_frame_id=WORLD, child_frame_id=f"base_link_{name}", translation=place,
                rotation=turn,
            )  # fmt: skip
            pose = PoseInFrame(timestamp=stamp, frame_id=WORLD, pose=Pose(position=place, orientation=turn))
            yield ns, 1, _both(self._frames, frame, self._poses[name], pose)

    def scene(self, diagnosis: Diagnosis, drive: DriveTraces, found: Sequence[Annotation]) -> Iterator[Message]:
        """Paths and findings of one drive, in place of those of the drive before, in one message each.

        One message is what a viewer has after a jump in time, so that the whole drive is always seen.
        """
        from foxglove.messages import SceneEntityDeletion, SceneEntityDeletionType, SceneUpdate

        ns = nanoseconds(drive, float(drive.recording.t[0]))
        stamp = timestamp(ns)
        gone = [SceneEntityDeletion(timestamp=stamp, type=SceneEntityDeletionType.All)]
        paths = [_path_entity(stamp, name, pieces) for name, pieces in drive.paths.items()]
        marks = [*_stretch_entities(stamp, drive, found), *_place_entities(stamp, diagnosis)]
        yield ns, 0, _both(
            self._paths, SceneUpdate(deletions=gone, entities=paths),
            self._findings, SceneUpdate(deletions=gone, entities=marks),
        )  # fmt: skip


def _both(first: object, one: object, second: object, other: object) -> Callable[[int], None]:
    """Logs a message on each of two topics."""

    def send(stamp: int) -> None:
        first.log(one, log_time=stamp)  # type: ignore[attr-defined]
        second.log(other, log_time=stamp)  # type: ignore[attr-defined]

    return send


def _turn(yaw: float) -> messages.Quaternion:
    from foxglove.messages import Quaternion

    return Quaternion(x=0.0, y=0.0, z=float(np.sin(0.5 * yaw)), w=float(np.cos(0.5 * yaw)))


def _pose(x: float, y: float, z: float, yaw: float = 0.0) -> messages.Pose:
    """Place, turned about the vertical."""
    from foxglove.messages import Pose, Vector3

    return Pose(position=Vector3(x=x, y=y, z=z), orientation=_turn(yaw))


def _colour(code: str, opacity: float = 1.0) -> messages.Color:
    from foxglove.messages import Color

    red, green, blue = (value / 255.0 for value in palette.rgb(code))
    return Color(r=red, g=green, b=blue, a=opacity)


def _line(points: Array, colour: messages.Color, width: float, level: float) -> messages.LinePrimitive:
    """Line through places (n, 2), as wide everywhere on the screen."""
    from foxglove.messages import LinePrimitive, LinePrimitiveLineType, Point3

    return LinePrimitive(
        type=LinePrimitiveLineType.LineStrip, pose=_pose(0.0, 0.0, level), thickness=width, scale_invariant=True,
        points=[Point3(x=x, y=y, z=0.0) for x, y in points.tolist()], color=colour,
    )  # fmt: skip


def _text(text: str, x: float, y: float) -> messages.TextPrimitive:
    """Text above a place, as large everywhere on the screen."""
    from foxglove.messages import TextPrimitive

    return TextPrimitive(
        pose=_pose(x, y, 0.3), billboard=True, font_size=_FONT, scale_invariant=True, color=_colour(palette.ORANGE),
        text=text,
    )  # fmt: skip


def _path_entity(stamp: messages.Timestamp, name: str, pieces: Sequence[Array]) -> messages.SceneEntity:
    from foxglove.messages import SceneEntity

    lines = [_line(piece[:, :2], _colour(COLOURS[name]), _PATH, _LEVELS[name]) for piece in pieces if len(piece) > 1]
    return SceneEntity(timestamp=stamp, frame_id=WORLD, id=name, lines=lines)


def _stretch_entities(
    stamp: messages.Timestamp, drive: DriveTraces, found: Sequence[Annotation]
) -> list[messages.SceneEntity]:
    """A thick line and a text for each stretch; one text at the start for all that shows in the whole drive."""
    from foxglove.messages import SceneEntity

    places = drive.predictions[CORRECTED][:, POSE[:2]]
    known = np.isfinite(places).all(axis=1)
    entities = []
    everywhere = [f"{item.text}, {item.stretch}" for item in found if not item.located]
    if everywhere and known.any():
        text = _text("\n".join(everywhere), *_first(places[known]))
        entities.append(SceneEntity(timestamp=stamp, frame_id=WORLD, id="whole drive", texts=[text]))
    for number, item in enumerate((item for item in found if item.located), 1):
        rows = known & (drive.time >= item.start) & (drive.time <= item.end)
        if rows.any():
            line = _line(places[rows], _colour(palette.ORANGE, 0.6), _STRETCH, -0.01)
            text = _text(f"{item.text}, {item.stretch}", *_first(places[rows]))
            name = f"stretch {number}"
            entities.append(SceneEntity(timestamp=stamp, frame_id=WORLD, id=name, lines=[line], texts=[text]))
    return entities


def _first(places: Array) -> tuple[float, float]:
    """First of (n, 2) places."""
    return float(places[0, 0]), float(places[0, 1])


def _place_entities(stamp: messages.Timestamp, diagnosis: Diagnosis) -> list[messages.SceneEntity]:
    """A disc or a band, and a text, for each place that a finding is bound to."""
    from foxglove.messages import SceneEntity

    entities = []
    for finding in diagnosis.findings:
        for number, place in enumerate(() if finding.where is None else finding.where.places):
            text = _text(finding.name, place.x, place.y)
            name = f"{finding.name} place {number + 1}"
            entities.append(SceneEntity(timestamp=stamp, frame_id=WORLD, id=name, texts=[text], **_shape(place)))
    return entities


def _shape(place: Place) -> dict[str, Any]:
    """The primitives of a disc, or of a band."""
    from foxglove.messages import CubePrimitive, CylinderPrimitive, Vector3

    pose, colour = _pose(place.x, place.y, -0.02, place.bearing), _colour(palette.PALE_ORANGE, 0.4)
    length = 2.0 * (place.half_length + place.radius)
    size = Vector3(x=length, y=2.0 * place.radius, z=0.01)
    if place.half_length > 0.0:
        return {"cubes": [CubePrimitive(pose=pose, size=size, color=colour)]}
    return {"cylinders": [CylinderPrimitive(pose=pose, size=size, bottom_scale=1.0, top_scale=1.0, color=colour)]}
