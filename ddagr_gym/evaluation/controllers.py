"""The ladder of controllers by name, with the gains that the search on the validation set found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.control.constant_speeds import ConstantSpeeds
from ddagr_gym.control.force_balance import ForceBalance
from ddagr_gym.control.model_predictive import ModelPredictive, PredictiveSettings
from ddagr_gym.control.path_tracker import MotionEstimate, MotionEstimator, PathTracker
from ddagr_gym.control.pid import PidGains
from ddagr_gym.control.predictive_model import PredictiveModel
from ddagr_gym.control.radial_pid import RadialPid
from ddagr_gym.control.rolling import RollingWithoutSlip
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.control.timing import CONTROL_PERIOD
from ddagr_gym.control.tracker_settings import SETTLING, STANDING, LoopSettings
from ddagr_gym.control.true_curvature import TrueCurvature
from ddagr_gym.control.true_path import TruePath
from ddagr_gym.control.true_soil import TrueSoil
from ddagr_gym.control.yaw_rate_pid import YawRatePid
from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.estimation import FilterModel
from ddagr_gym.estimation.dead_reckoning import DeadReckoning
from ddagr_gym.estimation.force_balance import arc_bank_speeds
from ddagr_gym.estimation.inertial_filter import InertialModel
from ddagr_gym.estimation.learned_filter import NOISY, LearnedModel
from ddagr_gym.evaluation.calibration import calibrate_constant_speeds
from ddagr_gym.evaluation.ladder_gains import LadderGains, ladder_gains
from ddagr_gym.evaluation.policy_seeds import arm_and_seed, policy_version
from ddagr_gym.evaluation.runs import BatchController, Controller
from ddagr_gym.parameters import Sensors
from ddagr_gym.physics.soil_laws import NOMINAL_LAW
from ddagr_gym.physics.steady_arc import soil_of, steady_bank_speeds
from ddagr_gym.presets import ddagr, get_soil

_Maker = Callable[[RowTurn, LadderGains], Controller]


@lru_cache(maxsize=64)
def nominal_constants(turn: RowTurn) -> ConstantSpeeds:
    """B1 for a turn, calibrated on the nominal robot and soil."""
    return calibrate_constant_speeds(ddagr(), get_soil("thesis_a1"), turn)


def _make_yaw_rate(turn: RowTurn, gains: LadderGains) -> Controller:
    constants, loop = nominal_constants(turn), gains.yaw_rate
    return YawRatePid(ddagr(), loop.gains, constants.track_ratio(turn, ddagr()), loop.lead_factor * constants.lead)


def _make_radial(turn: RowTurn, gains: LadderGains) -> Controller:
    constants, robot, loop = nominal_constants(turn), ddagr(), gains.radial
    speed_ratio = turn.speed / (robot.wheels[0].outer_radius * 0.5 * (constants.outer + constants.inner))
    lead = loop.lead_factor * constants.lead
    return RadialPid(robot, loop.gains, constants.track_ratio(turn, ddagr()), speed_ratio, lead)


@lru_cache(maxsize=1)
def _filter_knowledge() -> tuple[FilterModel, NDArray[np.float64]]:
    """The filter's model, and the logs of the parameters that its features count from."""
    model = FilterModel.of(ddagr(), Sensors())
    return model, model.soil_prior.logs(model.wheel_load)[0]


def _make_force_balance(turn: RowTurn, gains: LadderGains) -> Controller:
    constants, loop = nominal_constants(turn), gains.force_balance
    model, prior = _filter_knowledge()

    def feed_forward(logs: NDArray[np.float64], speed: float, curvature: float) -> tuple[float, float] | None:
        return arc_bank_speeds(model, np.exp(prior + logs), speed, curvature)

    ratio, lead = constants.track_ratio(turn, ddagr()), loop.lead_factor * constants.lead
    return ForceBalance(ddagr(), loop.gains, feed_forward, ratio, lead)


@lru_cache(maxsize=8)
def _predictive(settings: PredictiveSettings) -> ModelPredictive:
    model, prior = _filter_knowledge()
    prediction = PredictiveModel(
        ddagr(), model.outer_radius, model.rest_speed, model.reversal_speed, period=CONTROL_PERIOD
    )
    return ModelPredictive(prediction, prior, settings)


def inertial_model() -> InertialModel:
    """The inertial filter that knows the nominal robot and sensors."""
    return InertialModel.of(ddagr(), Sensors())


@lru_cache(maxsize=4)
def learned_model(estimator: str) -> LearnedModel:
    """A learned estimator that knows the nominal robot and sensors."""
    return LearnedModel.of(ddagr(), Sensors(), estimator)


def make_path_tracker(estimator: MotionEstimator, flat: FilterModel, standing: int) -> _Maker:
    """Maker of path trackers by their turn and the ladder's gains.

    Args:
        estimator: of the pose.
        flat: robot and force law of the feed-forward.
        standing: control periods for which it stands before it drives.
    """

    def steady_arc(at: MotionEstimate, speed: float, curvature: float) -> tuple[float, float] | None:
        return arc_bank_speeds(flat, at.soil, speed, curvature, at.gravity)

    def make(turn: RowTurn, gains: LadderGains) -> Controller:
        constants, loop = nominal_constants(turn), gains.path_tracker
        ratio, lead = constants.track_ratio(turn, ddagr()), loop.lead_factor * constants.lead
        return PathTracker(
            ddagr(), loop.gains, gains.path_tracker_course, estimator, steady_arc, ratio, lead, standing,
            gains.path_tracker_ahead, gains.path_tracker_side_slip, gains.path_tracker_aligning,
            gains.path_tracker_largest_slip,
        )  # fmt: skip

    return make


def _reckoned_tracker(model: FilterModel | InertialModel | LearnedModel, standing: int) -> _Maker:
    flat = model if isinstance(model, FilterModel) else model.flat
    return make_path_tracker(DeadReckoning(model, SETTLING), flat, standing)


def _make_learned_tracker(name: str, turn: RowTurn, gains: LadderGains) -> Controller:
    return _reckoned_tracker(learned_model(LEARNED_ESTIMATORS[name]), STANDING)(turn, gains)


def tracker_gains_by_hand(gains: LadderGains) -> LadderGains:
    """The path tracker's gains before they were searched, without look-ahead and aligning: those of B6_flat."""
    return replace(
        gains, path_tracker=LoopSettings(PidGains(73.0, 20.0, 0.0, 3.0), 0.43), path_tracker_course=12.0,
        path_tracker_ahead=0.0, path_tracker_side_slip=1.0, path_tracker_aligning=0.0, path_tracker_largest_slip=np.pi,
    )  # fmt: skip


def _make_flat_tracker(turn: RowTurn, gains: LadderGains) -> Controller:
    return _reckoned_tracker(_filter_knowledge()[0], 0)(turn, tracker_gains_by_hand(gains))


def _make_true_curvature(turn: RowTurn, gains: LadderGains) -> Controller:
    constants, loop = nominal_constants(turn), gains.true_curvature
    return TrueCurvature(ddagr(), loop.gains, constants.track_ratio(turn, ddagr()), loop.lead_factor * constants.lead)


def _make_true_soil(turn: RowTurn, gains: LadderGains) -> Controller:
    constants, loop, robot = nominal_constants(turn), gains.true_soil, ddagr()

    def feed_forward(soil: NDArray[np.float64], speed: float, curvature: float) -> tuple[float, float] | None:
        return steady_bank_speeds(robot, soil_of(soil), speed, curvature)

    ratio, lead = constants.track_ratio(turn, ddagr()), loop.lead_factor * constants.lead
    return TrueSoil(robot, loop.gains, feed_forward, ratio, lead)


def _make_true_path(turn: RowTurn, gains: LadderGains) -> Controller:
    constants, loop = nominal_constants(turn), gains.true_path
    ratio, lead = constants.track_ratio(turn, ddagr()), loop.lead_factor * constants.lead
    return TruePath(ddagr(), loop.gains, gains.true_path_heading, ratio, lead)


DEFAULT = "B6_pose_wide"
"""Controller that is used where none is named, by a rule written before the sets were driven that decided
(:mod:`benchmarks.fourth_sets`): 98 % success in the mean over 24 sets and plants, as B6, at the least radius error."""

EKF_CONTROLLERS = ("B4", "B5")
"""Controllers that need the filter's features in the observation."""

LEARNED_ESTIMATORS = {"B6_learned": "correction", "B6_pose": "pose", "B6_pose_wide": "pose_wide"}
"""Learned estimators of path trackers."""

INERTIAL_CONTROLLERS = ("B6", *LEARNED_ESTIMATORS)
"""Controllers with an inertial filter of their own."""

BOUNDS = ("true_curvature", "true_soil", "true_path")
"""Upper bounds, never deployable: they see the true state. A turn that none of them makes is infeasible."""

_LADDER: dict[str, tuple[_Maker, str]] = {
    "B0": (lambda turn, gains: RollingWithoutSlip(ddagr()), "wheel speeds of a robot that rolls without slip"),
    "B1": (lambda turn, gains: nominal_constants(turn), "two constant speeds calibrated on the nominal soil"),
    "B2": (_make_yaw_rate, "PID on the yaw rate (naive)"),
    "B3": (_make_radial, "feed-forward and PID on the radial error of dead reckoning"),
    "B4": (_make_force_balance, "force balance at the filter's estimate and PI on the estimated curvature"),
    "B5": (lambda turn, gains: _predictive(gains.predictive), "model-predictive control at the filter's estimate"),
    "B6": (
        lambda turn, gains: _reckoned_tracker(inertial_model(), STANDING)(turn, gains),
        "follows the path by the inertial filter's pose",
    ),
    "B6_flat": (
        _make_flat_tracker,
        "path tracker by the pose of the filter that takes the ground for level",
    ),
    "B6_learned": (
        lambda turn, gains: _make_learned_tracker("B6_learned", turn, gains),
        "B6 by the velocities of the learned estimator",
    ),
    "B6_pose": (
        lambda turn, gains: _make_learned_tracker("B6_pose", turn, gains),
        "B6 by velocities and place that a network corrects",
    ),
    "B6_pose_wide": (
        lambda turn, gains: _make_learned_tracker("B6_pose_wide", turn, gains),
        "B6 by velocities and place that a network corrects, which also learnt with worse sensors, motors and loads",
    ),
    "true_curvature": (_make_true_curvature, "upper bound, not deployable: PI on the true curvature"),
    "true_soil": (_make_true_soil, "upper bound, not deployable: B4 with the true soil and the true curvature"),
    "true_path": (_make_true_path, "upper bound, not deployable: follows the path by the true pose"),
}


def controller_names() -> tuple[str, ...]:
    """Names of the ladder, the upper bounds included; :func:`find_controller` takes trained policies besides."""
    return tuple(_LADDER)


def is_policy(name: str) -> bool:
    """Whether a name is that of a trained policy, or of its file."""
    from ddagr_gym.policies.controller import is_policy_name

    return name not in _LADDER and is_policy_name(name)


def is_adapted(name: str) -> bool:
    """Whether a name is that of no controller and of a folder that ``ddagr adapt`` wrote."""
    from ddagr_gym.evaluation.bundles import is_bundle

    return name not in _LADDER and is_bundle(name)


def _unknown(name: str) -> InputError:
    from ddagr_gym.policies.shipped import policy_names

    return unknown_name("controller", name, [*_LADDER, *policy_names()])


def controller_title(name: str) -> str:
    """What a controller is, in a phrase; InputError as :func:`find_controller`."""
    if is_adapted(name):
        from ddagr_gym.evaluation.bundles import load_bundle

        return f"{load_bundle(name).adapted_from} adapted to recordings, see its own page"
    if is_policy(name):
        from ddagr_gym.policies.controller import policy_title

        return policy_title(name)
    if name not in _LADDER:
        raise _unknown(name)
    return _LADDER[name][1]


def needs_filter(name: str) -> bool:
    """Whether the environment must append the filter's features for this controller."""
    if is_policy(name):
        from ddagr_gym.policies.controller import policy_needs_filter

        return policy_needs_filter(name)
    return name in EKF_CONTROLLERS


def observation_options(name: str) -> dict[str, Any]:
    """What the environment must be given so that its observation holds what this controller reads."""
    if is_policy(name):
        from ddagr_gym.policies.controller import policy_environment

        return policy_environment(name)
    return {"ekf_features": needs_filter(name)}


def has_inertial_filter(name: str) -> bool:
    """Whether a controller reads the raw samples by an inertial filter of its own."""
    return name in INERTIAL_CONTROLLERS


def estimates_path(name: str) -> bool:
    """Whether a controller steers by a filter, so that a path estimated by it is worth a look."""
    return has_inertial_filter(name) or needs_filter(name)


def is_deployable(name: str) -> bool:
    """Whether a controller does without the true state."""
    if is_policy(name):
        from ddagr_gym.policies.controller import is_deployable_policy

        return is_deployable_policy(name)
    return name not in BOUNDS


def drives_on(name: str, law: str) -> bool:
    """Whether a controller is meant for ground of a soil law: the bound with the true soil knows only one law."""
    return name != "true_soil" or law == NOMINAL_LAW


def controller_arm(name: str) -> tuple[str, int]:
    """Arm and run: the training's seed of a policy, 0 of a controller that is not trained."""
    return arm_and_seed(name) if is_policy(name) else (name, 0)


def controller_version(name: str) -> str:
    """Text that changes when a controller's gains or weights do."""
    if is_policy(name):
        return policy_version(name)
    if name in ("B0", "B1"):
        return name
    if is_adapted(name):
        from ddagr_gym.evaluation.bundles import bundle_version

        return bundle_version(name)
    text = f"{name} {ladder_gains()!r}"
    if name == "B6":
        return f"{text} {_model_text(inertial_model())} {SETTLING}"
    if name in LEARNED_ESTIMATORS:
        model = learned_model(LEARNED_ESTIMATORS[name])
        settling = f" {SETTLING}" if model.network.description.place else ""
        return f"{text} {_model_text(model.inertial)} {model.network.digest()} {NOISY:g}{settling}"
    return text


_ADDED_LATER = (
    ", sinkage_tilt=0.0", ", command_filter=0.0", ", learns_vibration=True", ", mean_ramp=1000000.0",
    ", turning_ramp=1000000.0",
)  # fmt: skip
"""Fields at the values that stand for what was there before them."""


def _model_text(model: InertialModel) -> str:
    """All that a filter knows; what robots and filters got later, and these have none of, is left out."""
    text = repr(model)
    for added in _ADDED_LATER:
        text = text.replace(added, "")
    return text


def find_controller(name: str, turn: RowTurn, gains: LadderGains | None = None) -> Controller:
    """Controller or trained policy by name for a commanded turn.

    Args:
        name: of the ladder, of a policy as :func:`ddagr_gym.policies.controller.policy_controller` takes it, or a
            folder that ``ddagr adapt`` wrote.
        turn: the commanded manoeuvre.
        gains: instead of :func:`ladder_gains`.

    Raises:
        InputError: unknown name, with the closest ones.
    """
    if is_policy(name):
        from ddagr_gym.policies.controller import policy_controller

        return policy_controller(name)
    if is_adapted(name):
        from ddagr_gym.evaluation.bundles import load_bundle

        return load_bundle(name).controller(turn)
    if name not in _LADDER:
        raise _unknown(name)
    return _LADDER[name][0](turn, ladder_gains() if gains is None else gains)


def find_batch(name: str, count: int) -> BatchController | None:
    """Trained policy that drives N turns side by side, or None where a controller drives one at a time.

    Args:
        name: of a controller.
        count: N.
    """
    if not is_policy(name):
        return None
    from ddagr_gym.policies.controller import policy_batch

    return policy_batch(name, count)
