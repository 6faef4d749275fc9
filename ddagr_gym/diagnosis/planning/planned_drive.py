"""Drives that have not been driven: nominal predictions of manoeuvres with given sensors, as a fit problem.

The sensitivities of such a problem say before any data what its readings could show, since they depend on the readings
in no way; only their noise does, which is estimated from simulated readings by the same routines as from real ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.control.manoeuvres import Manoeuvre
from ddagr_gym.diagnosis.setting import SHORT, Setting, make_problem
from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.identification.gauss_newton import Fitted, fit
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.windows import STATE
from ddagr_gym.parameters import Imu, PoseReceiver, Robot, Sensors, Soil, WheelEncoder
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate

Array = NDArray[np.float64]

RATE = 50.0
"""Samples per second of the planned drives [Hz]."""

POSE_RATE = 5.0
"""Fixes per second of the pose receiver [Hz]."""

SENSORS = {
    "imu": ("specific_force_x", "specific_force_y", "yaw_rate"),
    "encoders": ("encoder_right", "encoder_left"),
    "pose": ("pose_x", "pose_y", "pose_yaw"),
}
"""Channels by sensor; noise and rounding are the defaults of :class:`ddagr_gym.parameters.Sensors`."""


@dataclass(frozen=True, eq=False)
class Plan:
    """Manoeuvres as recordings, and the fit problem that they make.

    Attributes:
        manoeuvres: one per recording.
        sensors: names of SENSORS.
        problem: windows of all recordings.
        fitted: the nominal model in the windows' true states.
    """

    manoeuvres: tuple[Manoeuvre, ...]
    sensors: tuple[str, ...]
    problem: Problem
    fitted: Fitted


def plan(
    robot: Robot,
    soil: Soil,
    manoeuvres: Sequence[Manoeuvre],
    sensors: Sequence[str] = tuple(SENSORS),
    *,
    starts: Sequence[tuple[float, float, float]] | None = None,
    seed: int = 0,
    setting: Setting | None = None,
) -> Plan:
    """Simulate manoeuvres of the nominal robot and compute the nominal sensitivities.

    Args:
        robot: nominal.
        soil: nominal.
        manoeuvres: at least one, each of at least a window's length.
        sensors: names of SENSORS.
        starts: world x, y [m] and yaw [rad] of each; at the origin by default.
        seed: of the sensor noise, from which its level is estimated.
        setting: of the diagnosis.

    Raises:
        InputError: no manoeuvre, one that is too short, no sensor or an unknown one.
    """
    setting = Setting() if setting is None else setting
    _check(manoeuvres, sensors, setting)
    places = [(0.0, 0.0, 0.0)] * len(manoeuvres) if starts is None else list(starts)
    recordings = [
        _drive(robot, soil, manoeuvre, sensors, place, seed + number)
        for number, (manoeuvre, place) in enumerate(zip(manoeuvres, places, strict=True))
    ]
    problem = make_problem(robot, soil, recordings, setting)
    problem = _at_truth(problem, recordings)
    # the nominal value may be a bound, but no data have pushed a parameter there
    problem.low, problem.high = np.full_like(problem.low, -np.inf), np.full_like(problem.high, np.inf)
    return Plan(tuple(manoeuvres), tuple(sensors), problem, fit(problem, iterations=0))


def with_room(setting: Setting, manoeuvres: Sequence[Manoeuvre]) -> Setting:
    """A diagnosis' setting whose windows fit twice into the shortest manoeuvre, as short ones do in a diagnosis.

    Args:
        setting: of the diagnosis.
        manoeuvres: to be driven.
    """
    room = 0.5 * min((manoeuvre.duration for manoeuvre in manoeuvres), default=2.0 * setting.duration)
    return setting.with_windows(min(setting.duration, max(room, SHORT)))


def _check(manoeuvres: Sequence[Manoeuvre], sensors: Sequence[str], setting: Setting) -> None:
    if not manoeuvres:
        raise InputError("no manoeuvre is given: name at least one.")
    if not sensors:
        raise InputError(f"no sensor is given: name some of {', '.join(SENSORS)}.")
    for name in sensors:
        if name not in SENSORS:
            raise unknown_name("sensor", name, SENSORS)
    for manoeuvre in manoeuvres:
        if manoeuvre.duration <= setting.duration:
            raise InputError(
                f"manoeuvre {manoeuvre.name!r} lasts {manoeuvre.duration:g} s: it must be longer than a window of "
                f"{setting.duration:g} s."
            )


def _drive(
    robot: Robot, soil: Soil, manoeuvre: Manoeuvre, sensors: Sequence[str], place: tuple[float, float, float], seed: int
) -> Recording:
    """A nominal drive with noise; readings of absent sensors are missing, the truth is among the extras."""
    suite = Sensors(Imu(sample_rate=RATE), WheelEncoder(), PoseReceiver(POSE_RATE))
    start = dict(zip(("x", "y", "yaw"), place, strict=True))
    columns = simulate(robot, soil, manoeuvre.commands(RATE), sensors=suite, initial_state=start, seed=seed)
    for name, channels in SENSORS.items():
        if name not in sensors:
            columns |= {channel: np.full(len(columns["t"]), np.nan) for channel in channels}
    return Recording.from_columns(columns, robot, source=manoeuvre.name)


def _at_truth(problem: Problem, recordings: Sequence[Recording]) -> Problem:
    """The windows start in the states that the simulation had, not in those that its noisy readings suggest."""
    windows = problem.blocked.windows
    table = [np.stack([r.extras[f"true_{name}"] for name in STATE], axis=1) for r in recordings]
    initial = np.stack([table[n][row] for n, row in zip(windows.recording, windows.start, strict=True)])
    return problem.on(replace(problem.blocked, windows=replace(windows, initial=initial)))
