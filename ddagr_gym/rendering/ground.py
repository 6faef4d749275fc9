"""The field seen from above, as an image: soil, mulched beds with plants, and the ruts of the wheels.

Light comes from the upper left. Images are float32 (height, width, 3), 0 to 255.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.rendering import palette
from ddagr_gym.rendering.camera import Camera
from ddagr_gym.rendering.scene import BedLayout

Image = NDArray[np.float32]

CORNER = 0.12
"""Radius of a bed's corners at the headland [m]."""

PLANT_SPACING = 0.36
"""Between plants in a row; two staggered rows a bed [m]."""


def _colour(code: str) -> Image:
    return np.array(palette.rgb(code), np.float32)


def shade_by_slope(height: Image, pixels_per_metre: float, strength: float) -> Image:
    """Brightness factor of a relief ``height`` [m], (rows, columns): slopes that face the light are brighter."""
    down, right = np.gradient(height) if min(height.shape) > 1 else (np.zeros_like(height), np.zeros_like(height))
    facing = (down + right) * np.float32(pixels_per_metre * strength)
    return 1.0 + np.clip(facing, -0.32, 0.22)


def value_noise(shape: tuple[int, int], cells: tuple[float, float], rng: np.random.Generator) -> Image:
    """Smooth noise of unit standard deviation, about: a random lattice of ``cells`` (down, right) pixels."""
    weights = []
    for size, cell in zip(shape, cells, strict=True):
        place = np.arange(size) / cell
        left = np.floor(place).astype(int)
        share = place - left
        share = share * share * (3.0 - 2.0 * share)
        matrix = np.zeros((size, left[-1] + 2), np.float32)
        matrix[np.arange(size), left] = 1.0 - share
        matrix[np.arange(size), left + 1] = share
        weights.append(matrix)
    lattice = rng.standard_normal((weights[0].shape[1], weights[1].shape[1])).astype(np.float32)
    return np.asarray(1.5 * (weights[0] @ lattice @ weights[1].T))


def rounded_box(x: ArrayLike, y: ArrayLike, half_x: float, half_y: float, corner: float) -> NDArray[np.floating]:
    """Signed distance from a box with rounded corners about the origin, negative inside."""
    corner = min(corner, half_x, half_y)
    over_x, over_y = np.abs(x) - (half_x - corner), np.abs(y) - (half_y - corner)
    outside = np.hypot(np.maximum(over_x, 0.0), np.maximum(over_y, 0.0))
    return np.asarray(outside + np.minimum(np.maximum(over_x, over_y), 0.0) - corner)


def paint_ground(camera: Camera, beds: BedLayout | None, rng: np.random.Generator) -> Image:
    """Field without ruts. The same generator state gives the same picture."""
    scale, shape = camera.scale, (camera.height, camera.width)
    relief = sum(
        np.float32(rise * cell) * value_noise(shape, (cell * scale, cell * scale), rng)
        for cell, rise in ((0.012, 0.009), (0.04, 0.007), (0.22, 0.004))
    )
    tone = 0.012 * value_noise(shape, (0.5 * scale, 0.8 * scale), rng) + 0.016 * value_noise(shape, (2.0, 2.0), rng)
    brightness = shade_by_slope(np.asarray(relief, np.float32), scale, 1.0) + tone
    colour = np.broadcast_to(_colour(palette.HEADLAND_SOIL), (*shape, 3)).copy()
    if beds is not None:
        _tint_rows(colour, camera, beds)
    colour *= brightness[..., None]
    if beds is not None:
        for centre in beds.centres:
            _paint_bed(colour, camera, beds, centre, rng)
    return colour


def _tint_rows(colour: Image, camera: Camera, beds: BedLayout) -> None:
    """Furrows are moister than the headland; the change is gradual over 40 cm."""
    share = np.clip((beds.end + 0.2 - camera.columns_x()) / 0.4, 0.0, 1.0).astype(np.float32)
    share = share * share * (3.0 - 2.0 * share)
    colour += share[None, :, None] * (_colour(palette.FURROW_SOIL) - _colour(palette.HEADLAND_SOIL))


def _paint_bed(image: Image, camera: Camera, beds: BedLayout, centre: float, rng: np.random.Generator) -> None:
    y = camera.rows_y() - centre
    rows = np.flatnonzero(np.abs(y) < beds.width / 2.0 + 0.12)
    columns = np.flatnonzero(camera.columns_x() < beds.end + 0.15)
    if not rows.size or not columns.size:
        return
    plants = _plants(camera, beds, centre, rng)
    block = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
    x, y = camera.columns_x()[block[1]], y[block[0]]
    far = beds.end - camera.columns_x()[0] + 1.0
    distance = rounded_box(x[None, :] - beds.end + far, y[:, None], far, beds.width / 2.0, CORNER)
    shadow = rounded_box(x[None, :] - beds.end + far - 0.03, y[:, None] + 0.035, far, beds.width / 2.0, CORNER)
    part = image[block]
    part *= (1.0 - 0.38 * np.clip(0.5 - shadow / 0.05, 0.0, 1.0))[..., None].astype(np.float32)
    cover = np.clip(0.5 - distance * camera.scale, 0.0, 1.0).astype(np.float32)[..., None]
    part += cover * (_mulch(distance, y, camera.scale, rng) - part)
    for plant in plants:
        _paint_plant(image, camera, plant, rng)


def _mulch(distance: NDArray[np.floating], y: NDArray[np.float64], scale: float, rng: np.random.Generator) -> Image:
    """Plastic film over a rounded bed: dark, bright where its shoulder faces the light, faintly wrinkled."""
    shoulder = np.clip(1.0 + distance / 0.11, 0.0, 1.0)
    down, right = np.gradient(distance * scale)
    facing = -shoulder * shoulder * (0.75 * down + 0.45 * right)
    wrinkles = value_noise((distance.shape[0], distance.shape[1]), (0.02 * scale, 0.5 * scale), rng)
    sheen = 0.14 * np.exp(-(((y[:, None] - 0.07) / 0.09) ** 2))
    factor = 1.0 + 0.8 * np.clip(facing, -0.6, 1.0) + sheen + 0.03 * wrinkles
    return np.asarray(_colour(palette.MULCH) * factor[..., None], np.float32)


def _plants(
    camera: Camera, beds: BedLayout, centre: float, rng: np.random.Generator
) -> list[tuple[float, float, float]]:
    """(x, y, size) of the plants of a bed in the view [m]; places count from the boundary, so that they are fixed."""
    count = max(0, math.ceil((beds.end - camera.columns_x()[0]) / PLANT_SPACING) + 1)
    plants = []
    for index in range(count):
        for row, stagger in ((0.24, 0.55), (-0.24, 1.05)):
            jitter = rng.uniform(-0.02, 0.02, 3)
            x = beds.end - PLANT_SPACING * (index + stagger) + jitter[0]
            plants.append((x, centre + row * beds.width + jitter[1], (0.10 + jitter[2]) * min(1.0, beds.width / 0.6)))
    return plants


def _paint_plant(image: Image, camera: Camera, plant: tuple[float, float, float], rng: np.random.Generator) -> None:
    """Rosette of trifoliate leaves, outer ones first."""
    x, y, size = plant
    _paint_ellipse(image, camera, (x + 0.02, y - 0.02, 0.95 * size, 0.95 * size, 0.0), (18, 20, 18), 0.45)
    turn = rng.uniform(0.0, 2.0 * math.pi)
    for ring, (count, reach) in enumerate(((7, 0.72), (5, 0.38), (2, 0.04))):
        for k in range(count):
            angle = turn + 2.0 * math.pi * (k + 0.5 * ring) / count + rng.uniform(-0.2, 0.2)
            tone = _colour(palette.LEAVES[rng.integers(4)]) * rng.uniform(0.85, 1.12) * (1.0 + 0.08 * ring)
            stem_x, stem_y = x + size * reach * math.cos(angle), y + size * reach * math.sin(angle)
            leaf = 0.30 * size
            for leaflet, direction in enumerate((angle - 0.75, angle + 0.75, angle)):
                middle = stem_x + 0.75 * leaf * math.cos(direction), stem_y + 0.75 * leaf * math.sin(direction)
                outline = (*middle, leaf, 0.68 * leaf, direction)
                _paint_ellipse(image, camera, outline, tone * 1.05**leaflet, 0.95)


def _paint_ellipse(
    image: Image,
    camera: Camera,
    ellipse: tuple[float, float, float, float, float],
    colour: ArrayLike,
    opacity: float,
) -> None:
    """Blend an ellipse (x, y, semi-axes, angle) [m, rad] into the image, its edge smoothed over a pixel."""
    x, y, long, short, angle = ellipse
    column, row = camera.pixels((x, y))
    a, b = long * camera.scale, short * camera.scale
    window = pixel_window(image.shape, column, row, a + 1.0)
    if window is None:
        return
    across, down = pixel_offsets(window, column, row)
    c, s = math.cos(angle), math.sin(angle)
    radius = np.hypot((across * c - down * s) / a, (across * s + down * c) / b)
    cover = opacity * np.clip(0.5 + (1.0 - radius) * b, 0.0, 1.0)
    part = image[window]
    part += cover[..., None].astype(np.float32) * (np.asarray(colour, np.float32) - part)


def pixel_window(shape: tuple[int, ...], column: float, row: float, reach: float) -> tuple[slice, slice] | None:
    """Rows and columns within ``reach`` pixels of a place, cut at the image; None outside of it."""
    rows = slice(max(0, math.floor(row - reach)), min(shape[0], math.ceil(row + reach) + 1))
    columns = slice(max(0, math.floor(column - reach)), min(shape[1], math.ceil(column + reach) + 1))
    return None if rows.start >= rows.stop or columns.start >= columns.stop else (rows, columns)


def pixel_offsets(window: tuple[slice, slice], column: float, row: float) -> tuple[Image, Image]:
    """Offsets of a window's pixel middles from a place, right (1, columns) and down (rows, 1)."""
    rows, columns = window
    across = np.arange(columns.start, columns.stop, dtype=np.float32)[None, :] + np.float32(0.5 - column)
    down = np.arange(rows.start, rows.stop, dtype=np.float32)[:, None] + np.float32(0.5 - row)
    return across, down
