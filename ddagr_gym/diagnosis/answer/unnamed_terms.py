"""What has no name, as the answer of a diagnosis says it: an equation of sparse terms beside a flexible baseline."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class UnnamedTerm:
    """One term of the equation.

    Attributes:
        regressor: on what it depends.
        target: what it is added to: F_x, F_y, M_z [N, N m], gravity_x, gravity_y [m/s^2], command_right, command_left
            [rad/s], or the name of a channel.
        coefficient: in unit.
        unit: of the target over that of the regressor.
        interval: 90 %, from fits that leave out one stretch at a time.
        stability: share of the halves of the data in which the term was taken.
        alternatives: terms that say nearly the same in these drives, "target ~ regressor".
    """

    regressor: str
    target: str
    coefficient: float
    unit: str
    interval: tuple[float, float]
    stability: float
    alternatives: tuple[str, ...] = ()


@dataclass(frozen=True)
class UnnamedTerms:
    """What no name of the library explains.

    Attributes:
        equation: sum of the terms, "" where none was stable.
        terms: of the equation.
        equation_share: share of the residual sum of squares, noise included, that the equation removes on stretches
            that it was not fitted to.
        ceiling_share: the same of a flexible model of the same signals: what anything could explain.
        where: operating condition or place in which it acts.
    """

    equation: str
    terms: tuple[UnnamedTerm, ...]
    equation_share: float
    ceiling_share: float
    where: str
