import math

import numpy as np
import pytest

from ddagr_gym.rendering import palette
from ddagr_gym.rendering.camera import Camera
from ddagr_gym.rendering.ground import paint_ground, pixel_window, rounded_box, shade_by_slope, value_noise
from ddagr_gym.rendering.scene import BedLayout, View

CAMERA = Camera(View(-2.0, 2.0, -2.0, 2.0), 400, 400)


def test_same_generator_same_ground():
    first, second, other = (paint_ground(CAMERA, None, np.random.default_rng(seed)) for seed in (3, 3, 4))
    np.testing.assert_array_equal(first, second)
    assert np.abs(first - other).max() > 5.0


def test_soil_has_its_colour_and_little_contrast():
    ground = paint_ground(CAMERA, None, np.random.default_rng(0))
    np.testing.assert_allclose(ground.mean(axis=(0, 1)), palette.rgb(palette.HEADLAND_SOIL), atol=5.0)
    assert ground[..., 0].std() < 20.0


def test_beds_stand_where_the_layout_says():
    beds = BedLayout(centres=(-1.0, 0.6), width=0.6, end=0.5)
    ground = paint_ground(CAMERA, beds, np.random.default_rng(0))
    x, y = np.meshgrid(CAMERA.columns_x(), CAMERA.rows_y())
    distance = np.min([np.maximum(np.abs(y - centre) - 0.3, x - 0.5) for centre in beds.centres], axis=0)
    red = ground[..., 0]
    assert red[distance > 0.15].min() > 110.0
    inside = distance < -0.03
    assert red[inside].mean() < 90.0
    assert np.mean(red[inside] < 120.0) > 0.8


def test_box_distance():
    assert rounded_box(3.0, 0.0, 2.0, 1.0, 0.5) == pytest.approx(1.0)
    assert rounded_box(0.0, 0.0, 2.0, 1.0, 0.5) == pytest.approx(-1.0)
    assert rounded_box(2.0, 1.0, 2.0, 1.0, 0.5) == pytest.approx(0.5 * (math.sqrt(2.0) - 1.0))
    assert rounded_box(5.0, 5.0, 2.0, 1.0, 0.0) == pytest.approx(5.0)


def test_noise_is_smooth_over_its_cells():
    rough, smooth = (value_noise((300, 300), (cell, cell), np.random.default_rng(0)) for cell in (3.0, 30.0))
    assert 0.7 < rough.std() < 1.3
    assert np.abs(np.diff(smooth, axis=0)).mean() < 0.2 * np.abs(np.diff(rough, axis=0)).mean()


def test_slopes_facing_the_upper_left_are_bright():
    down, right = np.mgrid[0:20, 0:20].astype(np.float32)
    assert shade_by_slope((down + right) * 1e-3, 100.0, 1.0).min() > 1.0
    assert shade_by_slope(-(down + right) * 1e-3, 100.0, 1.0).max() < 1.0
    np.testing.assert_array_equal(shade_by_slope(0.0 * down, 100.0, 1.0), 1.0)


def test_windows_are_cut_at_the_picture():
    assert pixel_window((10, 20), 5.0, 4.0, 2.0) == (slice(2, 7), slice(3, 8))
    assert pixel_window((10, 20), 0.0, 0.0, 3.0) == (slice(0, 4), slice(0, 4))
    assert pixel_window((10, 20), -9.0, 4.0, 3.0) is None
