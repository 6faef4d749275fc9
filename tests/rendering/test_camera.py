import numpy as np
import pytest

from ddagr_gym.rendering.camera import Camera
from ddagr_gym.rendering.scene import View


def test_camera_keeps_proportions_and_middle():
    camera = Camera(View(-1.0, 3.0, 0.0, 2.0), 800, 800)
    assert camera.scale == 200.0
    shown = camera.pixels([(1.0, 1.0), (2.0, 1.0), (1.0, 2.0)])
    np.testing.assert_allclose(shown, [(400, 400), (600, 400), (400, 200)])


def test_pixel_middles_and_world_coordinates_agree():
    camera = Camera(View(-1.0, 3.0, 0.0, 2.0), 800, 800)
    assert camera.columns_x()[[0, -1]] == pytest.approx((-0.9975, 2.9975))
    assert camera.rows_y()[[0, -1]] == pytest.approx((2.9975, -0.9975))
    np.testing.assert_allclose(camera.pixels([(camera.columns_x()[7], camera.rows_y()[11])]), [(7.5, 11.5)])
