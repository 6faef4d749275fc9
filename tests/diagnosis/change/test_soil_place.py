"""Where a changed soil may lie."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ddagr_gym.diagnosis.change.soil_place import patch_of_change
from ddagr_gym.physics.effects.gyro_bias import GyroBias
from ddagr_gym.physics.effects.soil_change import SoilChange

ALONG = np.arange(10.0)
"""Middles of windows along a line [m]; each is a metre long."""


def fits(gains: np.ndarray, effect=None):
    """Fits without and with a changed soil by which windows gain."""
    prediction = np.zeros((len(ALONG), 5, 8))
    prediction[..., 5] = ALONG[:, None] + np.linspace(-0.5, 0.5, 5)
    prediction[..., 6] = 3.0
    changed = SimpleNamespace(
        window_cost=10.0 - gains,
        prediction=prediction,
        point=SimpleNamespace(effects=(effect or SoilChange(0.5, 0.4),)),
    )
    return SimpleNamespace(window_cost=np.full(len(ALONG), 10.0)), changed


def test_the_patch_lies_under_the_windows_that_gain():
    patch = patch_of_change(*fits(np.where((ALONG >= 2.0) & (ALONG <= 4.0), 5.0, -1.0)))
    assert (patch.centre_x, patch.centre_y, patch.radius) == pytest.approx((3.0, 3.0, 1.5))
    assert (patch.strength, patch.stiffness) == (0.5, 0.4)


def test_a_window_between_others_that_gain_is_in_the_patch_too():
    gains = np.array([-1.0, -1.0, 5.0, 5.0, -1.0, 5.0, 5.0, -9.0, -1.0, -1.0])
    patch = patch_of_change(*fits(gains))
    assert abs(2.0 - patch.centre_x) < patch.radius
    assert abs(6.0 - patch.centre_x) < patch.radius
    assert abs(7.0 - patch.centre_x) > patch.radius


def test_where_every_window_gains_the_patch_is_under_all_of_the_drive():
    patch = patch_of_change(*fits(np.ones(len(ALONG))))
    assert max(abs(-0.5 - patch.centre_x), abs(9.5 - patch.centre_x)) + patch.edge < patch.radius


def test_there_is_no_patch_where_no_window_gains():
    assert patch_of_change(*fits(-np.ones(len(ALONG)))) is None


def test_another_effect_has_no_patch():
    with pytest.raises(ValueError, match="gyro_bias"):
        patch_of_change(*fits(np.ones(len(ALONG)), GyroBias(0.1)))
