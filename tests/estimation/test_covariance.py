"""Covariance algebra against plain matrix products."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.estimation import layout
from ddagr_gym.estimation.covariance import joseph_update, limit_covariance, propagate


def random_covariance(rng):
    root = rng.standard_normal((12, 12))
    scale = 10.0 ** rng.uniform(-4, 1, 12)
    return root @ root.T * np.outer(scale, scale)


def test_propagation_is_phi_p_phi_transposed(load, view, rng):
    covariance = random_covariance(rng)
    rows = np.zeros((3, 12))
    rows[:, : layout.MOTION_SIZE] = rng.standard_normal((3, layout.MOTION_SIZE))
    decay_right, decay_left = 0.83, 1.0
    phi = np.eye(12)
    phi[:3] = rows
    phi[3, 3], phi[4, 4] = decay_right, decay_left
    work = load(np.zeros(12), covariance)
    view(work, layout.TRANSITION, 3)[:] = rows
    propagate(work, decay_right, decay_left)
    np.testing.assert_allclose(view(work, layout.P, 12), phi @ covariance @ phi.T, rtol=1e-11, atol=1e-18)


@given(st.integers(0, 2**31), st.floats(1e-8, 1e2), st.booleans())
def test_joseph_update_with_any_gain(seed, variance, optimal):
    rng = np.random.default_rng(seed)
    covariance, h = random_covariance(rng), rng.standard_normal(12)
    column = covariance @ h
    gain = column / (h @ column + variance) if optimal else rng.standard_normal(12) * 1e-2
    work = np.zeros(layout.WORK_SIZE)
    matrix = work[layout.P : layout.P + 12 * layout.STRIDE].reshape(12, layout.STRIDE)[:, :12]
    matrix[:] = covariance
    work[layout.GAIN : layout.GAIN + 12] = gain
    work[layout.COLUMN : layout.COLUMN + 12] = column
    joseph_update(work, h @ column, variance)
    rest = np.eye(12) - np.outer(gain, h)
    expected = rest @ covariance @ rest.T + variance * np.outer(gain, gain)
    np.testing.assert_allclose(matrix, expected, atol=1e-11 * np.abs(covariance).max())


def test_limits_keep_correlations_and_definiteness(model, load, view, rng):
    covariance = random_covariance(rng)
    packed = model.pack()
    ceiling = packed[layout.CEILING : layout.CEILING + 12]
    floor = packed[layout.FLOOR : layout.FLOOR + 12]
    covariance[0] *= 1e3
    covariance[:, 0] *= 1e3
    assert covariance[0, 0] > ceiling[0]
    correlation = covariance[0, 5] / np.sqrt(covariance[0, 0] * covariance[5, 5])
    work = load(np.zeros(12), covariance)
    limit_covariance(packed, work)
    limited = view(work, layout.P, 12)
    assert limited[0, 0] == pytest.approx(ceiling[0])
    assert limited[0, 5] / np.sqrt(limited[0, 0] * limited[5, 5]) == pytest.approx(correlation)
    assert np.array_equal(limited, limited.T)
    assert np.linalg.eigvalsh(limited).min() > 0
    assert (np.diag(limited) >= floor).all()


def test_a_vanished_variance_returns_to_its_floor(model, load, view):
    covariance = np.diag(np.full(12, 1e-30))
    work = load(np.zeros(12), covariance)
    packed = model.pack()
    limit_covariance(packed, work)
    np.testing.assert_array_equal(np.diag(view(work, layout.P, 12)), packed[layout.FLOOR : layout.FLOOR + 12])
