"""B6 with what a diagnosis knows: corrected readings, a filter of the corrected robot, searched gains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.control.path_tracker import MotionEstimate, PathTracker
from ddagr_gym.control.timing import CONTROL_INTERVAL, CONTROL_PERIOD
from ddagr_gym.control.tracker_settings import SETTLING, STANDING, TrackerSettings
from ddagr_gym.estimation.dead_reckoning import DeadReckoning, Reckoned
from ddagr_gym.estimation.filter_model import SoilPrior
from ddagr_gym.estimation.force_balance import arc_bank_speeds
from ddagr_gym.estimation.inertial_filter import InertialModel
from ddagr_gym.estimation.layout import CHANNEL_SIZE
from ddagr_gym.evaluation.known_physics import KnownPhysics
from ddagr_gym.evaluation.received_commands import ReceivedCommands
from ddagr_gym.parameters import Sensors

Array = NDArray[np.float64]

SLOPE_DEVIATION = 0.05
"""Of either component of gravity along ground whose slope is known [m/s^2] (ours): 0.3 degrees, as far as a diagnosis
of three drives leaves a slope of 3 degrees open."""


class CorrectedReckoning:
    """Where a robot is by the inertial filter of the corrected robot, on readings from which known errors are taken.

    A known slope is the mean of the filter's gravity at the start, and a known drag is kept apart from the wheels.

    Args:
        known: robot, slope and drag, and errors of readings and commands.
        sensors: nominal ones; their rate follows from the samples.
        prior: of the soil; the filter's own where it is left out.
        row_heading: of the rows in the world of the known slope [rad].
    """

    def __init__(
        self, known: KnownPhysics, sensors: Sensors, prior: SoilPrior | None, row_heading: float = 0.0
    ) -> None:
        self._known, self._sensors, self._prior, self._row_heading = known, sensors, prior, row_heading
        self._sent = ReceivedCommands(known)
        self._reckonings: dict[int, DeadReckoning] = {}
        self.reset(0.0, 0.0, 0.0)

    def reset(self, x: float, y: float, yaw: float) -> None:
        """Forget everything; the robot is at rest at a place [m] with a heading [rad]."""
        self._start = (x, y, yaw)
        self._sent.reset()
        self._begin(CONTROL_INTERVAL)

    def _begin(self, samples: int) -> None:
        """From the start on, with so many samples in a control interval."""
        if samples not in self._reckonings:
            imu = self._sensors.imu
            if samples != CONTROL_INTERVAL:
                imu = replace(imu, sample_rate=samples / CONTROL_PERIOD)
            model = InertialModel.of(self._known.robot, replace(self._sensors, imu=imu), self._prior)
            if any(self._known.gradient):
                model = replace(model, knowledge=replace(model.knowledge, gravity_deviation=SLOPE_DEVIATION))
            self._reckonings[samples] = DeadReckoning(model, SETTLING)
        self._samples, self._own = samples, self._reckonings[samples]
        self._own.reset(*self._start, self._known.gravity(self._row_heading + self._start[2]))

    def update(self, command: ArrayLike, samples: ArrayLike) -> Reckoned:
        """Estimate after the command (2,) [rad/s] has held over the samples (K, 5 or more)."""
        readings = self._known.readings.undo(np.asarray(samples, dtype=float)[:, :CHANNEL_SIZE])
        readings[:, 3:5] *= self._known.radius_factors
        if len(readings) != self._samples:
            self._begin(len(readings))
        if self._known.drags:
            at = self._own.present()
            self._own.pushed(self._known.drag(at.v_x, at.v_y, at.yaw_rate))
        return self._own.update(self._sent.through(np.asarray(command, dtype=float), len(readings)), readings)

    def present(self) -> Reckoned:
        """The estimate as it stands."""
        return self._own.present()


def adapted_tracker(
    settings: TrackerSettings,
    known: KnownPhysics,
    sensors: Sensors,
    prior: SoilPrior | None,
    track_ratio: float,
    lead: float,
    row_heading: float = 0.0,
) -> PathTracker:
    """A path tracker that knows what ``known`` says.

    Args:
        settings: gains.
        known: robot, delay, and errors of readings and commands.
        sensors: nominal ones.
        prior: of the filter's soil; None for that of all soils.
        track_ratio: effective over geometric track where the estimated soil has no solution [-].
        lead: heading before the end of the turn at which the gains' lead factor is 1 [rad].
        row_heading: of the rows in the world of the known slope [rad].
    """
    flat = InertialModel.of(known.robot, sensors, prior).flat

    def steady_arc(at: MotionEstimate, speed: float, curvature: float) -> tuple[float, float] | None:
        drag_x, drag_y, turning = known.drag(speed, at.v_y, speed * curvature)
        pull = at.gravity[0] + drag_x, at.gravity[1] + drag_y
        found = arc_bank_speeds(flat, at.soil, speed, curvature, pull, turning)
        if found is None:
            return None
        right, left = known.commands.undo(np.array(found) / known.radius_factors).tolist()
        return right, left

    return PathTracker(
        known.robot, settings.loop.gains, settings.course, CorrectedReckoning(known, sensors, prior, row_heading),
        steady_arc, track_ratio, settings.loop.lead_factor * lead, STANDING,
        settings.ahead + float(np.mean(known.delay)), settings.side_slip, settings.aligning, settings.largest_slip,
    )  # fmt: skip
