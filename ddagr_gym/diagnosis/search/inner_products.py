"""Inner products of residual, nuisances and columns by group of windows, and what is left beside the nuisances.

Scores, gains, held-out gains and resampled ones follow from sums of these small matrices, without another simulation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.search.candidates import Candidate
from ddagr_gym.identification.least_squares import explained_by

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Reduced:
    """Gradient and information of all columns with the nuisances projected out.

    Attributes:
        gradient: (K,).
        information: (K, K).
        nuisance: (P, 1 + K) best nuisance change without columns, and its answer to each column.
    """

    gradient: Array
    information: Array
    nuisance: Array


@dataclass(frozen=True, eq=False)
class InnerProducts:
    """Inner products by group, unknowns of the windows eliminated.

    Attributes:
        normals: (G, 1 + P + K, 1 + P + K) of residual, nuisances and columns, in this order.
        precision: (P,) of the nuisances' priors.
        values: (P,) where the nuisances stand, from their priors' middle.
    """

    ridge: ClassVar[float] = 0.0
    """Added to the nuisances' information, relative to it: for nuisances without a prior."""

    normals: Array
    precision: Array
    values: Array

    @property
    def nuisances(self) -> int:
        """P."""
        return len(self.precision)

    def reduced(self, weights: Array | None = None) -> Reduced:
        """Sum of the groups, weighted with (G,) if given, the nuisances projected out (theory: diagnosis, eq. (2)).

        The nuisances' priors count with the mean of the weights.
        """
        total = self.normals.sum(axis=0) if weights is None else np.tensordot(weights, self.normals, axes=1)
        share = 1.0 if weights is None else float(np.mean(weights))
        p, precision = self.nuisances, self.precision * share
        right = np.concatenate([total[1 : 1 + p, :1], total[1 : 1 + p, 1 + p :]], axis=1)
        right[:, 0] -= precision * self.values
        answer = explained_by(total[1 : 1 + p, 1 : 1 + p], precision, right, self.ridge)
        cross = total[1 + p :, 1 : 1 + p]
        return Reduced(
            total[1 + p :, 0] - cross @ answer[:, 0], total[1 + p :, 1 + p :] - cross @ answer[:, 1:], answer
        )


@dataclass(frozen=True, eq=False)
class Terms(InnerProducts):
    """Inner products per window of the probes of a scan.

    Attributes:
        candidates: what the probes are of.
        recording: (W,) of each window.
        time: (W,) of each window [s].
        turned: recordings whose headings are unknown.
        overlap: by effect, share of what it does that lies in the windows and channels in which the effects of the
            model act already (0 to 1); empty for a model without effects.
        absorbed: by effect, the size that a nuisance would take over without a trace.
        imitated: by effect, what it would gain, times the dispersion, by the lean that the effects of the model add
            and the simulator leaves out; empty where they add none.
    """

    candidates: tuple[Candidate, ...]
    recording: NDArray[np.int64]
    time: Array
    turned: tuple[int, ...] = ()
    overlap: Mapping[str, float] = field(default_factory=dict)
    absorbed: Mapping[str, float] = field(default_factory=dict)
    imitated: Mapping[str, float] = field(default_factory=dict)

    @property
    def placed(self) -> NDArray[np.bool_]:
        """(W,) windows whose headings in the world are known."""
        return ~np.isin(self.recording, np.array(self.turned, dtype=np.int64))

    @property
    def frames(self) -> list[Array]:
        """(W,) windows, as weights, of each part whose directions in the world are known to each other."""
        own = [self.recording == number for number in self.turned]
        return [chosen.astype(float) for chosen in (self.placed, *own) if chosen.any()]
