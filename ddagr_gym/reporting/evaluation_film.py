"""Small videos of turns for an evaluation's page."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.parameters import Robot
from ddagr_gym.rendering.render import SceneRenderer
from ddagr_gym.rendering.scene import scenes, turn_stage
from ddagr_gym.rendering.video import write_video

SIZE = (640, 480)
"""Of the pictures [px]."""

SCENES_PER_SECOND = 10.0
"""Of the drive; shown at 25 a second, so two and a half times as fast as it was."""

_QUALITY = 27
"""Constant rate factor of x264 (ours: a small file without visible blocks in lines and labels)."""

_POSTER_QUALITY = 70
"""Of the JPEG that stands for the video until it is played, of 100 (ours)."""


def film_turn(columns: Mapping[str, ArrayLike], turn: RowTurn, robot: Robot, path: Path, soil_name: str) -> bytes:
    """Write a video of a turn at two and a half times its speed.

    Args:
        columns: of the simulated drive; ``estimated_x``, ``estimated_y`` are drawn where present.
        turn: the commanded manoeuvre.
        robot: that drove.
        path: of the video, ``.mp4``, in a folder that exists.
        soil_name: second line of the panel.

    Returns:
        Its last picture as JPEG.

    Raises:
        InputError: the extra ``render`` is not installed, or the video cannot be written.
    """
    stage = turn_stage(turn, robot, soil_name)
    renderer = SceneRenderer(SIZE)
    last: list[Any] = []

    def drawn() -> Iterator[Any]:
        for scene in scenes(columns, stage, frame_rate=SCENES_PER_SECOND, side=turn.side):
            last[:] = [renderer.draw(scene)]
            yield last[0]

    try:
        write_video(path, drawn(), quality=_QUALITY)
    finally:
        renderer.close()
    return _jpeg(last[0])


def _jpeg(picture: Any) -> bytes:
    from PIL import Image  # comes with matplotlib

    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, format="jpeg", quality=_POSTER_QUALITY)
    return stream.getvalue()
