"""The linearised least-squares problem of a fit: local unknowns eliminated, robust weights, bounded step, deviations.

A window w leaves the weighted residual r_w. It depends on local unknowns u_w (the window's initial state, its own soil)
and on shared parameters p. With the sensitivities A_w = -dr_w/du_w and B_w = -dr_w/dp a fit minimises, to first order,

    sum_w 1/2 |r_w - A_w du_w - B_w dp|^2 + 1/2 |(p + dp - m)/s|^2,    low <= p + dp <= high,                       (1)

with expected values m and prior standard deviations s. Priors of the local unknowns are further rows of r_w and A_w.

Elimination: with the thin QR factors A_w = Q_w R_w, the best du_w = R_w^-1 Q_w' (r_w - B_w dp) leaves of every column c
the part P_w c = c - Q_w Q_w' c (:class:`Elimination`), and (1) becomes a problem in dp alone with                  (2)

    information  H = sum_w (P_w B_w)' (P_w B_w) + diag(s^-2),
    gradient     g = sum_w (P_w B_w)' (P_w r_w) - (p - m)/s^2    (:class:`Linearised`).                             (3)

Step: the minimum of 1/2 dp'H dp - g'dp inside the bounds (:func:`bounded_step`).                                   (4)

Robust loss: beyond a size k a weighted residual costs k (2|r| - k)/2 instead of r^2/2 (P. J. Huber, Ann. Math. Statist.
35 (1964) 73); rows are weighted with the root of min(|r|, k)/|r| (iteratively reweighted least squares).           (5)

Deviations: H^-1, which takes the rows' noise as independent, and the sandwich H^-1 (sum_w g_w g_w') H^-1 with the
windows' shares g_w of the gradient, which allows for correlated residuals inside a window (P. J. Huber, 5th Berkeley
Symp. (1967) 221; H. White, Econometrica 48 (1980) 817).                                                            (6)

The numbers are this module's. The theory page derives them: (1) is theory: identification, eq. (6); (2) is theory:
identification, eq. (7); (3) and (4) are theory: identification, eq. (8); (6) is theory: identification, eq. (9). That
page writes B_w for the local and A_w for the shared sensitivities.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_LEAST_CURVATURE = 1e-30
"""Information that stands for none: a parameter without it must not divide by 0."""

_RIDGE = 1e-9
"""Added to the correlation matrix of the parameters, so that rounding cannot make it singular; far below any prior."""

_LEAST_INFORMATION = 1e-12
"""Of a parameter, before a relative ridge is taken of it."""

_OPEN = 1e-12
"""Half the width of the interval of a parameter that is held, in standard deviations: the solver refuses empty ones."""


@dataclass(frozen=True, eq=False)
class Elimination:
    """Orthonormal basis of what the local unknowns of each window explain, equation (2).

    Attributes:
        basis: (W, R, S).
        upper: (W, S, S) triangular factor.
        roots: (W, R) roots of the rows' robust weights; None where all are 1.
    """

    basis: Array
    upper: Array
    roots: Array | None = None

    @classmethod
    def of(cls, by_unknown: Array, roots: Array | None = None) -> Elimination:
        """Factors of sensitivities (W, R, S) to the local unknowns, their priors included, so that the rank is full."""
        basis, upper = np.linalg.qr(by_unknown if roots is None else by_unknown * roots[..., None])
        return cls(basis, upper, roots)

    def project(self, columns: Array) -> Array:
        """Columns (W, R, K), robustly weighted, without what the local unknowns explain."""
        columns = self._weighted(columns)
        explained = np.matmul(self.basis, np.matmul(self.basis.transpose(0, 2, 1), columns))
        return np.subtract(columns, explained, out=explained)

    def explain(self, columns: Array) -> Array:
        """(W, S, K) changes of the local unknowns that explain columns (W, R, K) best."""
        inside = np.matmul(self.basis.transpose(0, 2, 1), self._weighted(columns))
        return np.asarray(np.linalg.solve(self.upper, inside), dtype=np.float64)

    def explained_square(self, residual: Array) -> float:
        """Sum of squares that the local unknowns explain of residuals (W, R), robustly weighted: |Q_w' r_w|^2."""
        inside = np.matmul(self.basis.transpose(0, 2, 1), self._weighted(residual[..., None]))
        return float((inside**2).sum())

    def remaining(self, residual: Array) -> Array:
        """Residuals (W, R) where the local unknowns are at their best, without robust weights."""
        return self.unweighted(self.project(residual[..., None])[..., 0])

    def unweighted(self, projected: Array) -> Array:
        """Projected rows (W, R) without the robust weights that :meth:`project` gave them."""
        return projected if self.roots is None else projected / self.roots

    def subset(self, chosen: NDArray[np.int64] | NDArray[np.bool_]) -> Elimination:
        """Only the chosen windows."""
        return Elimination(self.basis[chosen], self.upper[chosen], None if self.roots is None else self.roots[chosen])

    def _weighted(self, columns: Array) -> Array:
        return columns if self.roots is None else columns * self.roots[..., None]


@dataclass(frozen=True, eq=False)
class Linearised:
    """Problem (1) in the shared parameters alone.

    Attributes:
        residual: (W, R) P_w r_w.
        sensitivity: (W, R, P) P_w B_w.
        here: (P,) values p.
        expected: (P,) values m that the priors expect.
        deviation: (P,) their standard deviations s; infinite where nothing is expected.
        low: (P,) bounds.
        high: (P,) bounds.
    """

    residual: Array
    sensitivity: Array
    here: Array
    expected: Array
    deviation: Array
    low: Array
    high: Array

    @property
    def precision(self) -> Array:
        """(P,) s^-2."""
        return np.asarray(1.0 / self.deviation**2)

    @property
    def information(self) -> Array:
        """(P, P) H of equation (3)."""
        by_data = np.einsum("wmp,wmq->pq", self.sensitivity, self.sensitivity, optimize=True)
        return np.asarray(by_data + np.diag(self.precision))

    @property
    def gradient(self) -> Array:
        """(P,) g of equation (3), downhill."""
        by_data = np.einsum("wmp,wm->p", self.sensitivity, self.residual)
        return np.asarray(by_data - self.precision * (self.here - self.expected))

    def step(self, information: Array, gradient: Array, longest: float) -> Array:
        """(P,) bounded step of at most ``longest`` prior standard deviations in each parameter, equation (4)."""
        reach = longest * self.deviation
        low, high = np.maximum(self.low - self.here, -reach), np.minimum(self.high - self.here, reach)
        return bounded_step(information, gradient, low, high)

    def after(self, change: Array) -> Array:
        """(P,) values after a step, which rounding does not carry over a bound."""
        return np.clip(self.here + change, self.low, self.high)

    def deviations(self) -> tuple[Array, Array]:
        """Standard deviations (P,) by H^-1 and by the sandwich, equation (6)."""
        covariance = np.linalg.inv(self.information)
        scores = np.einsum("wmp,wm->wp", self.sensitivity, self.residual) @ covariance
        return np.sqrt(np.diag(covariance)), np.sqrt((scores**2).sum(axis=0))


def beside_residual(residual: Array, *sensitivities: Array) -> Array:
    """Columns (W, R, 1 + K): the residual (W, R), then sensitivities (W, M, K) with zeros in the priors' rows."""
    columns = np.zeros((*residual.shape, 1 + sum(part.shape[2] for part in sensitivities)))
    columns[..., 0] = residual
    first = 1
    for part in sensitivities:
        columns[:, : part.shape[1], first : first + part.shape[2]] = part
        first += part.shape[2]
    return columns


def explained_by(inner: Array, precision: Array, right: Array, ridge: float = 0.0) -> Array:
    """Changes of parameters that explain columns best: the minimum of (1) without bounds, one column at a time.

    Args:
        inner: (P, P) inner products of the parameters' sensitivities.
        precision: (P,) s^-2.
        right: (P,) or (P, N) inner products of these sensitivities with the columns.
        ridge: added to the information, relative to it, where parameters without a prior may say the same.
    """
    information = inner + np.diag(precision)
    if ridge > 0.0:
        information = information + np.diag(ridge * np.maximum(np.diag(information), _LEAST_INFORMATION))
    return np.asarray(np.linalg.solve(information, right), dtype=np.float64)


def huber_loss(residual: Array, limit: Array | float) -> Array:
    """Loss of each residual, half its square up to ``limit`` and linear beyond, equation (5)."""
    size = np.abs(residual)
    linear = np.minimum(size, limit)
    return np.asarray(0.5 * linear * (2.0 * size - linear))


def huber_roots(residual: Array, limit: Array | float) -> Array:
    """Roots of the weights with which squares have the gradient of that loss, equation (5)."""
    size = np.abs(residual)
    return np.sqrt(np.minimum(size, limit) / np.where(size > 0.0, size, 1.0), where=size > 0.0, out=np.ones(size.shape))


def bounded_step(information: Array, gradient: Array, low: Array, high: Array) -> Array:
    """Newton step inside bounds: the minimum of the quadratic model there (bounded-variable least squares).

    Theory: identification, eq. (8).

    Args:
        information: (P, P), positive definite or nearly so.
        gradient: (P,) downhill.
        low: (P,) at most 0.
        high: (P,) at least 0.
    """
    from scipy.optimize import lsq_linear

    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), _LEAST_CURVATURE))
    scaled = information * np.outer(scale, scale) + _RIDGE * np.eye(len(scale))
    lower = np.linalg.cholesky(scaled)
    right = np.linalg.solve(lower, gradient * scale)
    bounds = (np.minimum(low, 0.0) / scale - _OPEN, np.maximum(high, 0.0) / scale + _OPEN)
    found = lsq_linear(lower.T, right, bounds=bounds, method="bvls")
    return np.asarray(found.x * scale)
