"""The ladder of controllers by name, with the gains that the search on the validation set found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.config import configs_dir, load_config
from ddagr_gym.control.constant_speeds import ConstantSpeeds
from ddagr_gym.control.force_balance import ForceBalance
from ddagr_gym.control.pid import PidGains
from ddagr_gym.control.radial_pid import RadialPid
from ddagr_gym.control.rolling import RollingWithoutSlip
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.control.true_curvature import TrueCurvature
from ddagr_gym.control.yaw_rate_pid import YawRatePid
from ddagr_gym.errors import unknown_name
from ddagr_gym.estimation import FilterModel
from ddagr_gym.estimation.force_balance import arc_bank_speeds
from ddagr_gym.evaluation.calibration import calibrate_constant_speeds
from ddagr_gym.evaluation.runs import Controller
from ddagr_gym.parameters import Sensors
from ddagr_gym.presets import ddagr, get_soil


@dataclass(frozen=True)
class LadderGains:
    """Gains of the closed loops.

    Attributes:
        yaw_rate: of B2, curvature per yaw rate.
        radial: of B3, curvature per distance.
        force_balance: of B4.
        true_curvature: of the upper bound.
    """

    yaw_rate: PidGains
    radial: PidGains
    force_balance: PidGains
    true_curvature: PidGains


def ladder_gains() -> LadderGains:
    """Gains of ``configs/evaluation/ladder_gains.yaml``, where the search writes its result."""
    return load_config(configs_dir() / "evaluation" / "ladder_gains.yaml", LadderGains)


@lru_cache(maxsize=64)
def nominal_constants(turn: RowTurn) -> ConstantSpeeds:
    """B1 for a turn, calibrated on the nominal robot and soil."""
    return calibrate_constant_speeds(ddagr(), get_soil("thesis_a1"), turn)


def _track_ratio(constants: ConstantSpeeds, turn: RowTurn) -> float:
    spread = (constants.outer - constants.inner) / (constants.outer + constants.inner)
    return spread * turn.radius / ddagr().half_track


def _make_yaw_rate(turn: RowTurn) -> Controller:
    constants = nominal_constants(turn)
    return YawRatePid(ddagr(), ladder_gains().yaw_rate, _track_ratio(constants, turn), constants.lead)


def _make_radial(turn: RowTurn) -> Controller:
    constants = nominal_constants(turn)
    robot = ddagr()
    speed_ratio = turn.speed / (robot.wheels[0].outer_radius * 0.5 * (constants.outer + constants.inner))
    return RadialPid(robot, ladder_gains().radial, _track_ratio(constants, turn), speed_ratio, constants.lead)


def _make_bound(turn: RowTurn) -> Controller:
    constants = nominal_constants(turn)
    return TrueCurvature(ddagr(), ladder_gains().true_curvature, _track_ratio(constants, turn), constants.lead)


def _make_force_balance(turn: RowTurn) -> Controller:
    constants, robot = nominal_constants(turn), ddagr()
    model = FilterModel.of(robot, Sensors())
    prior = model.soil_prior.logs(model.wheel_load)[0]

    def feed_forward(logs: NDArray[np.float64], speed: float, curvature: float) -> tuple[float, float] | None:
        return arc_bank_speeds(model, np.exp(prior + logs), speed, curvature)

    gains = ladder_gains().force_balance
    return ForceBalance(robot, gains, feed_forward, _track_ratio(constants, turn), constants.lead)


EKF_CONTROLLERS = ("B4",)
"""Controllers that need the filter's features in the observation."""

_LADDER: dict[str, tuple[Callable[[RowTurn], Controller], str]] = {
    "B0": (lambda turn: RollingWithoutSlip(ddagr()), "wheel speeds of a robot that rolls without slip"),
    "B1": (nominal_constants, "two constant speeds calibrated on the nominal soil"),
    "B2": (_make_yaw_rate, "PID on the yaw rate (naive)"),
    "B3": (_make_radial, "feed-forward and PID on the radial error of dead reckoning"),
    "B4": (_make_force_balance, "force balance at the filter's estimate and PI on the estimated curvature"),
    "true_curvature": (_make_bound, "upper bound: PI on the true curvature, not deployable"),
}


def controller_names() -> tuple[str, ...]:
    """Names that :func:`find_controller` takes."""
    return tuple(_LADDER)


def controller_title(name: str) -> str:
    """What a controller is, in a phrase."""
    if name not in _LADDER:
        raise unknown_name("controller", name, _LADDER)
    return _LADDER[name][1]


def find_controller(name: str, turn: RowTurn) -> Controller:
    """Controller by name for a commanded turn.

    Raises:
        InputError: unknown name, with the closest ones.
    """
    if name not in _LADDER:
        raise unknown_name("controller", name, _LADDER)
    return _LADDER[name][0](turn)
