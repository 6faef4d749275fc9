"""Steps inside bounds against the unbounded solution and a brute-force minimum."""

import numpy as np

from ddagr_gym.identification.gauss_newton import bounded_step


def test_without_bounds_it_is_the_newton_step() -> None:
    rng = np.random.default_rng(1)
    root = rng.standard_normal((6, 6))
    information, gradient = root @ root.T + np.eye(6), rng.standard_normal(6)
    step = bounded_step(information, gradient, np.full(6, -1e3), np.full(6, 1e3))
    np.testing.assert_allclose(step, np.linalg.solve(information, gradient), rtol=1e-6)


def test_with_bounds_it_is_the_minimum_inside_and_goes_downhill() -> None:
    information = np.array([[1.0, 0.99], [0.99, 1.0]])
    gradient = np.array([1.0, -0.5])
    low, high = np.array([-0.2, -0.2]), np.array([0.3, 0.3])
    step = bounded_step(information, gradient, low, high)
    axis = np.linspace(0.0, 1.0, 201)
    grid = np.stack(np.meshgrid(low[0] + 0.5 * axis, low[1] + 0.5 * axis), axis=-1).reshape(-1, 2)
    cost = 0.5 * np.einsum("ni,ij,nj->n", grid, information, grid) - grid @ gradient
    np.testing.assert_allclose(step, grid[np.argmin(cost)], atol=0.005)
    assert gradient @ step > 0.0
