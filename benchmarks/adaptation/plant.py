"""The blind benchmark's robot driven in closed loop, and its recorded drives.

The integration is that of ``benchmarks/concealed/drive.py``, a control interval at a time. Sensors are those of its
recordings: 50 Hz, so that a control interval has four samples.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from benchmarks.adaptation.truths import Truth
from benchmarks.concealed.cases import Case, field_noise, field_plant
from benchmarks.concealed.drive import (
    SAMPLE_PERIOD,
    SETTLING,
    SUBSTEPS,
    TRUTH,
    _new_state,
    _new_work,
    _record,
    drive,
    read_ground,
    substep,
)
from benchmarks.concealed.ground import random_waves
from benchmarks.concealed.noise import first_order, pink
from benchmarks.concealed.plant import Plant, settled
from benchmarks.concealed.sensors import COUNTS, SensorNoise, _inertial, readings, with_noise
from benchmarks.concealed.storage import csv_bytes
from ddagr_gym.control.manoeuvres import MANOEUVRES
from ddagr_gym.control.observation import SCALES
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.control.timing import CONTROL_PERIOD
from ddagr_gym.evaluation.runs import Controller
from ddagr_gym.files import write_bytes
from ddagr_gym.parameters import Imu, Sensors

Array = NDArray[np.float64]

SAMPLES = round(CONTROL_PERIOD / SAMPLE_PERIOD)
"""Sensor samples in a control interval."""

SENSORS = Sensors(imu=Imu(sample_rate=1.0 / SAMPLE_PERIOD))
"""The sensors as their data sheets have them."""

RECORDED = ("arcs", "s_weave", "row_turn")
"""Manoeuvres of the recorded drives."""

LONGEST = 45.0
"""Time after which a turn is given up [s]."""

_PAUSE = 70.0  # between the starts of the recorded drives [s]
_SEED = 20_261_124


@njit
def _advance(plant, state, work, commands, clock, substeps, truth):  # type: ignore[no-untyped-def]
    """Drive (samples * substeps) commands and write the truth after each sample."""
    dt = SAMPLE_PERIOD / substeps
    for k in range(truth.shape[0]):
        state.mean[:] = 0.0
        time = clock + k * SAMPLE_PERIOD
        read_ground(plant, state, work.arm, time)
        for i in range(substeps):
            substep(plant, state, work, commands[k * substeps + i], time + i * dt, dt)
        state.mean[:] = state.mean / substeps
        _record(plant.body, state, truth[k])


class TruePlant:
    """A robot on its ground with what is different about it.

    Args:
        truth: what is different.
        number: of the field: its soil, its places, its sensors' noise.
    """

    def __init__(self, truth: Truth, number: int = 1) -> None:
        self._case, self._seed = Case("development", number, "null", ()), _SEED + number - 1
        self.change = truth.change()
        self.noise: SensorNoise = field_noise(self._case, _SEED)

    def plant(self, rng: np.random.Generator) -> Plant:
        """The plant at a place of the field."""
        plain = field_plant(self._case, _SEED)
        waves = {name: random_waves(rng, 1.5) for name in ("strength_waves", "stiffness_waves")}
        placed = plain._replace(ground=plain.ground._replace(**waves))
        return self.change.plant(placed) if self.change.plant else placed

    def record(self, folder: Path) -> list[Path]:
        """Drive the recorded manoeuvres and write them as ``concealed.yaml`` reads them."""
        return [self._record_one(number, name, folder) for number, name in enumerate(RECORDED)]

    def _record_one(self, number: int, name: str, folder: Path) -> Path:
        rng = np.random.default_rng([self._seed, 1, number])
        plant, commands = self.plant(rng), MANOEUVRES[name].commands(1.0 / SAMPLE_PERIOD)
        given = self._received(np.repeat(commands, SUBSTEPS, axis=0))
        truth = drive(plant, given, np.zeros(3), number * _PAUSE)
        clean = readings(truth, plant, commands, (self.change,), rng)
        path = folder / f"{name}.csv"
        write_bytes(path, csv_bytes(with_noise(clean, truth, self.noise, (self.change,), True, rng)))
        return path

    def _received(self, commands: Array) -> Array:
        """Commands at the integration rate as the motors receive them."""
        if self.change.command is None:
            return commands
        return np.asarray(self.change.command(commands, np.random.default_rng(0)))

    def turn(self, controller: Controller, turn: RowTurn, seed: int) -> dict[str, Array]:
        """Columns of a turn by a controller that sees samples, as ``turn_metrics`` reads them.

        Args:
            controller: drives by the first observation, samples and its own commands.
            turn: commanded.
            seed: of the place, the start and the noise.
        """
        rng = np.random.default_rng([self._seed, 2, seed])
        run = _Run(self, turn, rng)
        controller.reset()
        observation, info = _first_observation(turn), run.info(np.zeros((SAMPLES, 5)))
        while not run.ended:
            action = np.asarray(controller(observation, info), dtype=float)
            info = run.info(run.step(np.clip(action, -1.0, 1.0) * run.limit))
        return run.columns()


def _first_observation(turn: RowTurn) -> Array:
    """What the environment observes of a robot at rest before the turn: the task."""
    values = np.zeros(len(SCALES))
    values[7:12] = [turn.sign, turn.radius, turn.speed, math.pi, turn.run_in]
    return values / SCALES


class _Run:
    """State of one turn."""

    limit = 2.0  # bank speed of action 1 [rad/s]

    def __init__(self, true: TruePlant, turn: RowTurn, rng: np.random.Generator) -> None:
        self._true, self._turn = true, turn
        self._plant = settled(true.plant(rng))
        start = np.array([-turn.run_in, 0.01 * rng.standard_normal(), 0.01 * rng.standard_normal()])
        self._state, self._work = _new_state(self._plant, start), _new_work()
        steps = round(LONGEST / CONTROL_PERIOD)
        self._noise = _noise(true.noise, steps * SAMPLES, rng)
        self._commands = np.zeros((0, 2))
        self._truth: list[Array] = []
        self._counts = np.zeros(2)
        self._steps, self._left = 0, steps
        self.command = np.zeros(2)
        rest = np.zeros((SETTLING, len(TRUTH)))
        _advance(self._plant, self._state, self._work, np.zeros((SETTLING * SUBSTEPS, 2)), 0.0, SUBSTEPS, rest)
        self._counts = np.floor(rest[-1, 8:10] * COUNTS / (2.0 * math.pi))

    @property
    def ended(self) -> bool:
        """Whether the robot is in the next row, far off, or out of time."""
        if self._steps >= self._left:
            return True
        if not self._truth:
            return False
        x, y = self._truth[-1][-1, :2]
        back = self._turn.sign * y > self._turn.radius and x <= -self._turn.run_out
        return bool(back or math.hypot(x, y - self._turn.sign * self._turn.radius) > 4.0)

    def step(self, command: Array) -> Array:
        """Samples (SAMPLES, 5) of a control interval under a command (2,) [rad/s]."""
        self.command = command
        new = np.repeat(command[None], SAMPLES * SUBSTEPS, axis=0)
        self._commands = np.concatenate([self._commands, new])
        received = self._true._received(self._commands)[-len(new) :]
        truth = np.zeros((SAMPLES, len(TRUTH)))
        clock = self._steps * CONTROL_PERIOD
        _advance(self._plant, self._state, self._work, np.ascontiguousarray(received), clock, SUBSTEPS, truth)
        self._truth.append(truth)
        self._steps += 1
        return self._samples(truth)

    def _samples(self, table: Array) -> Array:
        truth: Mapping[str, Array] = {name: table[:, k] for k, name in enumerate(TRUTH)}
        inertial = _inertial(truth, self._plant)
        if self._true.change.inertial:
            inertial = self._true.change.inertial(inertial, truth, np.random.default_rng(0))
        rows = slice((self._steps - 1) * SAMPLES, self._steps * SAMPLES)
        tread = 0.2794 * 0.5 * (np.abs(truth["omega_right"]) + np.abs(truth["omega_left"]))
        shaken = self._noise["shaking"][rows] * tread[:, None] + self._noise["resting"][rows]
        counts = np.floor(table[:, 8:10] * COUNTS / (2.0 * math.pi))
        moved = np.diff(counts, axis=0, prepend=self._counts[None]) * (2.0 * math.pi / COUNTS / SAMPLE_PERIOD)
        self._counts = counts[-1]
        return np.column_stack([inertial[:, :2] + shaken, inertial[:, 3] + self._noise["gyro"][rows], moved])

    def info(self, samples: Array) -> dict[str, Any]:
        """What the environment's full info has for a deployable controller."""
        return {"samples": samples, "command": self.command}

    def columns(self) -> dict[str, Array]:
        """Time, commands and the truth by column."""
        table = np.concatenate(self._truth)
        sent = self._commands[SUBSTEPS - 1 :: SUBSTEPS]
        found = {"t": (1.0 + np.arange(len(table))) * SAMPLE_PERIOD}
        found |= {"command_right": sent[:, 0], "command_left": sent[:, 1]}
        return found | {f"true_{name}": table[:, k] for k, name in enumerate(TRUTH[:8])}


def _noise(noise: SensorNoise, samples: int, rng: np.random.Generator) -> dict[str, Array]:
    """Noise of a drive as the recordings have it; that of shaking over the tread's speed."""
    shaking, resting = np.zeros((samples, 2)), np.zeros((samples, 2))
    for axis in range(2):
        shaking[:, axis] = noise.accelerometer_per_speed * first_order(rng, samples, noise.accelerometer_correlation)
        resting[:, axis] = noise.accelerometer * rng.standard_normal(samples) + noise.accelerometer_offset[axis]
        resting[:, axis] += noise.accelerometer_pink * pink(rng, samples)
    gyro = noise.gyro * rng.standard_normal(samples) + noise.gyro_pink * pink(rng, samples) + noise.gyro_offset
    return {"shaking": shaking, "resting": resting, "gyro": gyro}
