"""Ruts: what the wheels have pressed into the soil so far, as a depth map that shades the ground.

Every contact patch is stamped at equal distances along the track and the deepest print stays, so that the map
depends on the track alone and not on how many pictures were drawn on the way.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.frames import body_to_world, unwrap_heading
from ddagr_gym.parameters import Robot, TorusWheel
from ddagr_gym.rendering import palette
from ddagr_gym.rendering.camera import Camera
from ddagr_gym.rendering.ground import Image, pixel_offsets, pixel_window, rounded_box, shade_by_slope

Array = NDArray[np.float64]

SPACING = 0.012
"""Wheel travel between prints [m]."""

LUG_EVERY = 6
"""Prints between two lugs of the tread."""

BERM_WIDTH = 0.035
"""Width of the soil pushed up beside a rut [m] (ours)."""

DEEP = 0.04
"""Sinkage that is drawn darkest [m]."""


def contact_outline(wheel: TorusWheel, sinkage: float) -> tuple[float, float]:
    """Half length and half width of the patch where the plane of the ground cuts an elliptic torus tyre [m]."""
    depth = min(max(sinkage, 0.0), wheel.minor_radius)
    height = wheel.outer_radius - depth
    width = wheel.half_width * math.sqrt(1.0 - (1.0 - depth / wheel.minor_radius) ** 2)
    return math.sqrt(wheel.outer_radius**2 - height**2), width


def prints_along(track: Array, ruts: Array, lever: float) -> Array:
    """Poses and sinkages (N, 7) at equal travel of the wheels, interpolated; an earlier end gives the same first rows.

    Args:
        track: poses (T, 3) [m, m, rad].
        ruts: sinkages (T, 4) [m].
        lever: distance of the wheels from the centre, so that turning on the spot counts as travel [m].
    """
    rows = np.column_stack([track[:, :2], unwrap_heading(track[:, 2]), ruts])
    step = np.diff(rows, axis=0)
    travel = np.concatenate([[0.0], np.cumsum(np.hypot(step[:, 0], step[:, 1]) + lever * np.abs(step[:, 2]))])
    places = SPACING * np.arange(math.floor(travel[-1] / SPACING) + 1)
    return np.column_stack([np.interp(places, travel, column) for column in rows.T])


class RutMap:
    """Depth of the prints on a camera's pixels, and the ground shaded by it.

    Attributes:
        image: the ground with ruts (height, width, 3), kept up to date by :meth:`update`.
    """

    def __init__(self, camera: Camera, robot: Robot, ground: Image) -> None:
        self._camera, self._robot, self._ground = camera, robot, ground
        self._hubs = np.column_stack([robot.wheel_x, robot.wheel_y])
        self._lever = float(np.hypot(*self._hubs.T).max())
        self.image = ground.astype(np.uint8)
        self._clear()

    def _clear(self) -> None:
        shape = (self._camera.height, self._camera.width)
        self._depth: Image = np.zeros(shape, np.float32)
        self._berm: Image = np.zeros(shape, np.float32)
        self._prints = np.zeros((0, 7))
        self.image[:] = np.clip(self._ground, 0.0, 255.0)

    def update(self, track: Array, ruts: Array) -> list[tuple[slice, slice]]:
        """Stamp what is new, or all of it where the track is not a continuation.

        Returns:
            Windows (rows, columns) of the image that changed.
        """
        prints = prints_along(track, ruts, self._lever)
        known = len(self._prints)
        changed = []
        if known > len(prints) or not np.array_equal(prints[:known], self._prints):
            self._clear()
            known = 0
            changed.append((slice(0, self._camera.height), slice(0, self._camera.width)))
        new = prints[known:]
        places = self._camera.pixels(body_to_world(self._hubs, *new[:, :3].T))
        for wheel in range(4) if len(new) else ():
            windows = [self._stamp(new[k], known + k, wheel, *places[k, wheel]) for k in range(len(new))]
            window = _bounds([w for w in windows if w is not None])
            if window is not None:
                self._shade(window)
                changed.append(window)
        self._prints = prints
        return changed

    def _stamp(self, pose: Array, index: int, wheel: int, column: float, row: float) -> tuple[slice, slice] | None:
        tyre, sinkage, scale = self._robot.wheels[wheel], float(pose[3 + wheel]), self._camera.scale
        half_length, half_width = (scale * value for value in contact_outline(tyre, sinkage))
        berm = scale * BERM_WIDTH
        window = pixel_window(self._depth.shape, column, row, math.hypot(half_length, half_width) + berm + 2.0)
        if window is None or half_width < 0.5:
            return None
        across, down = pixel_offsets(window, column, row)
        c, s = math.cos(pose[2]), math.sin(pose[2])
        along, aside = across * np.float32(c) - down * np.float32(s), across * np.float32(s) + down * np.float32(c)
        distance = rounded_box(along, aside, half_length, half_width, 0.35 * half_width)
        depth = sinkage * np.clip(0.5 - distance / 4.0, 0.0, 1.0)
        if index % LUG_EVERY == 0:
            bar = np.abs(along + np.abs(aside) * 0.45) - 0.009 * scale
            depth *= 1.0 + 0.22 * np.clip(0.5 - bar / 2.0, 0.0, 1.0)
        self._raise(self._depth, window, depth)
        self._raise(self._berm, window, sinkage * np.clip(1.0 - distance / berm, 0.0, 1.0) ** 2)
        return window

    @staticmethod
    def _raise(values: Image, window: tuple[slice, slice], new: NDArray[np.floating]) -> None:
        part = values[window]
        np.maximum(part, new, out=part, casting="same_kind")

    def _shade(self, window: tuple[slice, slice]) -> None:
        """Renew the image in a window; slopes at its edge look one pixel beyond, as they do in a larger window."""
        wide, inner = _widened(window, self._depth.shape)
        depth, berm = self._depth[wide], self._berm[wide]
        outside = 1.0 - np.clip(depth / np.maximum(berm, np.float32(1e-6)), 0.0, 1.0)
        relief = np.asarray(0.35 * berm * outside - depth, np.float32)
        light = shade_by_slope(relief, self._camera.scale, 0.55)
        light += np.float32(0.10) * np.clip(berm / np.float32(0.02), 0.0, 1.0) * outside
        tint = np.float32(0.85) * np.sqrt(np.clip(depth / np.float32(DEEP), 0.0, 1.0))
        ground, pressed = self._ground[window], np.array(palette.rgb(palette.PRESSED_SOIL), np.float32)
        shaded = (ground + tint[inner][..., None] * (pressed - ground)) * light[inner][..., None]
        self.image[window] = np.clip(shaded, 0.0, 255.0)


def _widened(window: tuple[slice, slice], shape: tuple[int, ...]) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """The window one pixel larger on each side where the image goes on, and the place of the window in that."""
    wide = tuple(slice(max(0, w.start - 1), min(size, w.stop + 1)) for w, size in zip(window, shape, strict=True))
    inner = tuple(slice(w.start - v.start, w.stop - v.start) for w, v in zip(window, wide, strict=True))
    return wide, inner


def _bounds(windows: list[tuple[slice, slice]]) -> tuple[slice, slice] | None:
    if not windows:
        return None
    rows = slice(min(w[0].start for w in windows), max(w[0].stop for w in windows))
    columns = slice(min(w[1].start for w in windows), max(w[1].stop for w in windows))
    return rows, columns
