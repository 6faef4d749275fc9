"""Refit of nominal parameters on windows: Gauss-Newton with priors, initial states eliminated linearly."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.window_model import WindowModel
from ddagr_gym.physics.effects import Effect

Array = NDArray[np.float64]

STATE_PRIOR = np.array([1e3, 1e3, 1e2, 0.5, 0.2, 0.5, 1.0, 1.0])
"""Standard deviations of the first guess of STATE: wide for the pose, loose for the motion (ours)."""

_DAMPING = (1.0, 0.5, 0.25, 0.1, 0.03)


@dataclass(frozen=True, eq=False)
class Refit:
    """A fitted nominal model.

    Attributes:
        values: (P,) parameters.
        deviations: (P,) Gauss-Newton standard deviations; resampled intervals are wider and more honest.
        states: (W, 8) initial states.
        prediction: (W, T, 8).
        cost: half the sum of squares of weighted residuals (Huber's loss where asked for), priors included.
        iterations: Gauss-Newton steps taken.
        converged: whether the last step lowered the cost by less than the tolerance, relative.
        at_bound: names of parameters that sit at a bound.
        window_deviations: (P,) the same from the scatter of the windows' scores (sandwich), which allows for
            correlated residuals inside a window.
    """

    values: Array
    deviations: Array
    states: Array
    prediction: Array
    cost: float
    iterations: int
    converged: bool
    at_bound: tuple[str, ...]
    window_deviations: Array


def weighted(measured: Array, prediction: Array, sigma: Array) -> Array:
    """Residuals over sigma (W, T, 8), 0 where there is no sample; headings compared on the circle."""
    difference = measured - prediction
    difference[..., 7] = np.angle(np.exp(1j * difference[..., 7]))
    return np.nan_to_num(difference / sigma)


def with_prior(by_state: Array, mask: Array) -> Array:
    """State Jacobian (W, M, S) with the prior of the first guess as S further rows."""
    count, _, states = by_state.shape
    prior = np.broadcast_to(np.diag(1.0 / STATE_PRIOR), (count, states, states))
    return np.concatenate([by_state * mask[..., None], prior], axis=1)


def project(rows: Array, by_state: Array) -> tuple[Array, Array]:
    """Remove from columns what the initial states of each window explain.

    Args:
        rows: (W, M, K) weighted residuals and sensitivities as columns.
        by_state: (W, M, S) weighted, of full rank (see :func:`with_prior`).

    Returns:
        The projected columns (W, M, K), and the states' changes (W, S, K) that explain what was removed.
    """
    q, upper = np.linalg.qr(by_state)
    inside = np.einsum("wms,wmk->wsk", q, rows)
    return rows - np.einsum("wms,wsk->wmk", q, inside), np.linalg.solve(upper, inside)


class Refitter:
    """Fits the parameters of a :class:`WindowModel` to its windows.

    Args:
        model: predicts.
        sigma: (8,) or (W, T, 8) standard deviations of the channels; infinity leaves a channel out.
        effects: missing physics that stays fixed.
        progress: called after each iteration.
        robust: size of a weighted residual from which its cost grows linearly (P. J. Huber, Ann. Math. Statist. 35
            (1964) 73), one or (8,); infinity for plain least squares.
    """

    def __init__(
        self,
        model: WindowModel,
        sigma: Array,
        effects: Sequence[Effect] = (),
        progress: Callable[[], None] = lambda: None,
        robust: float | Array = np.inf,
    ) -> None:
        self.model = model
        windows = model.windows
        self._sigma = np.broadcast_to(sigma, windows.measured.shape)
        self._mask = (np.isfinite(windows.measured) & np.isfinite(self._sigma)).astype(float)
        self._effects = tuple(effects)
        self._progress = progress
        self._robust = np.broadcast_to(np.asarray(robust, dtype=np.float64), windows.measured.shape)
        self._prior = np.array([p.prior for p in model.parameters])
        self._low = np.array([p.low for p in model.parameters])
        self._high = np.array([p.high for p in model.parameters])

    def _window_costs(self, states: Array, prediction: Array) -> Array:
        """(W,) half sums of squares (Huber's loss where asked for), with the states' prior; infinite for NaN."""
        size = np.abs(weighted(self.model.windows.measured, prediction, self._sigma)) * self._mask
        linear = np.minimum(size, self._robust)
        misfit = linear * (2.0 * size - linear)
        start = (states - self.model.windows.initial) / STATE_PRIOR
        cost = 0.5 * (misfit.sum(axis=(1, 2)) + (start**2).sum(axis=1))
        broken = ~np.isfinite(np.where(self._mask > 0.0, prediction, 0.0)).all(axis=(1, 2))
        return np.where(broken, np.inf, cost)

    def _robust_roots(self, residual: Array) -> Array:
        """Roots of Huber's weights (W, T, 8)."""
        size = np.abs(residual)
        ratio = np.minimum(size, self._robust) / np.where(size > 0.0, size, 1.0)
        return np.where(size > 0.0, np.sqrt(ratio), 1.0)

    def _cost(self, values: Array, states: Array) -> tuple[float, Array]:
        prediction = self.model.predict(values, states, self._effects)
        cost = float(self._window_costs(states, prediction).sum() + 0.5 * ((values / self._prior) ** 2).sum())
        return cost, prediction

    def fit(
        self, values: Array | None = None, states: Array | None = None, iterations: int = 12, tolerance: float = 1e-4
    ) -> Refit:
        """Gauss-Newton from ``values`` (0 by default) and ``states`` (the windows' first guess)."""
        values = np.zeros(len(self._prior)) if values is None else values.copy()
        states = self.model.windows.initial.copy() if states is None else states.copy()
        cost, prediction = self._cost(values, states)
        converged, done = False, 0
        information, scores = np.diag(1.0 / self._prior**2), np.zeros((1, len(values)))
        for _ in range(iterations):
            done += 1
            d_values, d_states, information, scores = self._step(values, states, prediction)
            before = cost
            for damping in _DAMPING:
                tried = np.clip(values + damping * d_values, self._low, self._high)
                # the states' step answers the parameters' step that was really made
                new_states = states + damping * d_states
                new_cost, new_prediction = self._cost(tried, new_states)
                if new_cost < cost:
                    values, states, cost, prediction = tried, new_states, new_cost, new_prediction
                    break
            self._progress()
            if before - cost < tolerance * cost:
                converged = True
                break
        covariance = np.linalg.inv(information)
        spread = scores @ covariance
        bound = (values <= self._low + 1e-9) | (values >= self._high - 1e-9)
        names = tuple(p.name for p, stuck in zip(self.model.parameters, bound, strict=True) if stuck)
        return Refit(
            values, np.sqrt(np.diag(covariance)), states, prediction, cost, done, converged, names,
            np.sqrt((spread**2).sum(axis=0)),
        )  # fmt: skip

    def fit_states(self, values: Array, states: Array | None = None, iterations: int = 2) -> tuple[Array, Array]:
        """Initial states (W, 8) and prediction (W, T, 8) at fixed parameters.

        Args:
            values: (P,).
            states: to start from; the windows' first guess by default.
            iterations: Gauss-Newton steps; a step that raises a window's cost is not taken in that window.
        """
        windows = self.model.windows
        states = windows.initial.copy() if states is None else states.copy()
        prediction = self.model.predict(values, states, self._effects)
        cost = self._window_costs(states, prediction)
        for _ in range(iterations):
            residual = weighted(windows.measured, prediction, self._sigma)
            mask = self._mask * self._robust_roots(residual)
            by_state = self.model.state_derivatives(values, states, prediction, self._effects) / self._sigma[..., None]
            flat = (windows.count, -1)
            right = np.concatenate([(residual * mask).reshape(flat), (windows.initial - states) / STATE_PRIOR], axis=1)
            left = with_prior(by_state.reshape(*flat, by_state.shape[-1]), mask.reshape(flat))
            _, change = project(right[..., None], left)
            tried = states + change[..., 0]
            moved = self.model.predict(values, tried, self._effects)
            new_cost = self._window_costs(tried, moved)
            better = new_cost < cost
            states[better], prediction[better], cost[better] = tried[better], moved[better], new_cost[better]
        return states, prediction

    def linearise(self, values: Array, states: Array, prediction: Array) -> tuple[Array, Array, Array, Array]:
        """Weighted residual (W, M), state Jacobian (W, M, 8), parameter Jacobian (W, M, P) and mask (W, M).

        The mask is 0 where there is no sample; with a robust loss it holds the root of each residual's weight.
        """
        count = self.model.windows.count
        residual = weighted(self.model.windows.measured, prediction, self._sigma)
        by_state = self.model.state_derivatives(values, states, prediction, self._effects)
        by_value = self.model.parameter_derivatives(values, states, prediction, self._effects)
        scale = self._sigma[..., None]
        mask = self._mask * self._robust_roots(residual)
        flat = (count, -1)
        return (
            residual.reshape(flat),
            (by_state / scale).reshape(count, -1, by_state.shape[-1]),
            (by_value / scale).reshape(count, -1, by_value.shape[-1]),
            mask.reshape(flat),
        )

    def _step(self, values: Array, states: Array, prediction: Array) -> tuple[Array, Array, Array, Array]:
        residual, by_state, by_value, mask = self.linearise(values, states, prediction)
        # further rows: the prior pulls the states towards their first guess
        offset = (self.model.windows.initial - states) / STATE_PRIOR
        right = np.concatenate([residual * mask, offset], axis=1)
        left = np.concatenate([by_value * mask[..., None], np.zeros((*offset.shape, len(values)))], axis=1)
        columns, explained = project(np.concatenate([right[..., None], left], axis=2), with_prior(by_state, mask))
        r, b = columns[..., 0], columns[..., 1:]
        information = np.tensordot(b, b, axes=((0, 1), (0, 1))) + np.diag(1.0 / self._prior**2)
        scores = np.einsum("wmp,wm->wp", b, r)
        gradient = scores.sum(axis=0) - values / self._prior**2
        d_values = _bounded_step(information, gradient, self._low - values, self._high - values)
        d_states = explained[..., 0] - explained[..., 1:] @ d_values
        return d_values, d_states, information, scores


def _bounded_step(information: Array, gradient: Array, low: Array, high: Array) -> Array:
    """Minimum of the quadratic model within bounds on the step: what would leave them is held at its bound."""
    step = np.zeros(len(gradient))
    free = np.ones(len(gradient), dtype=bool)
    while free.any():
        right = gradient[free] - information[np.ix_(free, ~free)] @ step[~free]
        step[free] = np.linalg.solve(information[np.ix_(free, free)], right)
        outside = free & ((step < low) | (step > high))
        if not outside.any():
            break
        step[outside] = np.clip(step[outside], low[outside], high[outside])
        free &= ~outside
    return step
