"""The algebra of a fit against dense solutions and brute force."""

import numpy as np
import pytest

from ddagr_gym.identification.least_squares import (
    Elimination,
    Linearised,
    beside_residual,
    bounded_step,
    huber_loss,
    huber_roots,
)


def linear_problem(rng: np.random.Generator, windows: int = 40, noise: float = 1.0):
    """Residuals of windows with two local unknowns and three shared parameters, whose true step is known."""
    by_local, by_shared = rng.normal(size=(windows, 30, 2)), rng.normal(size=(windows, 30, 3))
    truth = np.array([0.5, -1.0, 2.0])
    local = rng.normal(size=(windows, 2, 1))
    residual = by_shared @ truth + (by_local @ local)[..., 0] + noise * rng.normal(size=(windows, 30))
    return by_local, by_shared, residual, truth


def linearised(by_local, by_shared, residual) -> Linearised:
    columns = Elimination.of(by_local).project(np.concatenate([residual[..., None], by_shared], axis=2))
    wide = np.full(3, 1e3)
    return Linearised(columns[..., 0], columns[..., 1:], np.zeros(3), np.zeros(3), wide, -wide, wide)


def test_elimination_solves_the_same_problem_as_all_unknowns_together() -> None:
    by_local, by_shared, residual, _ = linear_problem(np.random.default_rng(0), windows=3)
    small = linearised(by_local, by_shared, residual)
    step = small.step(small.information, small.gradient, np.inf)
    dense = np.zeros((3, 30, 9))
    for w in range(3):
        dense[w, :, :3], dense[w, :, 3 + 2 * w : 5 + 2 * w] = by_shared[w], by_local[w]
    together = np.linalg.lstsq(dense.reshape(90, 9), residual.ravel(), rcond=None)[0]
    np.testing.assert_allclose(step, together[:3], rtol=1e-5)
    explained = Elimination.of(by_local).explain((residual - by_shared @ step)[..., None])
    np.testing.assert_allclose(explained.ravel(), together[3:], rtol=1e-4)


def test_robust_rows_are_weighted_in_the_elimination_too() -> None:
    rng = np.random.default_rng(1)
    by_local, columns, roots = rng.normal(size=(2, 20, 2)), rng.normal(size=(2, 20, 1)), rng.uniform(0.1, 1.0, (2, 20))
    weighted = Elimination.of(by_local, roots)
    plain = Elimination.of(by_local * roots[..., None])
    np.testing.assert_allclose(weighted.project(columns), plain.project(columns * roots[..., None]))
    np.testing.assert_allclose(weighted.explain(columns), plain.explain(columns * roots[..., None]))
    left = columns[..., 0] - (by_local @ weighted.explain(columns))[..., 0]
    np.testing.assert_allclose(weighted.remaining(columns[..., 0]), left)


def test_both_deviations_are_the_scatter_of_repeated_fits() -> None:
    rng = np.random.default_rng(2)
    by_local, by_shared, _, truth = linear_problem(rng)
    found = []
    for _ in range(200):
        noise = rng.normal(size=by_shared.shape[:2])
        problem = linearised(by_local, by_shared, by_shared @ truth + noise)
        found.append(problem.step(problem.information, problem.gradient, np.inf))
    scatter = np.std(found, axis=0)
    at_the_fit = linearised(by_local, by_shared, by_shared @ (truth - found[-1]) + noise)
    for deviations in at_the_fit.deviations():
        np.testing.assert_allclose(deviations, scatter, rtol=0.4)


def test_only_the_sandwich_sees_residuals_that_are_alike_within_a_window() -> None:
    rng = np.random.default_rng(3)
    by_shared = np.abs(rng.normal(size=(60, 30, 3)))
    alike = np.repeat(rng.normal(size=(60, 1)), 30, axis=1)
    plain, sandwich = linearised(np.zeros((60, 30, 2)) + np.eye(30, 2), by_shared, alike).deviations()
    assert (sandwich > 1.3 * plain).all()


def test_the_loss_is_quadratic_then_linear_and_its_weights_give_its_gradient() -> None:
    residual = np.array([-5.0, -1.0, 0.0, 0.5, 3.0])
    np.testing.assert_allclose(huber_loss(residual, 2.0), [8.0, 0.5, 0.0, 0.125, 4.0])
    np.testing.assert_allclose(huber_loss(residual, np.inf), 0.5 * residual**2)
    slope = (huber_loss(residual + 1e-6, 2.0) - huber_loss(residual - 1e-6, 2.0)) / 2e-6
    np.testing.assert_allclose(huber_roots(residual, 2.0) ** 2 * residual, slope, atol=1e-6)


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


@pytest.mark.parametrize("seed", range(5))
def test_the_step_in_many_bounds_is_the_best_there(seed: int) -> None:
    from scipy.optimize import minimize

    rng = np.random.default_rng(seed)
    root = rng.normal(size=(4, 4))
    information, gradient = root @ root.T + np.eye(4), 5.0 * rng.normal(size=4)
    low, high = np.array([-0.1, -9.0, -9.0, -0.05]), np.array([0.2, 9.0, 9.0, 0.3])
    step = bounded_step(information, gradient, low, high)
    best = minimize(
        lambda x: 0.5 * x @ information @ x - gradient @ x, np.zeros(4), bounds=list(zip(low, high, strict=True))
    )
    assert ((step >= low - 1e-9) & (step <= high + 1e-9)).all()
    assert 0.5 * step @ information @ step - gradient @ step <= best.fun + 1e-6


def test_sensitivities_stand_beside_the_residual_and_are_zero_in_the_rows_of_the_priors() -> None:
    rng = np.random.default_rng(0)
    residual, first, second = rng.normal(size=(4, 7)), rng.normal(size=(4, 5, 3)), rng.normal(size=(4, 5, 2))
    columns = beside_residual(residual, first, second)
    assert columns.shape == (4, 7, 6)
    np.testing.assert_array_equal(columns[..., 0], residual)
    np.testing.assert_array_equal(columns[:, :5, 1:], np.concatenate([first, second], axis=2))
    assert not columns[:, 5:, 1:].any()
