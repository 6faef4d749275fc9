"""How a row turn is judged (theory: control, section 4): pure functions of what was truly driven.

Results are frozen dataclasses without NaN. What a drive leaves undefined is None, and a status says why.
World frame and signs as in :mod:`ddagr_gym.control.row_turn`.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.control.circle import WINDOW, taubin_circle, turn_window
from ddagr_gym.control.row_turn import RowTurn, side_sign, wheels_fit_furrow, within_practice_tolerance
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.costs import (
    count_robot_stalls,
    count_stalls,
    finite_series,
    headland_depth,
    slip_energy,
    wheel_quantities,
    wheel_speed_variation,
)
from ddagr_gym.frames import unwrap_heading
from ddagr_gym.parameters import Robot

Array = NDArray[np.float64]

RADIUS_AGREEMENT = 0.01
"""Largest relative difference of the two radii before a turn is flagged [-] (theory: control, metric 2)."""

TURN_COLUMNS = (
    "t",
    "command_right",
    "command_left",
    "true_omega_right",
    "true_omega_left",
    "true_x",
    "true_y",
    "true_yaw",
    "true_v_x",
    "true_v_y",
    "true_yaw_rate",
)
"""Columns of a simulated drive that :func:`turn_metrics` reads."""


class TurnStatus(enum.Enum):
    """Whether a turn's radius is defined."""

    COMPLETE = "complete"
    SHORT_ARC = "heading change ended between 30 and 150 degrees: radius from a short arc, not comparable"
    NO_TURN = "heading never changed by 30 degrees to the commanded side"
    NOT_A_CIRCLE = "the positions of the turn lie on a line or a point"


@dataclass(frozen=True)
class TurnRadius:
    """Radius of a driven turn against the commanded one.

    Attributes:
        status: why the rest is None, or that it is whole.
        heading_change: largest change of heading to the commanded side [rad].
        radius: R_fit, Taubin's circle through the positions at 30 to 150 degrees of heading change [m].
        error: e_R = (R_fit - R*)/R* [-].
        residual: root mean square radial distance of these positions from the circle [m].
        integral_radius: R_int, arc length over course change between the same samples [m].
        disagreement: |R_int - R_fit| / R_fit [-].
        consistent: whether the two agree within 1 %; a turn where they do not is flagged.
    """

    status: TurnStatus
    heading_change: float
    radius: float | None = None
    error: float | None = None
    residual: float | None = None
    integral_radius: float | None = None
    disagreement: float | None = None
    consistent: bool = False


@dataclass(frozen=True)
class ExitState:
    """Pose at the next row's start line.

    Attributes:
        time: when the robot's centre crossed the line [s].
        lateral_error: e_y, positive to the left of the row's direction of travel [m].
        heading_error: e_psi, counter-clockwise positive [rad].
        wheels_fit: success, |e_y| + L |sin e_psi| <= 0.127 m.
        within_practice: |e_y| <= 0.10 m and |e_psi| <= 15 degrees.
    """

    time: float
    lateral_error: float
    heading_error: float
    wheels_fit: bool
    within_practice: bool


@dataclass(frozen=True)
class TurnMetrics:
    """Metrics 1 to 5 of one drive.

    Attributes:
        turn: radius and its error.
        exit: pose at the next row's start line; None where that was never reached.
        radial_error_rms: distance from the commanded centre less R*, on the headland [m]; None if never there.
        radial_error_maximum: its largest absolute value [m].
        headland_depth: farthest reach of the tyres beyond the boundary [m].
        duration: of the drive, to the exit where there is one [s].
        slip_energy: work lost between wheels and soil [J]; None without wheel forces.
        wheel_speed_variation: total variation of the bank speeds per time, both banks added [rad/s^2].
        bank_stalls: stalls of a bank against its command.
        robot_stalls: times the wheels turned and the robot stood.
    """

    turn: TurnRadius
    exit: ExitState | None
    radial_error_rms: float | None
    radial_error_maximum: float | None
    headland_depth: float
    duration: float
    slip_energy: float | None
    wheel_speed_variation: float
    bank_stalls: int
    robot_stalls: int


def integral_radius(x: ArrayLike, y: ArrayLike, side: str) -> float | None:
    """R_int: arc length over course change of a track (theory: control, metric 2).

    Both are taken between the middles of the first and the last chord, where the chords' directions hold.

    Args:
        x, y: positions (T,) [m].
        side: "left" or "right".

    Returns:
        Radius [m], negative for a track that bends to the other side; None where it does not bend.
    """
    step = np.diff(np.column_stack([x, y]), axis=0)
    length = np.hypot(*step.T)
    moving = length > 0.0
    if np.count_nonzero(moving) < 2:
        return None
    step, length = step[moving], length[moving]
    course = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    change = side_sign(side) * float(course[-1] - course[0])
    arc = float(length.sum() - (length[0] + length[-1]) / 2.0)
    return None if abs(change) < 1e-9 else arc / change


def turn_radius_error(x: ArrayLike, y: ArrayLike, yaw: ArrayLike, target_radius: float, side: str) -> TurnRadius:
    """Metrics 1 and 2: radius of the driven turn, its error, its residual, and the cross-check.

    Args:
        x, y: true positions of the robot's centre (T,) [m].
        yaw: true heading (T,) [rad]; the change counts from the first sample.
        target_radius: R* [m].
        side: commanded side, "left" or "right".

    Raises:
        InputError: series of different length or with gaps, a radius that is not positive, an unknown side.
    """
    x, y, yaw = finite_series(x=x, y=y, yaw=yaw)
    if not (math.isfinite(target_radius) and target_radius > 0.0):
        raise InputError(f"target_radius is {target_radius!r}: give a positive radius in m.")
    window, change = turn_window(yaw, side)
    if window is None:
        return TurnRadius(TurnStatus.NO_TURN, change)
    fit = taubin_circle(x[window], y[window])
    if fit is None:
        return TurnRadius(TurnStatus.NOT_A_CIRCLE, change)
    integral = integral_radius(x[window], y[window], side)
    disagreement = None if integral is None else abs(integral - fit.radius) / fit.radius
    return TurnRadius(
        status=TurnStatus.COMPLETE if change > WINDOW[1] else TurnStatus.SHORT_ARC,
        heading_change=change,
        radius=fit.radius,
        error=(fit.radius - target_radius) / target_radius,
        residual=fit.residual,
        integral_radius=integral,
        disagreement=disagreement,
        consistent=disagreement is not None and disagreement <= RADIUS_AGREEMENT,
    )


def headland_samples(x: ArrayLike, yaw: ArrayLike, side: str) -> tuple[slice | None, bool]:
    """Samples from the first on the headland (x >= 0) to the crossing back, and whether it crossed back.

    The way back counts once the heading has changed by more than 90 degrees to the commanded side, so that a
    robot that backs over the line on its way in has not left.
    """
    x = np.asarray(x, dtype=float)
    heading = unwrap_heading(yaw)
    on_headland = x >= 0.0
    if not on_headland.any():
        return None, False
    first = int(np.argmax(on_headland))
    turned = side_sign(side) * (heading - heading[0]) > math.pi / 2.0
    back = np.flatnonzero(on_headland[first:-1] & ~on_headland[first + 1 :] & turned[first + 1 :])
    return (slice(first, first + int(back[0]) + 1), True) if back.size else (slice(first, len(x)), False)


def radial_error(x: ArrayLike, y: ArrayLike, yaw: ArrayLike, turn: RowTurn) -> tuple[float, float] | None:
    """Metric 3: distance from the commanded centre less R* while on the headland, (RMS, largest absolute) [m]."""
    x, y, yaw = finite_series(x=x, y=y, yaw=yaw)
    window, _ = headland_samples(x, yaw, turn.side)
    if window is None:
        return None
    error = turn.cross_track_error(x[window], y[window])
    return float(np.sqrt(np.mean(error**2))), float(np.abs(error).max())


def exit_state(
    t: ArrayLike, x: ArrayLike, y: ArrayLike, yaw: ArrayLike, turn: RowTurn, half_wheelbase: float
) -> ExitState | None:
    """Metric 4: pose where the robot's centre first crosses the next row's start line, linear between samples.

    Args:
        t, x, y, yaw: time and true pose, each (T,) [s, m, m, rad].
        turn: the commanded manoeuvre.
        half_wheelbase: L [m].

    Returns:
        The exit, or None where the line was never crossed.
    """
    t, x, y, yaw = finite_series(t=t, x=x, y=y, yaw=yaw)
    window, crossed = headland_samples(x, yaw, turn.side)
    if window is None or not crossed:
        return None
    last = window.stop - 1
    share = x[last] / (x[last] - x[last + 1])
    time, lateral, heading = (
        float(value[last] + share * (value[last + 1] - value[last])) for value in (t, y, unwrap_heading(yaw))
    )
    e_y, e_psi = turn.exit_error(lateral, heading)
    return ExitState(
        time, e_y, e_psi, wheels_fit_furrow(e_y, e_psi, half_wheelbase), within_practice_tolerance(e_y, e_psi)
    )


def turn_metrics(columns: Mapping[str, ArrayLike], turn: RowTurn, robot: Robot) -> TurnMetrics:
    """Metrics 1 to 5 of a simulated drive, up to the crossing of the next row's start line where there is one.

    Args:
        columns: :data:`TURN_COLUMNS`, each (T,); the slip energy also needs ``true_force_x_1`` ... 4, and the same
            of ``force_y``, ``yaw_moment`` and ``axle_torque``, and is None without them.
        turn: the commanded manoeuvre.
        robot: for its wheelbase, track and tyres.

    Raises:
        InputError: a column is missing, has gaps or another length.
    """
    missing = [name for name in TURN_COLUMNS if name not in columns]
    if missing:
        raise InputError(f"column {missing[0]!r} is missing: metrics of a turn need {', '.join(TURN_COLUMNS)}.")
    whole = dict(zip(TURN_COLUMNS, finite_series(**{name: columns[name] for name in TURN_COLUMNS}), strict=True))
    track = (whole["true_x"], whole["true_y"], whole["true_yaw"])
    leave = exit_state(whole["t"], *track, turn, robot.half_wheelbase)
    judged = slice(None) if leave is None else slice(0, int(np.searchsorted(whole["t"], leave.time)) + 1)
    part = {name: value[judged] for name, value in whole.items()}
    t, pose = part["t"], (part["true_x"], part["true_y"], part["true_yaw"])
    radial, wheels = radial_error(*pose, turn), wheel_quantities(columns, robot)
    return TurnMetrics(
        turn=turn_radius_error(*pose, turn.radius, turn.side),
        exit=leave,
        radial_error_rms=None if radial is None else radial[0],
        radial_error_maximum=None if radial is None else radial[1],
        headland_depth=headland_depth(*pose, robot),
        duration=float((t[-1] if leave is None else leave.time) - t[0]),
        slip_energy=None if wheels is None else slip_energy(t, {k: v[judged] for k, v in wheels.items()}),
        wheel_speed_variation=wheel_speed_variation(t, part["true_omega_right"], part["true_omega_left"]),
        bank_stalls=sum(
            count_stalls(t, part[f"command_{bank}"], part[f"true_omega_{bank}"], minimum_expected=0.1)
            for bank in ("right", "left")
        ),
        robot_stalls=count_robot_stalls(t, part, robot),
    )
