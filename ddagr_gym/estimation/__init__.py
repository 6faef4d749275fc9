"""State and soil estimation from gyro, encoders and accelerometer, for a skid-steer robot on soft soil.

Nothing here knows the terramechanic truth model: the filter sees what a robot sees.

**State** (12; ``layout.STATE``), SI units, body axes x forward, y left, yaw counter-clockwise, banks (right, left):

=====  ==========================  =========  ==============================================================
entry  name                        unit       meaning
=====  ==========================  =========  ==============================================================
0, 1   v_x, v_y                    m/s        velocity of the body origin
2      yaw_rate                    rad/s
3, 4   omega_right, omega_left     rad/s      bank speeds, forward positive
5      log_traction_limit          ln N       a1 of the force law, one wheel
6      log_traction_rate           ln 1       a2
7      log_lateral_stiffness       ln N/rad   b
8      log_motion_resistance       ln N       Rc, one wheel
9      gyro_bias                   rad/s
10,11  accelerometer_bias_x, _y    m/s^2
=====  ==========================  =========  ==============================================================

**Inputs**: bank speed commands (right, left) [rad/s], constant until the sample; roll and pitch [rad] where known.
**Measurements** (``layout.CHANNELS``): specific force x, y [m/s^2], yaw rate [rad/s], encoders right, left [rad/s];
NaN: no sample. Order of things: predict with the command up to the time of a sample, then correct with the sample.

**Force of the soil on a wheel** (:mod:`~ddagr_gym.estimation.force_laws`), with rim = R0 omega::

    s_x = (rim - v_x)/d,  s_y = -v_y/d,  d = max(|rim|, |v_x|)          (smoothed near rest)
    thesis:   F_x = a1 sgn(s_x) (1 - exp(-a2 |s_x|)) - Rc sgn(rim + v_x),   F_y = -b atan2(v_y, |v_x|)
    coupled:  F_x = g s_x - Rc sgn(rim + v_x),  F_y = g c s_y,              g = a1 (1 - exp(-a2 q))/q,
              q^2 = s_x^2 + c s_y^2,  c = b/(a1 a2)

Rows (4.6), (4.7), (4.10) in consistent signs: ``dv_x/dt = r v_y + sum F_x/m``, ``dv_y/dt = -r v_x + sum F_y/m``,
``I dr/dt = W (F_x right - F_x left) + L (F_y front - F_y rear)``, sums over wheels.

The coupled law is the default: over random soils it fits wheel forces ten times closer than the thesis's with the same
four parameters, because a wheel that skids sideways in a turn has little longitudinal force left.

Use: ``Filter(FilterModel(robot)).step(command, reading)``; ``BatchFilter`` for N robots; ``run_filter`` for a
recording; ``estimates`` for speeds, soil, slip and turn radius with their standard deviations.

``InertialFilter(InertialModel.of(robot, sensors))`` is for ground that slopes and soil that changes: its velocities
follow the accelerometer, gravity is among its states, and it carries the pose along (theory: filter, section 9).
``LearnedFilter`` takes its velocities from a trained network instead, and of some networks the place (section 11).
"""

from ddagr_gym.estimation.closed_form import PlanarMotion, encoder_motion, symmetric_forward_speed
from ddagr_gym.estimation.consistency import (
    BLOCKS,
    Band,
    ChannelStatistics,
    autocorrelation,
    channel_statistics,
    chi_square_band,
    normalised_estimation_error,
)
from ddagr_gym.estimation.dead_reckoning import DeadReckoning, Reckoned, reckoned_track
from ddagr_gym.estimation.derived import Estimates, estimates, slip_ratio
from ddagr_gym.estimation.filter import BatchFilter, Filter, FilterRun, roll_out, run_filter
from ddagr_gym.estimation.filter_model import FilterModel, FilterNoise, SoilPrior
from ddagr_gym.estimation.force_laws import ForceLaw
from ddagr_gym.estimation.inertial_filter import (
    InertialBatch,
    InertialFilter,
    InertialKnowledge,
    InertialModel,
    run_inertial_filter,
    run_inertial_track,
)
from ddagr_gym.estimation.layout import CHANNELS, STATE
from ddagr_gym.estimation.learned_filter import (
    LearnedBatch,
    LearnedFilter,
    LearnedModel,
    estimator_names,
    run_learned_filter,
)
from ddagr_gym.estimation.matched_truth import draw_drive
from ddagr_gym.estimation.steps import Correction, Prediction, correct, predict
from ddagr_gym.estimation.thesis_filter import THESIS_STATE, ThesisModel, run_thesis_filter

__all__ = [
    "BLOCKS",
    "CHANNELS",
    "STATE",
    "THESIS_STATE",
    "Band",
    "BatchFilter",
    "ChannelStatistics",
    "Correction",
    "DeadReckoning",
    "Estimates",
    "Filter",
    "FilterModel",
    "FilterNoise",
    "FilterRun",
    "ForceLaw",
    "InertialBatch",
    "InertialFilter",
    "InertialKnowledge",
    "InertialModel",
    "LearnedBatch",
    "LearnedFilter",
    "LearnedModel",
    "PlanarMotion",
    "Prediction",
    "Reckoned",
    "SoilPrior",
    "ThesisModel",
    "autocorrelation",
    "channel_statistics",
    "chi_square_band",
    "correct",
    "draw_drive",
    "encoder_motion",
    "estimates",
    "estimator_names",
    "normalised_estimation_error",
    "predict",
    "reckoned_track",
    "roll_out",
    "run_filter",
    "run_inertial_filter",
    "run_inertial_track",
    "run_learned_filter",
    "run_thesis_filter",
    "slip_ratio",
    "symmetric_forward_speed",
]
