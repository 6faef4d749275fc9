"""Geometry of a row turn: straight run-in, half circle on the headland, straight run-out (theory: control, section 1).

World frame: x along the rows, the headland boundary at x = 0 with the rows at x < 0. The robot starts at
(-run_in, 0) heading +x, turns by 180 degrees about (0, sign radius) and leaves along y = 2 sign radius heading
-x, to x = -run_out; sign is +1 for a left turn. Distances run along this path from its start.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.frames import wrap_angle
from ddagr_gym.validated import Validated, bounded

Array = NDArray[np.float64]

SIDES = {"left": 1, "right": -1}
"""Sign of the yaw rate of a turn to that side."""

FURROW_SLACK = 0.127
"""Smallest lateral slack of a wheel in its furrow [m]: half of 18 inches less a tyre of 20.3 cm (thesis chapter 1)."""

PRACTICE_LATERAL_TOLERANCE = 0.10
"""Lateral exit error accepted in practice [m] (theory: control, metric 4)."""

PRACTICE_HEADING_TOLERANCE = math.radians(15.0)
"""Heading exit error accepted in practice [rad] (theory: control, metric 4)."""


class Phase(enum.IntEnum):
    """Part of the manoeuvre."""

    RUN_IN = 0
    TURN = 1
    RUN_OUT = 2


class ReferencePath(NamedTuple):
    """Samples of the commanded path, arrays (N,): distance [m], x, y [m], yaw [rad], curvature [1/m]."""

    distance: Array
    x: Array
    y: Array
    yaw: Array
    curvature: Array


def side_sign(side: str) -> int:
    """+1 for "left", -1 for "right"; any other name is an InputError."""
    if side not in SIDES:
        raise unknown_name("side", side, SIDES)
    return SIDES[side]


def project_left_turn(x: Array, y: Array, radius: Array | float, run_in: float = 0.0) -> tuple[Array, Array]:
    """Nearest point of a turn to the left by sector: rows at x < 0, circle at x >= 0 (see :meth:`RowTurn.project`).

    Args:
        x, y: positions (...) [m].
        radius: R* (...) [m].
        run_in: distance at the end of the run-in [m].

    Returns:
        Distance along the path (...) [m], and offset (...) [m] to the left of the direction of travel.
    """
    from_centre = y - radius
    on_circle = x >= 0.0
    turning = run_in + radius * np.arctan2(np.abs(x), -from_centre)
    leaving = run_in + math.pi * radius - x
    distance = np.where(on_circle, turning, np.where(from_centre > 0.0, leaving, run_in + x))
    # one expression for all three parts: the radius less the distance from the centre line
    return distance, radius - np.where(on_circle, np.hypot(x, from_centre), np.abs(from_centre))


@dataclass(frozen=True)
class RowTurn(Validated):
    """The commanded manoeuvre. The defaults are the thesis's: 80 cm, and Table 6.2's straights of 5 s and 2.5 s.

    Attributes:
        radius: R*, radius of the half circle [m]; the next row is 2 R* away.
        side: "left" or "right".
        run_in: straight before the headland boundary [m].
        run_out: straight after it [m].
        speed: commanded forward speed [m/s].
    """

    radius: float = bounded("m", 0.3, 5.0, default=0.80)
    side: str = "left"
    run_in: float = bounded("m", 0.0, 50.0, default=1.0)
    run_out: float = bounded("m", 0.0, 50.0, default=0.5)
    speed: float = bounded("m/s", 0.0, 5.0, default=0.20, open_low=True)

    def _check(self) -> None:
        side_sign(self.side)

    @property
    def sign(self) -> int:
        """+1 for a left turn, -1 for a right one."""
        return SIDES[self.side]

    @property
    def centre(self) -> tuple[float, float]:
        """Centre of the half circle (x, y) [m]."""
        return (0.0, self.sign * self.radius)

    @property
    def turn_length(self) -> float:
        """Length of the half circle [m]."""
        return math.pi * self.radius

    @property
    def length(self) -> float:
        """Length of the whole path [m]."""
        return self.run_in + self.turn_length + self.run_out

    @property
    def duration(self) -> float:
        """Time at the commanded speed [s]."""
        return self.length / self.speed

    def phase(self, distance: ArrayLike) -> NDArray[np.int64]:
        """:class:`Phase` at ``distance`` (...) [m] as integers (...)."""
        along = np.asarray(distance, dtype=float) - self.run_in
        return (along >= 0.0).astype(np.int64) + (along >= self.turn_length)

    def _turned(self, distance: ArrayLike) -> Array:
        """Angle turned at ``distance`` [rad], 0 to pi, positive on either side."""
        along = np.asarray(distance, dtype=float) - self.run_in
        return np.clip(along / self.radius, 0.0, math.pi)

    def heading(self, distance: ArrayLike) -> Array:
        """Commanded heading (...) [rad], continuous from 0 to sign pi, at ``distance`` (...) [m]."""
        return self.sign * self._turned(distance)

    def curvature(self, distance: ArrayLike) -> Array:
        """Commanded curvature (...) [1/m], counter-clockwise positive, at ``distance`` (...) [m]."""
        return np.where(self.phase(distance) == Phase.TURN, self.sign / self.radius, 0.0)

    def yaw_rate(self, distance: ArrayLike) -> Array:
        """Commanded yaw rate (...) [rad/s] at the commanded speed, at ``distance`` (...) [m]."""
        return self.speed * self.curvature(distance)

    def distance_at(self, time: ArrayLike) -> Array:
        """Distance (...) [m] at ``time`` (...) [s] after a start at the commanded speed, at most the path's length."""
        return np.clip(self.speed * np.asarray(time, dtype=float), 0.0, self.length)

    def place_on_turn(self, angle: ArrayLike) -> Array:
        """Place (..., 2) [m] on the half circle where ``angle`` (...) [rad] of it have been turned, to either side."""
        turned = np.asarray(angle, dtype=float)
        x, y = self.radius * np.sin(turned), self.sign * self.radius * (1.0 - np.cos(turned))
        return np.stack([x, y], axis=-1)

    def position(self, distance: ArrayLike) -> Array:
        """Commanded position (..., 2) [m]; before 0 and beyond the end the straights go on."""
        distance = np.asarray(distance, dtype=float)
        before = np.minimum(distance - self.run_in, 0.0)
        after = np.maximum(distance - self.run_in - self.turn_length, 0.0)
        found = self.place_on_turn(self._turned(distance))
        found[..., 0] = before + found[..., 0] - after
        return found

    def sample(self, spacing: float = 0.02) -> ReferencePath:
        """The path at equal distances of at most ``spacing`` [m], both ends included."""
        if not (math.isfinite(spacing) and spacing > 0.0):
            raise InputError(f"spacing is {spacing!r}: give a positive distance in m.")
        distance = np.linspace(0.0, self.length, math.ceil(self.length / spacing) + 1)
        x, y = self.position(distance).T
        return ReferencePath(distance, x, y, self.heading(distance), self.curvature(distance))

    def project(self, x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
        """Nearest point of the path by sector, without memory: rows at x < 0, circle at x >= 0.

        Args:
            x, y: positions (...) [m].

        Returns:
            Distance along the path (...) [m], and signed cross-track error (...) [m], positive to the left of
            the direction of travel. Between the rows the nearer row counts.
        """
        x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
        distance, offset = project_left_turn(x, self.sign * y, self.radius, self.run_in)
        return distance, self.sign * offset

    def cross_track_error(self, x: ArrayLike, y: ArrayLike) -> Array:
        """Signed distance from the path (...) [m], positive to the left of the direction of travel."""
        return self.project(x, y)[1]

    def heading_to_go(self, yaw: ArrayLike) -> Array:
        """Heading change left until the next row [rad], positive while short of it; ``yaw`` continuous from 0."""
        return np.asarray(math.pi - self.sign * np.asarray(yaw, dtype=float))

    def exit_error(self, y: float, yaw: float) -> tuple[float, float]:
        """Error at the next row's start line x = 0.

        Args:
            y: where the robot's centre crosses the line [m].
            yaw: its heading there [rad].

        Returns:
            Lateral error [m], positive to the left of the row's direction of travel (-x), and heading error
            [rad] in (-pi, pi], counter-clockwise positive.
        """
        return 2.0 * self.sign * self.radius - y, wrap_angle(float(yaw) - math.pi)


def wheels_fit_furrow(lateral_error: float, heading_error: float, half_wheelbase: float) -> bool:
    """Success of a turn: |e_y| + L |sin e_psi| <= 0.127 m keeps every wheel in its furrow (theory: control, metric 4).

    A heading error above 90 degrees fails, whatever its sine: the robot points back to the headland.
    """
    deviation = abs(lateral_error) + half_wheelbase * abs(math.sin(heading_error))
    return deviation <= FURROW_SLACK and abs(heading_error) < math.pi / 2.0


def within_practice_tolerance(lateral_error: float, heading_error: float) -> bool:
    """Whether the exit is within 0.10 m and 15 degrees (theory: control, metric 4)."""
    return abs(lateral_error) <= PRACTICE_LATERAL_TOLERANCE and abs(heading_error) <= PRACTICE_HEADING_TOLERANCE
