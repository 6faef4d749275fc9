"""The models that a replay compares, each a function from windows to predictions."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.block_means import sample_windows
from ddagr_gym.identification.fit_numerics import field_numerics
from ddagr_gym.identification.gauss_newton import fit_states
from ddagr_gym.identification.nuisances import Nuisances
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.residual_weights import ROBUST, noise_weights
from ddagr_gym.identification.window_model import WindowModel
from ddagr_gym.identification.windows import CHANNELS, WindowSet
from ddagr_gym.parameters import Numerics, Robot, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.replay_analysis.fitting import DriveModeFit
from ddagr_gym.replay_analysis.kinematic import KinematicModel, Motor, fit_motor, fit_track
from ddagr_gym.replay_analysis.prepare import Prepared
from ddagr_gym.replay_analysis.report import EFFECTIVE_TRACK, NO_SLIP, BaselineReport, Speed

Array = NDArray[np.float64]


class ReplaySimulator:
    """The simulator in one drive mode, nominal or refitted.

    Args:
        robot: nominal.
        soil: nominal.
        effects: missing physics.
        imposed: whether recorded wheel speeds drive.
        delay: of the drive [s], for the nominal simulator.
        fit: parameters, or None for the nominal simulator.
        threads: of the simulator.

    Attributes:
        simulated: robot time predicted [s].
        cpu: processor time spent on it [s].
    """

    def __init__(
        self,
        robot: Robot,
        soil: Soil,
        effects: Sequence[Effect],
        *,
        imposed: bool,
        delay: float,
        fit: DriveModeFit | None = None,
        threads: int = 1,
    ) -> None:
        self._robot, self._soil, self._effects = robot, soil, tuple(effects)
        self._imposed, self._threads = imposed, threads
        self._delay = delay if fit is None else 0.0
        self._parameters = () if fit is None else fit.parameters
        self.values = np.zeros(0) if fit is None else fit.values
        self.simulated, self.cpu = 0.0, 0.0

    def model(self, windows: WindowSet, numerics: Numerics) -> WindowModel:
        """Model of these windows."""
        return WindowModel(
            self._robot, self._soil, windows, self._parameters, imposed=self._imposed, numerics=numerics,
            threads=self._threads, delay=self._delay,
        )  # fmt: skip

    def predict(self, windows: WindowSet) -> Array:
        """Channels (W, T, 8) from the windows' first guess with the default accuracy; adds to :meth:`speed`."""
        model = self.model(windows, Numerics())
        before = time.process_time()
        prediction = model.predict(self.values, windows.initial, self._effects)
        self.cpu += time.process_time() - before
        self.simulated += windows.count * windows.duration
        return prediction

    def warm_up(self, windows: WindowSet) -> None:
        """Compile or load the kernels, so that :meth:`speed` does not count it."""
        first = windows.subset(np.zeros(1, dtype=np.int64))
        self.model(first, Numerics()).predict(self.values, first.initial, self._effects)

    def with_free_states(self, windows: WindowSet, sigma: Array, entries: Sequence[int]) -> tuple[Array, Array]:
        """Channels (W, T, 8) from fitted initial states, and row entries (W, T, K); sigma (W, 1, 8)."""
        problem = Problem(
            self._robot, self._soil, sample_windows(windows, sigma), Nuisances(self._parameters), imposed=self._imposed,
            known=self._effects, robust=np.full(len(CHANNELS), ROBUST), threads=self._threads,
            numerics=field_numerics(), delay=self._delay,
        )  # fmt: skip
        states, _ = fit_states(problem, self.values)
        return problem.model.predict_recorded(self.values, states, entries, self._effects)

    def speed(self) -> Speed:
        """Simulated time and processor time of :meth:`predict` so far."""
        return Speed(self.simulated, self.cpu, self.simulated / self.cpu if self.cpu > 0.0 else 0.0)


@dataclass(frozen=True)
class Baselines:
    """Kinematic models of one drive mode.

    Attributes:
        no_slip: geometric track.
        effective_track: fitted; None where no turn was measured.
        motor: model from commands to bank speeds; None where recorded wheel speeds drive.
    """

    no_slip: KinematicModel
    effective_track: KinematicModel | None
    motor: Motor | None

    @property
    def delay(self) -> float:
        """Delay of the recorded wheel speeds [s]; 0 where commands drive, because the motor model has its own delay."""
        return self.no_slip.delay

    def models(self) -> dict[str, KinematicModel]:
        """The fitted models by name."""
        return {NO_SLIP: self.no_slip} | (
            {} if self.effective_track is None else {EFFECTIVE_TRACK: self.effective_track}
        )

    def report(self) -> BaselineReport:
        """Their parameters for replay.json."""
        motor, track = self.motor, self.effective_track
        return BaselineReport(
            None if track is None else track.track_ratio,
            self.delay,
            None if motor is None else motor.rate,
            None if motor is None else motor.maximum_speed,
            None if motor is None else motor.delay,
        )


def fit_baselines(prepared: Prepared, robot: Robot, drive_by: str, training: WindowSet | None) -> Baselines:
    """Kinematic models fitted on the training windows; the nominal motor and no effective track without any."""
    radius, half_track = prepared.geometry.wheel_radius, prepared.geometry.half_track
    sigma = dict(zip(CHANNELS, prepared.sigma.tolist(), strict=True))
    motor = None
    if drive_by == "commands":
        motor = Motor(robot.motor_rate, robot.maximum_wheel_speed)
        if training is not None:
            motor = fit_motor(training, motor.rate, motor.maximum_speed, sigma["encoder_right"])
    track = None
    if training is not None:
        track = fit_track(training, radius, half_track, motor, sigma=_turn_noise(prepared), robust=ROBUST)
    delay = 0.0 if track is None else track.delay
    return Baselines(KinematicModel(radius, half_track, 1.0, motor, delay), track, motor)


def _turn_noise(prepared: Prepared) -> float:
    """Standard deviation of the yaw rates that the track is fitted to [rad/s]: the gyro's, or between poses."""
    if "yaw_rate" not in prepared.dead:
        return float(prepared.sigma[CHANNELS.index("yaw_rate")])
    rate = max(recording.rate("pose_yaw") for recording in prepared.recordings)
    return float(np.sqrt(2.0) * prepared.sigma[CHANNELS.index("pose_yaw")] * rate) or np.inf


def weights_of(prepared: Prepared, windows: WindowSet, imposed: bool) -> Array:
    """Standard deviations (W, 1, 8) by which initial states are fitted."""
    return noise_weights(prepared.noise, windows, imposed, prepared.dead, unfitted=()).sigma


def predict_all(
    simulators: Mapping[str, ReplaySimulator], kinematic: Mapping[str, KinematicModel], windows: WindowSet
) -> dict[str, Array]:
    """Predictions of all models by name."""
    simulated = {name: model.predict(windows) for name, model in simulators.items()}
    return simulated | {name: model.predict(windows) for name, model in kinematic.items()}
