"""A turn as a function of everything that the task draws: one simulation for each set of standard normal numbers."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from benchmarks.velocity_bound.soil_unknowns import field_modes, normals_of, soil_of, varied_field
from ddagr_gym.envs.settings import Episode, Randomisation, TurnSettings
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import STANDARD_GRAVITY, Numerics, Robot, Sensors, Soil
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects.command_delay import CommandDelay
from ddagr_gym.physics.effects.soil_change import SoilChange
from ddagr_gym.physics.soil_draws import SoilDistribution
from ddagr_gym.physics.wheel_forces import soil_vector
from ddagr_gym.simulator import Simulator

Array = NDArray[np.float64]

MOTION = ("v_x", "v_y", "yaw_rate", "x", "y", "yaw")
"""Of a simulated turn; body axes and the world [m/s, rad/s, m, rad]."""
READINGS = ("specific_force_x", "specific_force_y", "yaw_rate", "angle_right", "angle_left")
"""Of a simulated turn: what IMU and encoders tell. An encoder counts, so that it tells the angle of its wheel."""
BIASES = ("gyro_bias", "accelerometer_bias_x", "accelerometer_bias_y")
ROBOT = ("mass", "yaw_inertia", "motor_rate", "command_delay")
SLOPE = ("slope_x", "slope_y")
CHANGE = ("change", "onset")

SLOPE_DEVIATION = 0.6 / STANDARD_GRAVITY
"""Of the ground's gradient where it is unknown [-]: the prior of the inertial filter."""
CHANGE_DEVIATION = 0.36
"""Of the log of a change of strength whose size is unknown: that of a factor 0.7."""
ONSET_DEVIATION = 3.0
"""Of the time of such a change [s], about its true one: it may lie anywhere in the turn."""
_STEP = 0.1  # of a derivative, in standard deviations of the prior
_RECORDED = (
    layout.V_X,
    layout.V_Y,
    layout.YAW_RATE,
    layout.X,
    layout.Y,
    layout.YAW,
    layout.MEAN_SPECIFIC_FORCE,
    layout.MEAN_SPECIFIC_FORCE + 1,
    layout.YAW_RATE,
    layout.WHEEL_ANGLE,
    layout.WHEEL_ANGLE + 1,
)
_LOST = 1e-6  # of a share from the ends of its range


def reading_deviations(sensors: Sensors) -> Array:
    """Standard deviations of READINGS (5,), those of rounding included."""
    imu, encoder = sensors.imu, sensors.encoder
    acceleration = math.hypot(imu.accelerometer_noise, imu.accelerometer_resolution / math.sqrt(12.0))
    turning = math.hypot(imu.gyro_noise, imu.gyro_resolution / math.sqrt(12.0))
    angle = 2.0 * math.pi / encoder.counts_per_revolution / math.sqrt(12.0)
    return np.array([acceleration, acceleration, turning, angle, angle])


class TurnModel:
    """The true model of one turn under its commands.

    It takes the smooth numerics of fits: at the default ones derivatives by small steps are rough.

    Args:
        settings: of the task, whose draws are the prior.
        episode: the truth.
        commands: (T, 2) right and left bank speed commands that were given [rad/s].
        track: x, y, yaw (T, 3) that was driven: where the soil matters [m, rad].

    Attributes:
        names: of the unknowns, P.
        groups: (P,) biases, robot, soil, variation, slope, change.
        truth: (P,) true values, standardised: the prior of each is N(0, 1).
        kept: share of the soil's variation that its modes hold.
    """

    def __init__(self, settings: TurnSettings, episode: Episode, commands: Array, track: Array) -> None:
        if episode.field is None or not isinstance(episode.soils, Soil):
            raise InputError("the episode has no soil field: give one of a task with soil_variation above 0.")
        if not isinstance(settings.soil, SoilDistribution):
            raise InputError("the settings have one soil: give a distribution, of which the prior is made.")
        self._settings, self._episode, self._commands = settings, episode, commands
        self._distribution, self._field, self._soil = settings.soil, episode.field, soil_vector(episode.soils)
        spread = settings.randomisation
        places = _hub_places(track[::25], episode.robot)
        variation = spread.soil_variation, spread.correlation_length
        self._modes = field_modes(self._field, self._soil, places, *variation)
        self._change = next((effect for effect in settings.effects if isinstance(effect, SoilChange)), None)
        count = len(self._modes.strength)
        members = {
            "biases": BIASES,
            "robot": ROBOT,
            "soil": tuple(f"soil_{i}" for i in range(9)),
            "variation": tuple(f"{kind}_{i}" for kind in ("strength", "stiffness") for i in range(count)),
            "slope": SLOPE,
            "change": CHANGE if self._change else (),
        }
        self.names = tuple(name for own in members.values() for name in own)
        self.groups = np.array([group for group, own in members.items() for _ in own])
        self.kept = self._modes.kept
        soil = normals_of(self._distribution, episode.soils)
        change = [] if self._change is None else [math.log(self._change.strength) / CHANGE_DEVIATION, 0.0]
        self.truth = np.concatenate(
            [self._robot_and_sensors(spread), soil, self._modes.strength, self._modes.stiffness, [0.0, 0.0], change]
        )

    def _robot_and_sensors(self, spread: Randomisation) -> Array:
        """True values of biases and robot, standardised."""
        imu, robot, nominal = self._episode.sensors.imu, self._episode.robot, self._settings.robot
        share = np.clip(self._episode.command_delay / spread.command_delay, _LOST, 1.0 - _LOST)
        return np.array(
            [
                imu.gyro_bias / spread.gyro_bias,
                *(np.array(imu.accelerometer_bias) / spread.accelerometer_bias),
                (robot.mass / nominal.mass - 1.0) / spread.mass,
                (robot.yaw_inertia / nominal.yaw_inertia - 1.0) / spread.yaw_inertia,
                (robot.motor_rate / nominal.motor_rate - 1.0) / spread.motor_rate,
                norm.ppf(share),
            ]
        )

    def simulate(self, unknowns: Array) -> tuple[Array, Array]:
        """MOTION (N, T, 6) and READINGS without noise (N, T, 5) of standardised unknowns (N, P)."""
        effects = (CommandDelay(0.0),) + (() if self._change is None else (self._change,))
        simulator = Simulator(len(unknowns), numerics=Numerics.smooth(), effects=effects)
        for n, own in enumerate(unknowns):
            self._configure(simulator, n, dict(zip(self.names, own, strict=True)), own)
        episode = self._episode
        start = {"x": -episode.turn.run_in, "y": episode.lateral_offset, "yaw": episode.heading_offset}
        simulator.reset(state=start)
        commands = np.repeat(self._commands[None], len(unknowns), axis=0)
        _, record = simulator.step(commands, recorded=_RECORDED)
        motion, readings = record[..., : len(MOTION)], record[..., len(MOTION) :]
        spread = self._settings.randomisation
        gyro, *accelerometer = (self.names.index(name) for name in BIASES)
        readings[..., 2] += spread.gyro_bias * unknowns[:, None, gyro]
        readings[..., :2] += spread.accelerometer_bias * unknowns[:, None, accelerometer]
        return motion, readings

    def _configure(self, simulator: Simulator, n: int, own: dict[str, float], values: Array) -> None:
        spread, nominal = self._settings.randomisation, self._settings.robot
        robot = replace(
            nominal,
            mass=nominal.mass * (1.0 + spread.mass * own["mass"]),
            yaw_inertia=nominal.yaw_inertia * (1.0 + spread.yaw_inertia * own["yaw_inertia"]),
            motor_rate=nominal.motor_rate * (1.0 + spread.motor_rate * own["motor_rate"]),
        )
        soil = soil_of(self._distribution, values[self.groups == "soil"])
        simulator.configure(n, robot, soil, self._settings.sensors)
        varied = (values - self.truth)[self.groups == "variation"].reshape(2, -1)
        field = varied_field(self._field, self._modes, varied[0], varied[1], spread.soil_variation)
        simulator.set_field(n, replace(self._field, values=field * (soil_vector(soil) / self._soil)))
        slope = [SLOPE_DEVIATION * own[name] for name in SLOPE]
        simulator.rows[n, layout.BASE_BODY + 5 : layout.BASE_BODY + 7] = slope
        simulator.effect_parameters[n, 0, 0] = spread.command_delay * norm.cdf(own["command_delay"])
        if self._change is not None:
            onset = self._change.onset + ONSET_DEVIATION * own["onset"]
            simulator.effect_parameters[n, 1, :3] = [math.exp(CHANGE_DEVIATION * own["change"]), 1.0, onset]

    def derivatives(self, unknowns: Array) -> tuple[Array, Array]:
        """Derivatives (T, 6, P) of the motion and (T, 5, P) of the readings by the unknowns (P,)."""
        steps = _STEP * np.eye(len(unknowns))
        motion, readings = self.simulate(np.concatenate([unknowns + steps, unknowns - steps]))
        size = len(unknowns)
        by_motion, by_reading = ((a[:size] - a[size:]) / (2.0 * _STEP) for a in (motion, readings))
        return np.moveaxis(by_motion, 0, -1), np.moveaxis(by_reading, 0, -1)


def _hub_places(track: Array, robot: Robot) -> Array:
    """World places (4 T, 2) of the hubs along x, y, yaw (T, 3)."""
    x, y, yaw = track.T
    cosine, sine = np.cos(yaw), np.sin(yaw)
    places = [
        np.column_stack([x + cosine * a - sine * b, y + sine * a + cosine * b])
        for a, b in zip(robot.wheel_x, robot.wheel_y, strict=True)
    ]
    return np.concatenate(places)
