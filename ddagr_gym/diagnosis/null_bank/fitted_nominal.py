"""The nominal simulator as fitted to recordings, as a robot and a soil: the centre of a bootstrap of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ddagr_gym.diagnosis.search.starting_models import refit_nominal
from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.identification.fitted_values import with_values
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.recordings.schema import Recording

FARTHEST = 4.0
"""Prior standard deviations within which a fitted robot may be the nominal one (ours: beyond, missing physics has gone
into it; on real drives of which the simulator lacks the drivetrain a wheelbase came out 15 of them too short)."""


@dataclass(frozen=True)
class FittedNominal:
    """The nominal simulator with the nuisance parameters that fit recordings best.

    Attributes:
        robot: fitted.
        soil: fitted.
        farthest: parameter that is farthest from the nominal one, in its prior's standard deviations.
        deviations: how far it is, without a sign.
    """

    robot: Robot
    soil: Soil
    farthest: str
    deviations: float

    @property
    def credible(self) -> bool:
        """Whether the fit is a robot and a soil that the nominal ones may stand for."""
        return self.deviations <= FARTHEST


def fitted_nominal(robot: Robot, soil: Soil, recordings: Sequence[Recording], setting: Setting) -> FittedNominal:
    """Robot and soil with the nuisance parameters that fit recordings best; nothing is assumed to be missing.

    Args:
        robot: nominal.
        soil: nominal.
        recordings: at least one, of one robot and period.
        setting: of the diagnosis.
    """
    problem = make_problem(robot, soil, recordings, setting)
    _, fitted = refit_nominal(problem)
    found = list(zip(problem.nuisances.parameters, fitted.point.values.tolist(), strict=True))
    far = {p.name: abs(value) / p.prior for p, value in found if p.entries and p.scope is None and p.prior > 0.0}
    farthest = max(far, key=far.__getitem__)
    moved = with_values(robot, soil, {parameter.name: value for parameter, value in found})
    return FittedNominal(*moved, farthest, far[farthest])
