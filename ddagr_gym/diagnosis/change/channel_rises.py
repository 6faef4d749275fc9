"""Channels of which a fit leaves more than of ordinary drives: something changed, whatever the library has of it.

Fits leave of a channel the mean square r_c (:func:`~ddagr_gym.identification.misfit.channel_misfit`). Its logarithm
has the mean m in n ordinary drives, and a deviation s that is drawn towards the expected one, F_c:

    s^2 = (d0 F_c^2 + sum (ln r_ci - m)^2)/(d0 + n - 1),    t = (ln r_c - m)/(s sqrt(1 + 1/n)),                     (1)

and t is compared with Student's distribution of d0 + n - 1 degrees of freedom, to one side: less is no change. Where
the windows of ordinary drives say that r_c itself is known less well, their relative standard error stands for s: what
a model lacks before as after shows more in one manoeuvre than in another.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ddagr_gym.diagnosis.change.expected_scatter import ExpectedScatter
from ddagr_gym.diagnosis.change.shifts import distance_at, single_level


@dataclass(frozen=True)
class ChannelRise:
    """What a fit leaves of a channel against ordinary drives.

    Attributes:
        channel: its name.
        usual: mean square that is left in ordinary drives (geometric mean).
        misfit: mean square that is left here.
        deviation: of the logarithm of their ratio.
        degrees: of freedom.
    """

    channel: str
    usual: float
    misfit: float
    deviation: float
    degrees: float

    @property
    def distance(self) -> float:
        """In deviations, equation (1); below 0 where less is left."""
        return float(np.log(self.misfit / self.usual) / self.deviation)

    @property
    def probability(self) -> float:
        """Of an ordinary drive to leave as much."""
        from scipy.special import stdtr

        return float(stdtr(self.degrees, -self.distance))

    def most(self, tests: int) -> float:
        """Mean square that ordinary drives exceed in any of so many tests at the level."""
        limit = distance_at(2.0 * single_level(tests), 1, self.degrees)
        return self.usual * float(np.exp(limit * self.deviation))


def channel_rises(
    misfit: Mapping[str, float],
    ordinary: Sequence[Mapping[str, float]],
    expected: ExpectedScatter,
    errors: Sequence[Mapping[str, float]] = (),
) -> tuple[ChannelRise, ...]:
    """Rises of all channels that the drive and ordinary ones have; none without ordinary drives.

    Args:
        misfit: mean square by channel that a fit leaves of the drive.
        ordinary: the same of each ordinary drive.
        expected: scatter before any data.
        errors: relative standard errors of the ordinary drives' mean squares by channel.
    """
    found = []
    for name, value in misfit.items():
        known = np.log([item[name] for item in ordinary if item.get(name, 0.0) > 0.0])
        if not known.size or value <= 0.0:
            continue
        degrees = expected.degrees + known.size - 1.0
        square = expected.degrees * expected.rise(name) ** 2 + float(((known - known.mean()) ** 2).sum())
        within = [item[name] ** 2 for item in errors if name in item]
        square = max(square / degrees, float(np.mean(within)) if within else 0.0)
        deviation = float(np.sqrt(square * (1.0 + 1.0 / known.size)))
        found.append(ChannelRise(name, float(np.exp(known.mean())), value, deviation, degrees))
    return tuple(found)
