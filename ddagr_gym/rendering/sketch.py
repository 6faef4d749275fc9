"""Vector drawing on a pygame surface: lines with width, dashes, dots, and the robot from above.

Coordinates are pixels of the surface; the module ``pygame`` is passed in, so that importing this needs none.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.frames import body_to_world, rotation_matrix
from ddagr_gym.parameters import Robot
from ddagr_gym.rendering import palette
from ddagr_gym.rendering.camera import Camera

Array = NDArray[np.float64]

HALO = palette.rgb(palette.HALO)
SIDE_WALL, TYRE, TREAD = (palette.rgb(code) for code in (palette.SIDE_WALL, palette.TYRE, palette.TREAD))
LUGS = 22
"""Lugs around a tyre."""


def thin_out(points: Array, spacing: float) -> Array:
    """Points (K, 2) of a polyline at equal distances along it, ends included, at most ``spacing`` pixels apart."""
    step = np.hypot(*np.diff(points, axis=0).T)
    travel = np.concatenate([[0.0], np.cumsum(step)])
    places = np.linspace(0.0, travel[-1], max(2, math.ceil(travel[-1] / spacing) + 1))
    return np.column_stack([np.interp(places, travel, column) for column in points.T])


def ribbons(points: Array, width: float) -> list[Array]:
    """Outlines (K, 2) that together fill a polyline (N, 2) of a width, each short enough not to overlap itself."""
    along = np.gradient(points, axis=0)
    length = np.hypot(*along.T)
    if not length.all():
        return []
    normal = np.column_stack([-along[:, 1], along[:, 0]]) / length[:, None] * width / 2.0
    left, right = points + normal, points - normal
    parts = [slice(first, first + 17) for first in range(0, len(points) - 1, 16)]
    return [np.concatenate([left[part], right[part][::-1]]) for part in parts]


class Line:
    """Polylines with round ends and a pale edge, legible on dark and on light ground; made once, drawn often."""

    def __init__(self, pieces: Sequence[Array], width: float, colour: palette.Colour) -> None:
        self._layers = [
            (tint, wide / 2.0, [ribbon for piece in pieces for ribbon in ribbons(piece, wide)])
            for tint, wide in ((HALO, 1.75 * width), (colour, width))
        ]
        self._ends = [end for piece in pieces for end in (piece[0], piece[-1])]

    def draw(self, pygame: Any, surface: Any) -> None:
        """Draw the lines on a surface."""
        for colour, radius, outlines in self._layers:
            for outline in outlines:
                pygame.draw.polygon(surface, colour, outline)
            for end in self._ends:
                pygame.draw.circle(surface, colour, end, radius)


def dashes(points: Array, dash: float, gap: float) -> list[Array]:
    """Pieces of a polyline (N, 2), each (K, 2): ``dash`` pixels drawn, ``gap`` left out; both ends are dashes."""
    step = np.hypot(*np.diff(points, axis=0).T)
    travel = np.concatenate([[0.0], np.cumsum(step)])
    count = max(1, round((travel[-1] + gap) / (dash + gap)))
    stretch = (travel[-1] + gap) / (count * (dash + gap))
    starts = np.arange(count) * (dash + gap) * stretch
    pieces = []
    for start in starts:
        places = np.linspace(start, start + dash * stretch, max(2, math.ceil(dash / 4.0)))
        pieces.append(np.column_stack([np.interp(places, travel, column) for column in points.T]))
    return pieces


def dots(points: Array, spacing: float) -> Array:
    """Places (K, 2) along a polyline from its start, ``spacing`` pixels apart."""
    step = np.hypot(*np.diff(points, axis=0).T)
    travel = np.concatenate([[0.0], np.cumsum(step)])
    places = np.arange(0.0, travel[-1] + 1e-9, spacing)
    return np.column_stack([np.interp(places, travel, column) for column in points.T])


def rounded_rectangle(x: tuple[float, float], y: tuple[float, float], corner: float) -> Array:
    """Outline (32, 2) of a rectangle with rounded corners from its limits, counter-clockwise."""
    corner = min(corner, (x[1] - x[0]) / 2.0, (y[1] - y[0]) / 2.0)
    quarter = np.linspace(0.0, math.pi / 2.0, 8)
    corners = ((x[1], y[1], 0), (x[0], y[1], 1), (x[0], y[0], 2), (x[1], y[0], 3))
    outline = []
    for corner_x, corner_y, turn in corners:
        angle = quarter + turn * math.pi / 2.0
        middle = (
            corner_x - math.copysign(corner, corner_x - sum(x) / 2),
            corner_y - math.copysign(corner, corner_y - sum(y) / 2),
        )
        outline.append(np.column_stack([middle[0] + corner * np.cos(angle), middle[1] + corner * np.sin(angle)]))
    return np.concatenate(outline)


def _between(first: float, second: float) -> tuple[float, float]:
    return min(first, second), max(first, second)


class RobotSketch:
    """A skid-steer robot seen from above: tyres with lugs, portal frame, deck with a heading arrow."""

    def __init__(self, pygame: Any, camera: Camera, robot: Robot) -> None:
        self._pygame, self._camera, self._robot = pygame, camera, robot
        tyre = max(wheel.half_width for wheel in robot.wheels)
        half_length, half_track = robot.half_wheelbase, robot.half_track
        inner = half_track - tyre
        rail = 0.06 * half_track + 0.02
        self._rail_y = inner - 0.05 - rail / 2.0
        self._rails = [
            rounded_rectangle((-1.15 * half_length, 1.15 * half_length), (y - rail / 2.0, y + rail / 2.0), 0.02)
            for y in (self._rail_y, -self._rail_y)
        ]
        self._beams = [
            rounded_rectangle((x - rail / 2.0, x + rail / 2.0), (-self._rail_y, self._rail_y), 0.01)
            for x in (0.72 * half_length, -0.72 * half_length)
        ]
        self._axles = [
            rounded_rectangle((x - 0.03, x + 0.03), _between(side * self._rail_y, side * (inner + 0.02)), 0.0)
            for x in (half_length, -half_length)
            for side in (1, -1)
        ]
        self._deck = rounded_rectangle(
            (-0.95 * half_length, 0.95 * half_length), (-0.66 * self._rail_y, 0.66 * self._rail_y), 0.07
        )
        self._tyres = [(self._tyre(k), self._tyre(k, 0.008)) for k in range(4)]
        size = 0.62 * min(half_length, self._rail_y)
        self._arrow = size * np.array([(1.1, 0.0), (-0.62, 0.72), (-0.26, 0.0), (-0.62, -0.72)])

    def _tyre(self, wheel: int, inset: float = 0.0) -> Array:
        tyre, x, y = self._robot.wheels[wheel], self._robot.wheel_x[wheel], self._robot.wheel_y[wheel]
        length, width = tyre.outer_radius - inset, tyre.half_width - inset
        return rounded_rectangle((x - length, x + length), (y - width, y + width), 0.55 * tyre.half_width)

    def draw(self, surface: Any, pose: Sequence[float], wheel_angle: tuple[float, float]) -> None:
        """Draw the robot at ``pose`` (x, y, yaw) with its banks rolled by ``wheel_angle`` (right, left) [rad]."""
        self._draw_shadow(surface, pose)
        fill = self._filler(surface, pose)
        for part in self._axles:
            fill(part, palette.rgb(palette.AXLE))
        for wheel in range(4):
            self._draw_tyre(fill, wheel, wheel_angle[wheel % 2])
        for part in (*self._beams, *self._rails):
            fill(part, palette.rgb(palette.FRAME))
        fill(self._deck, palette.rgb(palette.DECK_EDGE))
        fill(self._deck * (0.95, 0.965), palette.rgb(palette.DECK))
        fill(self._arrow, palette.rgb(palette.INK))

    def _filler(self, surface: Any, pose: Sequence[float]) -> Any:
        """Function that fills an outline in body coordinates; the pose is one matrix for all of them."""
        origin, forward, leftward = self._camera.pixels(body_to_world([(0, 0), (1, 0), (0, 1)], *pose))
        matrix = np.stack([forward - origin, leftward - origin])
        polygon = self._pygame.draw.polygon

        def fill(outline: ArrayLike, colour: palette.Colour) -> None:
            polygon(surface, colour, np.asarray(outline) @ matrix + origin)

        return fill

    def _draw_tyre(self, fill: Any, wheel: int, angle: float) -> None:
        side_wall, face = self._tyres[wheel]
        fill(side_wall, SIDE_WALL)
        fill(face, TYRE)
        tyre, x, y = self._robot.wheels[wheel], self._robot.wheel_x[wheel], self._robot.wheel_y[wheel]
        turned = np.mod(angle + 2.0 * math.pi * np.arange(LUGS) / LUGS + math.pi, 2.0 * math.pi) - math.pi
        for lug in turned[np.abs(turned) < 1.35]:
            middle = x + 0.97 * tyre.outer_radius * math.sin(lug)
            half = 0.012 * math.cos(lug) + 0.002
            reach, sweep = 0.80 * tyre.half_width, 0.30 * tyre.half_width * math.cos(lug)
            for side in (1.0, -1.0):
                root, tip = y + side * 0.08 * tyre.half_width, y + side * reach
                front, back = middle + half, middle - half
                fill([(front, root), (front - sweep, tip), (back - sweep, tip), (back, root)], TREAD)

    def _draw_shadow(self, surface: Any, pose: Sequence[float]) -> None:
        """Soft shadow to the lower right, drawn small and enlarged."""
        pygame, camera = self._pygame, self._camera
        reach = 1.25 * math.hypot(self._robot.half_wheelbase + 0.3, self._robot.half_track + 0.2)
        size, coarse = max(8, round(2.0 * reach * camera.scale)), max(4, round(2.0 * reach * camera.scale / 10.0))
        small = pygame.Surface((coarse, coarse), pygame.SRCALPHA, 32)
        turned = rotation_matrix(pose[2]).T * (1.0, -1.0) * coarse / (2.0 * reach)
        for part in (*(side_wall for side_wall, _ in self._tyres), *self._beams, *self._rails, self._deck):
            pygame.draw.polygon(small, (20, 14, 8, 105), part @ turned + coarse / 2.0)
        column, row = camera.pixels((pose[0] + 0.035, pose[1] - 0.045))
        surface.blit(
            pygame.transform.smoothscale(small, (size, size)), (round(column - size / 2), round(row - size / 2))
        )
