"""The nominal simulator as fitted to recordings, as a robot and a soil: the centre of a bootstrap of it."""

from __future__ import annotations

from collections.abc import Sequence

from ddagr_gym.diagnosis.search.starting_models import refit_nominal
from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.identification.fitted_values import with_values
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.recordings.schema import Recording


def fitted_nominal(robot: Robot, soil: Soil, recordings: Sequence[Recording], setting: Setting) -> tuple[Robot, Soil]:
    """Robot and soil with the nuisance parameters that fit recordings best; nothing is assumed to be missing.

    Args:
        robot: nominal.
        soil: nominal.
        recordings: at least one, of one robot and period.
        setting: of the diagnosis.
    """
    problem = make_problem(robot, soil, recordings, setting)
    _, fitted = refit_nominal(problem)
    names = [parameter.name for parameter in problem.nuisances.parameters]
    return with_values(robot, soil, dict(zip(names, fitted.point.values.tolist(), strict=True)))
