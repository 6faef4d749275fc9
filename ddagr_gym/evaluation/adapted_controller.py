"""B4 with what a diagnosis knows: corrected readings, a filter of the corrected robot, a feed-forward that was taught.

It needs the raw samples and nothing else of the environment: odometer, heading and filter are its own, on readings from
which known errors are taken.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.control.observation import TurnObservation, decode
from ddagr_gym.control.row_turn import Phase
from ddagr_gym.control.timing import CONTROL_INTERVAL, CONTROL_PERIOD
from ddagr_gym.control.tracker_settings import LoopSettings, TrackerSettings
from ddagr_gym.control.turn_controller import FeedbackController, curvature_error
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import BatchFilter, FilterModel
from ddagr_gym.estimation.filter_model import SoilPrior
from ddagr_gym.estimation.force_balance import arc_bank_speeds
from ddagr_gym.estimation.layout import CHANNEL_SIZE, PARAMETER, PARAMETER_SIZE
from ddagr_gym.evaluation.known_physics import KnownPhysics
from ddagr_gym.evaluation.ladder_gains import ladder_gains
from ddagr_gym.evaluation.received_commands import ReceivedCommands
from ddagr_gym.parameters import STANDARD_GRAVITY, Sensors
from ddagr_gym.validated import Validated, bounded

Array = NDArray[np.float64]

NODES = 7
"""Places of the half circle at which a feed-forward is taught, both ends included."""


@dataclass(frozen=True)
class FeedForward(Validated):
    """What the corrected simulator taught about turns to one side.

    Attributes:
        curvature: factors on the commanded curvature at equal shares of the half circle, from its start to its end [-].
        lead: heading by which it straightens earlier than the gains say [rad].
    """

    curvature: tuple[float, ...] = (1.0,) * NODES
    lead: float = bounded("rad", -1.0, 1.0, default=0.0)

    def _check(self) -> None:
        if len(self.curvature) < 2 or not all(math.isfinite(v) and v > 0.0 for v in self.curvature):
            raise InputError(f"FeedForward.curvature is {self.curvature!r}: give two or more positive factors.")

    def factor(self, share: float) -> float:
        """Factor on the curvature where a share of the half circle is turned [-]."""
        return float(np.interp(share, np.linspace(0.0, 1.0, len(self.curvature)), self.curvature))


@dataclass(frozen=True)
class AdaptedSettings(Validated):
    """What ``controller.yaml`` of a bundle holds.

    Attributes:
        tracker: of the path tracker B6; it is B4 that drives, with the three that follow, where it is left out.
        gains: of the loop on the estimated curvature.
        left: feed-forward of turns to the left.
        right: the same to the right.
        row_heading: of the rows in the world of the recordings' poses [rad].
        soil_prior: of the filter; that of all soils when it is left out.
        sensors: with the noise that the filter reckons with.
    """

    tracker: TrackerSettings | None = None
    gains: LoopSettings = field(default_factory=lambda: ladder_gains().force_balance)
    left: FeedForward = FeedForward()
    right: FeedForward = FeedForward()
    row_heading: float = bounded("rad", -7.0, 7.0, default=0.0)
    soil_prior: SoilPrior | None = None
    sensors: Sensors = Sensors()

    def side(self, sign: float) -> FeedForward:
        """Feed-forward of turns to a side."""
        return self.left if sign > 0.0 else self.right


class AdaptedController(FeedbackController):
    """Drives a turn from the raw samples (``info_level="full"``).

    Args:
        settings: gains and feed-forward.
        known: robot, slope, and errors of readings and commands.
        sensors: nominal ones; their rate follows from the samples.
        track_ratio: effective over geometric track where the estimated soil has no solution [-].
        lead: heading before the end of the turn at which the gains' lead factor is 1 [rad].
    """

    def __init__(
        self, settings: AdaptedSettings, known: KnownPhysics, sensors: Sensors, track_ratio: float, lead: float
    ) -> None:
        super().__init__(known.robot, settings.gains.gains, track_ratio, settings.gains.lead_factor * lead)
        self._settings, self._known, self._sensors = settings, known, sensors
        self._filters: dict[int, BatchFilter] = {}
        self._sent = ReceivedCommands(known)
        self.reset()

    def reset(self) -> None:
        """Forget the last episode."""
        super().reset()
        self._filter: BatchFilter | None = None
        self._heading, self._odometer, self._run_in = 0.0, 0.0, 0.0
        self._sent.reset()

    def __call__(self, observation: ArrayLike, info: Any = None) -> NDArray[np.float32]:
        """Action (2,), right and left bank speed over the robot's maximum."""
        if info is None or "samples" not in info:
            raise InputError('this controller needs the raw samples: make the environment with info_level="full".')
        samples = np.asarray(info["samples"], dtype=float)
        given = decode(observation)
        if self._filter is None:
            self._filter = self._filter_of(len(samples))
            self._filter.reset()
            self._run_in = given.run_in_to_go
        else:
            self._watch(np.asarray(info["command"], dtype=float), samples)
        seen = self._seen(given)
        curvature = self.curvature(seen, self.phase(seen), info)
        speeds = np.array(self._steady_speeds(seen.target_speed, curvature)) / self._known.radius_factors
        action = self._known.commands.undo(speeds) / self.robot.maximum_wheel_speed
        return np.clip(action, -1.0, 1.0).astype(np.float32)

    def _filter_of(self, samples: int) -> BatchFilter:
        """The filter for so many samples in a control interval."""
        if samples not in self._filters:
            sensors = self._sensors
            if samples != CONTROL_INTERVAL:
                sensors = replace(sensors, imu=replace(sensors.imu, sample_rate=samples / CONTROL_PERIOD))
            self._filters[samples] = BatchFilter(
                FilterModel.of(self.robot, sensors, prior=self._settings.soil_prior), 1
            )
        return self._filters[samples]

    def _watch(self, command: Array, samples: Array) -> None:
        """Through the samples of a control interval: heading, odometer and filter."""
        assert self._filter is not None
        period = CONTROL_PERIOD / len(samples)
        readings = self._known.readings.undo(samples[:, :CHANNEL_SIZE])
        readings[:, 3:5] *= self._known.radius_factors
        gravity = np.array(self._known.gravity(self._settings.row_heading + self._heading))
        drag = np.array(self._known.drag(*self._filter.states[0, :3])[:2])
        readings[:, :2] -= drag
        self._heading += float(readings[:, 2].sum()) * period
        self._odometer += float(readings[:, 3:5].sum()) * 0.5 * period * self.robot.outer_radius
        received = self._sent.through(command, len(samples))
        self._filter.step(received[None], readings[None], _attitude(gravity + drag), duration=period)

    def _seen(self, given: TurnObservation) -> TurnObservation:
        """The observation by corrected readings."""
        return given._replace(
            heading_to_go=math.pi - given.side * self._heading, run_in_to_go=max(self._run_in - self._odometer, 0.0)
        )

    def _steady_speeds(self, speed: float, curvature: float) -> tuple[float, float]:
        """Bank speeds of wheels of the mean radius [rad/s] for a speed and a curvature at the filter's estimate."""
        assert self._filter is not None
        state = self._filter.states[0]
        soil = np.exp(state[PARAMETER : PARAMETER + PARAMETER_SIZE])
        pull = np.array(self._known.gravity(self._settings.row_heading + self._heading))
        pull += self._known.drag(speed, 0.0, speed * curvature)[:2]
        found = arc_bank_speeds(self._filter.model, soil, speed, curvature, (float(pull[0]), float(pull[1])))
        return found or self.bank_speeds(speed, curvature)

    def phase(self, seen: TurnObservation) -> Phase:
        """Part of the manoeuvre, by corrected odometer and heading."""
        if seen.run_in_to_go > 0.0:
            return Phase.RUN_IN
        early = self.lead + self._settings.side(seen.side).lead
        return Phase.TURN if seen.heading_to_go > early else Phase.RUN_OUT

    def curvature(self, seen: TurnObservation, phase: Phase, info: Any) -> float:
        """As B4, with the commanded curvature times what was taught for this place of the turn [1/m]."""
        if phase == Phase.TURN:
            share = min(max(1.0 - seen.heading_to_go / math.pi, 0.0), 1.0)
            seen = seen._replace(target_radius=seen.target_radius / self._settings.side(seen.side).factor(share))
        return super().curvature(seen, phase, info)

    def error(self, seen: TurnObservation, feed_forward: float, info: Any) -> float:
        """Commanded less estimated curvature [1/m]."""
        assert self._filter is not None
        v_x, _, yaw_rate = self._filter.states[0, :3]
        return curvature_error(feed_forward, float(yaw_rate), float(v_x), seen.target_speed)


def _attitude(pull: Sequence[float] | Array) -> Array:
    """Roll and pitch (1, 2) [rad] at which gravity pulls so along body x and y [m/s^2]."""
    pitch = math.asin(min(max(float(pull[0]) / STANDARD_GRAVITY, -0.9), 0.9))
    roll = math.asin(min(max(-float(pull[1]) / (STANDARD_GRAVITY * math.cos(pitch)), -0.9), 0.9))
    return np.array([[roll, pitch]])
