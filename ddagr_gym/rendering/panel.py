"""The panel beside the field: numbers and bars of a scene as lists of boxes and texts, in pixels of the picture."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

from ddagr_gym.errors import InputError
from ddagr_gym.rendering import palette
from ddagr_gym.rendering.scene import Scene

Align = Literal["left", "right", "centre"]

WIDTH = 264.0
"""Width of the panel at a picture height of 720; all measures below are for that height."""

MARGIN, LINE, LEGEND_TOP, HEIGHT = 22.0, 20.0, 632.0, 720.0
"""Left margin, distance of lines, top of the legend and whole height [pixels] (ours: the layout)."""

RADIUS_SPAN = 0.25
"""Relative radius error at the ends of its gauge."""

SINKAGE_SPAN = 0.05
"""Sinkage of a full bar [m]."""

WHEELS = (("front left", 1, 0, 0), ("front right", 0, 1, 0), ("rear left", 3, 0, 1), ("rear right", 2, 1, 1))
"""Name, index, column and row of the wheels, laid out as seen from above."""


@dataclass(frozen=True)
class Box:
    """Filled rectangle (x, y, width, height) with rounded corners [px]."""

    x: float
    y: float
    width: float
    height: float
    colour: str
    corner: float = 0.0


@dataclass(frozen=True)
class Text:
    """Line of text with its baseline at y [px]; ``size`` is the height of the font [px]."""

    x: float
    y: float
    content: str
    size: float
    colour: str = palette.INK
    align: Align = "left"
    width: float = math.inf


@dataclass
class Drawing:
    """Boxes and texts collected in units of a 720 pixel picture and kept in real pixels."""

    left: float
    unit: float
    boxes: list[Box] = field(default_factory=list)
    texts: list[Text] = field(default_factory=list)

    def box(self, x: float, y: float, width: float, height: float, colour: str, corner: float = 0.0) -> None:
        """Add a box; x counts from the panel's left edge."""
        u = self.unit
        self.boxes.append(Box(self.left + x * u, y * u, width * u, height * u, colour, corner * u))

    def text(
        self, x: float, y: float, content: str, size: float = 12.0, colour: str = palette.INK, align: Align = "left",
        width: float = math.inf,
    ) -> None:  # fmt: skip
        """Add a text; longer ones than ``width`` are cut with dots."""
        u = self.unit
        self.texts.append(Text(self.left + x * u, y * u, content, size * u, colour, align, width * u))


def signed(value: float, decimals: int, unit: str = "") -> str:
    """Number with a true minus sign, and its unit after a space."""
    text = f"{value:.{decimals}f}"
    text = text.removeprefix("-") if float(text) == 0.0 else text
    return text.replace("-", "−") + (f" {unit}" if unit else "")


def lay_out_panel(scene: Scene, left: float, unit: float) -> Drawing:
    """Everything of the panel for one scene.

    Args:
        scene: what to show.
        left: x of the panel's left edge [px].
        unit: pixels per unit of a 720 pixel picture.

    Raises:
        InputError: more metric lines than fit.
    """
    drawing = Drawing(left, unit)
    _title(drawing, scene)
    top = _radius(drawing, scene, 96.0) if scene.stage.target_radius is not None else 96.0
    top = _bank_speeds(drawing, scene, top)
    top = _wheels(drawing, scene, top)
    _metrics(drawing, scene, top)
    _legend(drawing, scene)
    return drawing


def _rule(drawing: Drawing, y: float) -> None:
    drawing.box(MARGIN, y, WIDTH - 2 * MARGIN, 1.0, palette.HAIRLINE)


def _heading(drawing: Drawing, y: float, name: str, unit: str = "") -> None:
    drawing.text(MARGIN, y, name, 12.0, palette.GREY)
    if unit:
        drawing.text(WIDTH - MARGIN, y, unit, 12.0, palette.GREY, "right")


def _title(drawing: Drawing, scene: Scene) -> None:
    stage, inside = scene.stage, WIDTH - 2 * MARGIN
    drawing.text(MARGIN, 40.0, stage.title, 18.0, width=inside - 76.0)
    drawing.text(WIDTH - MARGIN, 40.0, signed(scene.time, 1, "s"), 18.0, align="right")
    drawing.text(MARGIN, 61.0, f"{stage.robot.name} on {stage.soil_name}", 12.0, palette.GREY, width=inside)
    _rule(drawing, 76.0)


def _radius(drawing: Drawing, scene: Scene, top: float) -> float:
    target = scene.stage.target_radius or 0.0
    _heading(drawing, top + 8.0, "Turn radius", f"target {target:.2f} m")
    error = None if scene.radius is None else (scene.radius - target) / target
    drawing.text(MARGIN, top + 38.0, "–" if scene.radius is None else f"{scene.radius:.3f} m", 25.0)
    if error is not None:
        sign = "+" if error >= 0 else ""
        drawing.text(WIDTH - MARGIN, top + 38.0, sign + signed(100.0 * error, 1, "%"), 16.0, align="right")
    left, right, y = MARGIN, WIDTH - MARGIN, top + 60.0
    drawing.box(left, y, right - left, 2.0, palette.PALE, 1.0)
    for share in (-1.0, -0.5, 0.0, 0.5, 1.0):
        x = (left + right) / 2.0 + share * (right - left - 2.0) / 2.0
        tall = 12.0 if share == 0.0 else 7.0
        drawing.box(x - 0.75, y + 1.0 - tall / 2.0, 1.5, tall, palette.TARGET if share == 0.0 else palette.PALE)
    if error is not None:
        x = (left + right) / 2.0 + max(-1.0, min(1.0, error / RADIUS_SPAN)) * (right - left - 10.0) / 2.0
        drawing.box(x - 5.0, y - 4.0, 10.0, 10.0, palette.TRUE, 5.0)
    drawing.text(left, y + 19.0, f"−{100 * RADIUS_SPAN:.0f} %", 10.0, palette.GREY)
    drawing.text(right, y + 19.0, f"+{100 * RADIUS_SPAN:.0f} %", 10.0, palette.GREY, "right")
    _rule(drawing, top + 94.0)
    return top + 112.0


def _bar(drawing: Drawing, x: float, y: float, width: float, share: float, colour: str, centred: bool) -> None:
    """Bar of ``share`` of its width; a centred one grows from its middle to either side, -1 to 1."""
    drawing.box(x, y, width, 8.0, palette.HAIRLINE, 2.0)
    share = max(-1.0 if centred else 0.0, min(1.0, share))
    start, length = (x + width / 2.0, share * width / 2.0) if centred else (x, share * width)
    drawing.box(min(start, start + length), y, abs(length), 8.0, colour, 2.0)
    if centred:
        drawing.box(x + width / 2.0 - 0.5, y - 2.0, 1.0, 12.0, palette.GREY)


def _bank_speeds(drawing: Drawing, scene: Scene, top: float) -> float:
    _heading(drawing, top + 8.0, "Bank speed", "rad/s")
    fastest = scene.stage.robot.maximum_wheel_speed
    rows = zip(("left", "right"), (1, 0), (palette.LEFT, palette.RIGHT), strict=True)
    for line, (name, bank, colour) in enumerate(rows):
        y = top + 32.0 + 26.0 * line
        x, width = MARGIN + 40.0, WIDTH - 2 * MARGIN - 92.0
        drawing.text(MARGIN, y, name, 12.0)
        _bar(drawing, x, y - 8.0, width, scene.wheel_speed[bank] / fastest, colour, centred=True)
        asked = x + width / 2.0 * (1.0 + max(-1.0, min(1.0, scene.command[bank] / fastest)))
        drawing.box(asked - 1.25, y - 12.0, 2.5, 16.0, palette.INK, 1.0)
        drawing.text(WIDTH - MARGIN, y, signed(scene.wheel_speed[bank], 2), 14.0, align="right")
    y = top + 83.0
    drawing.box(MARGIN + 40.0, y - 7.0, 14.0, 7.0, palette.PALE, 2.0)
    drawing.text(MARGIN + 59.0, y, "measured", 11.0, palette.GREY)
    drawing.box(MARGIN + 124.0, y - 10.0, 2.5, 13.0, palette.INK, 1.0)
    drawing.text(MARGIN + 132.0, y, "command", 11.0, palette.GREY)
    _rule(drawing, top + 98.0)
    return top + 116.0


def _wheels(drawing: Drawing, scene: Scene, top: float) -> float:
    _heading(drawing, top + 8.0, "Slip and sinkage of the wheels")
    cell = (WIDTH - 2 * MARGIN - 20.0) / 2.0
    for name, index, column, row in WHEELS:
        x, y = MARGIN + column * (cell + 20.0), top + 30.0 + 62.0 * row
        colour = palette.RIGHT if column else palette.LEFT
        drawing.text(x, y, name, 11.0, palette.GREY)
        slip, sinkage = scene.slip_ratio[index], scene.sinkage[index]
        _bar(drawing, x, y + 9.0, cell - 50.0, slip, colour, centred=True)
        drawing.text(x + cell, y + 17.0, signed(100.0 * slip, 0, "%"), 12.0, align="right")
        _bar(drawing, x, y + 27.0, cell - 50.0, sinkage / SINKAGE_SPAN, colour, centred=False)
        drawing.text(x + cell, y + 35.0, signed(1000.0 * sinkage, 0, "mm"), 12.0, align="right")
    _rule(drawing, top + 142.0)
    return top + 160.0


def _metrics(drawing: Drawing, scene: Scene, top: float) -> None:
    room = int((LEGEND_TOP - 20.0 - top) // LINE)
    if len(scene.metrics) > room:
        raise InputError(f"{len(scene.metrics)} metric lines: the panel has room for {room}.")
    for line, (name, value) in enumerate(scene.metrics):
        y = top + 8.0 + LINE * line
        drawing.text(MARGIN, y, name, 12.0, palette.GREY, width=WIDTH - 2 * MARGIN - 90.0)
        drawing.text(WIDTH - MARGIN, y, value, 12.0, align="right", width=86.0)


def _legend(drawing: Drawing, scene: Scene) -> None:
    lines: list[tuple[str, str, tuple[float, ...]]] = [(palette.TRUE, "driven path", (34.0,))]
    if scene.stage.target_path is not None:
        lines.insert(0, (palette.TARGET, "commanded path", (9.0, 9.0, 9.0)))
    if scene.estimated_track is not None:
        lines.append((palette.ESTIMATE, "estimated path", (3.5,) * 5))
    _rule(drawing, LEGEND_TOP - 14.0)
    for line, (colour, name, pieces) in enumerate(lines):
        y = LEGEND_TOP + 8.0 + LINE * line
        gap = 0.0 if len(pieces) == 1 else (34.0 - sum(pieces)) / (len(pieces) - 1)
        x = MARGIN
        for piece in pieces:
            drawing.box(x, y - 6.0, piece, 3.5, colour, 1.75)
            x += piece + gap
        drawing.text(MARGIN + 46.0, y, name, 12.0)
