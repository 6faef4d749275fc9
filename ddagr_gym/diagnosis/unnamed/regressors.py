"""The library of unit-checked regressors: what forces, commands and readings may depend on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.unnamed.response import Course
from ddagr_gym.diagnosis.unnamed.units import (
    ACCELERATION,
    METRE,
    NEWTON,
    NEWTON_METRE,
    NUMBER,
    RADIAN,
    SECOND,
    SPEED,
    TURN_ACCELERATION,
    TURN_RATE,
    Signal,
    Unit,
)
from ddagr_gym.identification.problem import Problem

Array = NDArray[np.float64]

TARGETS: dict[str, Unit] = {
    "F_x": NEWTON,
    "F_y": NEWTON,
    "M_z": NEWTON_METRE,
    "gravity_x": ACCELERATION,
    "gravity_y": ACCELERATION,
    "command_right": TURN_RATE,
    "command_left": TURN_RATE,
    "specific_force_x": ACCELERATION,
    "specific_force_y": ACCELERATION,
    "yaw_rate": TURN_RATE,
    "encoder_right": TURN_RATE,
    "encoder_left": TURN_RATE,
    "pose_x": METRE,
    "pose_y": METRE,
    "pose_yaw": RADIAN,
}
"""What a term may be added to: the wrench on the body, gravity in body axes (a tilted ground pushes and is felt by the
accelerometer), the commands, and each channel by itself."""

_REST = {"v_x": 0.02, "v_y": 0.01, "r": 0.03, "turn": 0.05, "w": 0.03}
"""Widths of rounded signs [m/s, rad/s], ours: a tenth of slow driving."""

_SLOW = (0.5, 30.0)
"""Scales of the decays with command [rad/s] and time [s], ours: slow driving, a sensor's warming."""


@dataclass(frozen=True, eq=False)
class Term:
    """A regressor that may be added to a target.

    Attributes:
        target: of TARGETS.
        signal: (W, B).
        plainness: rank among regressors, 0 the plainest; of two that say the same the plainer is kept.
    """

    target: str
    signal: Signal
    plainness: int

    @property
    def unit(self) -> Unit:
        """Of the coefficient."""
        return TARGETS[self.target] / self.signal.unit


@dataclass(frozen=True, eq=False)
class Motion:
    """Base signals per block, each (W, B), by name."""

    signals: dict[str, Signal]

    def __getitem__(self, name: str) -> Signal:
        return self.signals[name]


def motion_of(problem: Problem, course: Course) -> Motion:
    """Predicted motion, commands, torques, place and time as block means."""
    windows = problem.blocked.windows
    count, blocks, length, _ = problem.blocked.weights.shape
    past = windows.history

    def mean(values: Array) -> Array:
        return np.asarray(values[:, : blocks * length].reshape(count, blocks, length).mean(axis=2))

    def signal(name: str, values: Array, unit: Unit) -> Signal:
        return Signal(name, mean(values), unit)

    states = course.states
    step = windows.period
    change = np.gradient(states, step, axis=1)
    drive = windows.commands[:, past : past + windows.samples]
    past_drive = windows.commands[:, past - length : past + windows.samples - length]
    time = windows.time[:, None] + step * np.arange(1, windows.samples + 1)
    v_x, v_y, r = states[..., 3], states[..., 4], states[..., 5]
    found = [
        signal("v_x", v_x, SPEED),
        signal("v_y", v_y, SPEED),
        signal("r", r, TURN_RATE),
        signal("a_x", change[..., 3] - r * v_y, ACCELERATION),
        signal("a_y", change[..., 4] + r * v_x, ACCELERATION),
        signal("r_dot", change[..., 5], TURN_ACCELERATION),
        signal("yaw", states[..., 2], RADIAN),
        signal("x", states[..., 0], METRE),
        signal("y", states[..., 1], METRE),
        signal("t", time, SECOND),
    ]
    angles = _wheel_angles(problem)
    for bank, side in enumerate(("right", "left")):
        found += [
            signal(f"w_{side}", states[..., 6 + bank], TURN_RATE),
            signal(f"w_dot_{side}", change[..., 6 + bank], TURN_ACCELERATION),
            signal(f"c_{side}", drive[..., bank], TURN_RATE),
            signal(f"c_dot_{side}", (drive - past_drive)[..., bank] / (length * step), TURN_ACCELERATION),
            signal(f"torque_{side}", course.torques[..., bank], NEWTON_METRE),
        ]
        if angles is not None:
            found.append(signal(f"angle_{side}", angles[..., bank], RADIAN))
    return Motion({item.name: item for item in found})


def _wheel_angles(problem: Problem) -> Array | None:
    """(W, T, 2) angles that the banks have turned since their recording's first window; None across gaps."""
    from ddagr_gym.identification.windows import CHANNELS

    windows = problem.blocked.windows
    banks = [CHANNELS.index("encoder_right"), CHANNELS.index("encoder_left")]
    speeds = windows.measured[..., banks]
    last = np.diff(windows.recording, prepend=-1) != 0
    touching = np.diff(windows.start, prepend=windows.start[0]) == windows.samples
    if not np.isfinite(speeds).all() or not (last | touching).all():
        return None
    turned = np.cumsum(speeds, axis=1) * windows.period
    total = np.concatenate([[np.zeros(2)], np.cumsum(turned[:, -1], axis=0)[:-1]])
    first = total[np.flatnonzero(last)][np.cumsum(last) - 1]
    return np.asarray(turned + (total - first)[:, None])


def library(problem: Problem, motion: Motion) -> list[Term]:
    """Terms that the recordings' channels can show, plain ones first."""
    one = Signal("1", np.ones_like(motion["t"].values), NUMBER)
    body, world, clock = _body(motion, problem), _world(motion), _clock(motion)
    forces = [one, *body, *world, *clock]
    tilts = [one, *world, *clock]
    inertial = [one, *body[:12], *world[:4], *clock]
    by_target: dict[str, list[Signal]] = {
        **dict.fromkeys(("F_x", "F_y", "M_z"), forces),
        **dict.fromkeys(("gravity_x", "gravity_y"), tilts),
        **{f"command_{side}": [one, *_command(motion, side), *clock] for side in ("right", "left")},
        **dict.fromkeys(("specific_force_x", "specific_force_y", "yaw_rate"), inertial),
        **{f"encoder_{side}": [one, *_encoder(motion, side), *clock] for side in ("right", "left")},
        **dict.fromkeys(("pose_x", "pose_y", "pose_yaw"), _pose(motion)),
    }
    present = _present(problem)
    moving = [name for name in TARGETS if name in present or name not in _channels()]
    return [Term(name, s, rank) for name in moving for rank, s in enumerate(by_target[name])]


def _channels() -> tuple[str, ...]:
    from ddagr_gym.identification.windows import CHANNELS

    return CHANNELS


def _present(problem: Problem) -> set[str]:
    known = np.asarray(np.isfinite(problem.blocked.sigma).any(axis=(0, 1)))
    return {name for name, some in zip(_channels(), known.tolist(), strict=True) if some}


def _body(motion: Motion, problem: Problem) -> list[Signal]:
    """Of the motion alone; readings may depend on the first twelve."""
    v_x, v_y, r = motion["v_x"], motion["v_y"], motion["r"]
    radius = Signal("R", np.array(problem.robot.outer_radius), METRE)
    track = Signal("W", np.array(problem.robot.half_track), METRE)
    slips = [
        (radius * motion[f"w_{side}"] - v_x - Signal("1", np.array(sign), NUMBER) * track * r).named(
            f"slip_{side}", SPEED
        )
        for side, sign in (("right", 1.0), ("left", -1.0))
    ]
    return [
        v_x, v_y, r, motion["a_x"], motion["a_y"], motion["r_dot"], v_x.sign(_REST["v_x"]), r.sign(_REST["r"]),
        v_x * r, r.squared().named("|r| r"), v_x.squared(), (r * r).named("r^2"),
        v_y.sign(_REST["v_y"]), v_y.squared(), *slips,
        *(motion[f"angle_{side}"].of_number(f) for side in ("right", "left") for f in ("cos", "sin")
          if f"angle_{side}" in motion.signals),
    ]  # fmt: skip


def _world(motion: Motion) -> list[Signal]:
    """Of heading and place."""
    yaw, x, y = motion["yaw"], motion["x"], motion["y"]
    cos, sin = yaw.of_number("cos"), yaw.of_number("sin")
    return [
        cos, sin, yaw.of_number("cos", 2.0), yaw.of_number("sin", 2.0), x, y,
        (x * cos + y * sin).named("(x cos(yaw) + y sin(yaw))"), (y * cos - x * sin).named("(y cos(yaw) - x sin(yaw))"),
    ]  # fmt: skip


def _clock(motion: Motion) -> list[Signal]:
    """Of the time since each drive began."""
    return [motion["t"], motion["t"].decay(_SLOW[1])]


def _command(motion: Motion, side: str) -> list[Signal]:
    other = "left" if side == "right" else "right"
    own, speed, far = motion[f"c_{side}"], motion[f"w_{side}"], motion[f"c_{other}"]
    return [
        own, far, own.sign(_REST["w"]), motion[f"c_dot_{side}"], speed, own.squared(), own * own.decay(_SLOW[0]),
        motion[f"torque_{side}"], (own - far).sign(_REST["turn"]),
    ]  # fmt: skip


def _encoder(motion: Motion, side: str) -> list[Signal]:
    speed = motion[f"w_{side}"]
    found = [
        speed, speed.sign(_REST["w"]), motion[f"w_dot_{side}"], speed.squared(), motion[f"torque_{side}"],
        motion[f"c_{side}"], motion["r"],
    ]  # fmt: skip
    if f"angle_{side}" in motion.signals:
        found += [speed * motion[f"angle_{side}"].of_number(f) for f in ("cos", "sin")]
    return found


def _pose(motion: Motion) -> list[Signal]:
    yaw, v_x, r = motion["yaw"], motion["v_x"], motion["r"]
    cos, sin = yaw.of_number("cos"), yaw.of_number("sin")
    return [
        cos, sin, r, v_x * cos, v_x * sin, yaw.of_number("cos", 2.0), yaw.of_number("sin", 2.0), motion["x"],
        motion["y"], motion["t"],
    ]  # fmt: skip
