"""Stability selection on sums of inner products: which columns a Lasso takes again and again on halves of the data.

Meinshausen and Buehlmann (2010) with the complementary pairs of Shah and Samworth (2013). Of p exchangeable columns
without a part in the truth, of which each Lasso takes q, at most q^2/((2 pi - 1) p) are expected in more than the share
pi of the halves. Columns that say nearly the same are one cluster, or their votes would be split (Faletto and Bien,
2022); found ones join the nuisances and the rest is searched again.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.search.inner_products import InnerProducts, Reduced
from ddagr_gym.identification.least_squares import explained_by

Array = NDArray[np.float64]

STABLE = 0.75
"""Share of the halves in which a stable column is taken (0.6 to 0.9 in the paper)."""

FALSE_SELECTIONS = 0.25
"""Bound of the expected number of false selections in a search."""

ALIKE = 0.9
"""Correlation from which columns count as one (ours)."""

_PAIRS = 50
"""Complementary pairs of halves: 100 halves, the number of Meinshausen and Buehlmann, 50 pairs of Shah and Samworth."""

_LEAST_SHARE = 1e-6  # of a column's information beside the nuisances: less is rounding


@dataclass(frozen=True, eq=False)
class Sums(InnerProducts):
    """Inner products by group (a stretch of a recording), of which columns may join the nuisances."""

    ridge: ClassVar[float] = 1e-9

    def chosen(self, columns: Sequence[int], joined: Sequence[int] = ()) -> Sums:
        """Only some columns; ``joined`` become nuisances without a prior."""
        p = self.nuisances
        index = np.concatenate([np.arange(1 + p), 1 + p + np.asarray([*joined, *columns], dtype=np.int64)])
        none = np.zeros(len(joined))
        return Sums(
            self.normals[np.ix_(np.arange(len(self.normals)), index, index)],
            np.concatenate([self.precision, none]),
            np.concatenate([self.values, none]),
        )


@dataclass(frozen=True)
class Stable:
    """A cluster of columns that is taken again and again.

    Attributes:
        column: the member that explains most.
        alike: all members.
        share: of the halves.
    """

    column: int
    alike: tuple[int, ...]
    share: float


def clusters(information: Array, alike: float = ALIKE) -> NDArray[np.int64]:
    """(K,) cluster of each column; all pairs inside one correlate by at least ``alike``.

    Args:
        information: (K, K).
        alike: least correlation.
    """
    from scipy.cluster.hierarchy import fcluster, linkage
    from scipy.spatial.distance import squareform

    scale = 1.0 / np.sqrt(np.diag(information))
    distance = 1.0 - np.abs(information * np.outer(scale, scale)).clip(0.0, 1.0)
    np.fill_diagonal(distance, 0.0)
    if len(distance) < 2:
        return np.zeros(len(distance), dtype=np.int64)
    joined = linkage(squareform(distance, checks=False), "complete")
    return np.asarray(fcluster(joined, 1.0 - alike, "distance") - 1, dtype=np.int64)


def lasso_takes(gradient: Array, information: Array, count: int) -> NDArray[np.int64]:
    """Indices of the first ``count`` columns on the Lasso's path, standardised."""
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.linear_model import lars_path_gram

    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-30))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        _, active, _ = lars_path_gram(
            gradient * scale, information * np.outer(scale, scale), n_samples=1, max_iter=count, method="lasso"
        )
    return np.asarray(active, dtype=np.int64)


def select(
    sums: Sums,
    plainness: Sequence[int],
    rng: np.random.Generator,
    *,
    worth: Callable[[Sequence[int]], float] | None = None,
    least: float = 0.0,
    most: int = 4,
) -> list[Stable]:
    """Stable columns, one after the other: of those that are stable the one that is worth most.

    Theory: diagnosis, eq. (13).

    Args:
        sums: by group; halves are drawn of the groups.
        plainness: (K,) rank; of members of a cluster that explain the same the plainer one is given.
        rng: of the halves.
        worth: of columns together; without it all stable ones are kept.
        least: by which each column must raise the worth, when it is found and beside those found later.
        most: columns to find.
    """
    found: list[Stable] = []
    while len(found) < most:
        taken = [item.column for item in found]
        near = _search(sums, taken, plainness, rng)
        if worth is not None:
            rise = {item.column: worth([*taken, item.column]) - worth(taken) for item in near}
            near = sorted((item for item in near if rise[item.column] >= least), key=lambda item: -rise[item.column])
        if not near:
            break
        found.append(near[0])
    return found if worth is None else _settled(found, plainness, worth, least)


def _settled(
    found: list[Stable], plainness: Sequence[int], worth: Callable[[Sequence[int]], float], least: float
) -> list[Stable]:
    """Each cluster's best member beside the others, without those that the others have made idle."""
    found = list(found)
    for number, item in enumerate(found):
        others = [other.column for other in found if other is not item]
        ranked = sorted(item.alike, key=lambda k: plainness[k])
        free = [k for k in ranked if k not in others]
        best = max(free, key=lambda k: round(worth([*others, k]) / max(least, 1e-9)))
        found[number] = Stable(best, item.alike, item.share)
    while found:
        whole = worth([item.column for item in found])
        losses = [whole - worth([o.column for o in found if o is not item]) for item in found]
        if min(losses) >= least:
            break
        del found[int(np.argmin(losses))]
    return found


def _search(sums: Sums, taken: list[int], plainness: Sequence[int], rng: np.random.Generator) -> list[Stable]:
    """Stable clusters beside columns that were taken before, the most stable first."""
    count = sums.normals.shape[1] - 1 - sums.nuisances
    rest = [k for k in range(count) if k not in taken]
    beside = sums.chosen(rest, taken)
    information = beside.reduced().information
    total = np.diagonal(beside.normals.sum(axis=0))[1 + beside.nuisances :]
    live = np.flatnonzero(np.diag(information) > _LEAST_SHARE * np.maximum(total, 1e-12))
    if len(live) < 2:
        return []
    columns = [rest[k] for k in live]
    beside = sums.chosen(columns, taken)
    reduced = beside.reduced()
    member = clusters(reduced.information)
    front = _fronts(reduced, member, [plainness[k] for k in columns])
    shares = _shares(sums.chosen([columns[k] for k in front], taken), rng)
    found = []
    for k in np.argsort(-shares, kind="stable"):
        if shares[k] >= STABLE:
            alike = tuple(columns[m] for m in np.flatnonzero(member == member[front[k]]))
            found.append(Stable(columns[front[k]], alike, float(shares[k])))
    return found


def _fronts(reduced: Reduced, member: NDArray[np.int64], plainness: Sequence[int]) -> list[int]:
    """One column of each cluster: the plainest of those that explain nearly as much as the best."""
    gain = 0.5 * reduced.gradient**2 / np.diag(reduced.information)
    front = []
    for cluster in range(int(member.max()) + 1):
        inside = np.flatnonzero(member == cluster)
        near = inside[gain[inside] >= 0.97 * gain[inside].max()]
        front.append(int(min(near, key=lambda k: (plainness[k], -gain[k]))))
    return front


def _shares(sums: Sums, rng: np.random.Generator) -> Array:
    """(K,) share of the halves in which each column is among the first that the Lasso takes."""
    groups, count = len(sums.normals), sums.normals.shape[1] - 1 - sums.nuisances
    take = max(int(np.sqrt(FALSE_SELECTIONS * (2.0 * STABLE - 1.0) * count)), 1)
    votes = np.zeros(count)
    for _ in range(_PAIRS):
        order = rng.permutation(groups)
        for half in (order[: groups // 2], order[groups // 2 : 2 * (groups // 2)]):
            weights = np.zeros(groups)
            weights[half] = 1.0
            half_sums = sums.reduced(weights)
            votes[lasso_takes(half_sums.gradient, half_sums.information, take)] += 1.0
    return votes / (2.0 * _PAIRS)


def held_out_share(sums: Sums, columns: Sequence[int], fold: NDArray[np.int64], ridge: float = 0.0) -> float:
    """Share of the residual sum of squares that columns remove on groups that they were not fitted to.

    Args:
        sums: by group.
        columns: that may move beside the nuisances.
        fold: (G,) part of each group.
        ridge: relative to each column's information.
    """
    if not len(columns):
        return 0.0
    part = sums.chosen(columns)
    before = after = 0.0
    for number in np.unique(fold):
        outside = (fold != number).astype(float)
        reduced = part.reduced(outside)
        theta, answer = _shrunk(reduced, ridge), reduced.nuisance
        inside = part.normals[fold == number].sum(axis=0)
        base = np.concatenate([[1.0], -answer[:, 0], np.zeros(len(theta))])
        full = np.concatenate([[1.0], -answer[:, 0] + answer[:, 1:] @ theta, -theta])
        before += float(base @ inside @ base)
        after += float(full @ inside @ full)
    return 1.0 - after / before if before > 0.0 else 0.0


def coefficients(sums: Sums, columns: Sequence[int], weights: Array | None = None) -> Array:
    """(len(columns),) least squares beside the nuisances."""
    return _shrunk(sums.chosen(columns).reduced(weights))


def _shrunk(reduced: Reduced, ridge: float = 0.0) -> Array:
    """(K,) coefficients at a penalty relative to each column's information."""
    none = np.zeros(len(reduced.gradient))
    return explained_by(reduced.information, none, reduced.gradient, ridge + Sums.ridge)


def intervals(sums: Sums, columns: Sequence[int], level: float) -> tuple[Array, Array]:
    """Ends (len(columns),) of intervals of the coefficients, from fits that leave out one group at a time.

    Errors inside a group may hang together in any way; only groups have to be independent. With some tens of groups, of
    which few show a column well, intervals from resampled groups are too narrow; the jackknife's variance with
    Student's quantiles keeps its level (J. MacKinnon, H. White, 1985; C. Hansen, 2007, for one group at a time).

    Args:
        sums: by group.
        columns: fitted together.
        level: of the intervals.
    """
    from scipy.stats import t as student

    groups = len(sums.normals)
    values = coefficients(sums, columns)
    without = np.stack([coefficients(sums, columns, weights) for weights in 1.0 - np.eye(groups)])
    variance = (groups - 1) / groups * ((without - without.mean(axis=0)) ** 2).sum(axis=0)
    reach = float(student.ppf(0.5 + 0.5 * level, groups - 1)) * np.sqrt(variance)
    return values - reach, values + reach
