"""What a picture of a drive shows, as plain data: the stage that stays, and the scene at one instant.

World frame, SI units and wheel order as everywhere; banks are (right, left).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.control.circle import running_radius
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Robot

Array = NDArray[np.float64]

BED_WIDTH = 0.648
"""Mean bed of the thesis's three strawberry fields, 25.5 inches [m] (chapter 1)."""

NARROWEST_FURROW = 0.457
"""18 inches [m] (thesis chapter 1)."""

SCENE_COLUMNS = (
    "t",
    "command_right",
    "command_left",
    "encoder_right",
    "encoder_left",
    "true_x",
    "true_y",
    "true_yaw",
    *(f"true_slip_ratio_{i}" for i in (1, 2, 3, 4)),
    *(f"true_sinkage_{i}" for i in (1, 2, 3, 4)),
)
"""Columns of a simulated drive that :func:`scenes` reads."""


@dataclass(frozen=True)
class View:
    """World rectangle that the camera shows [m]."""

    x_min: float
    x_max: float
    y_min: float
    y_max: float

    def __post_init__(self) -> None:
        sides = (self.x_max - self.x_min, self.y_max - self.y_min)
        if not all(math.isfinite(side) and side > 0.0 for side in sides):
            raise InputError(f"view of {sides[0]:g} x {sides[1]:g} m: give finite limits, minimum before maximum.")


@dataclass(frozen=True)
class BedLayout:
    """Raised beds along x, from far left to ``end``.

    Attributes:
        centres: y of each bed's middle [m].
        width: of a bed [m].
        end: x of the headland boundary [m].
    """

    centres: tuple[float, ...]
    width: float = BED_WIDTH
    end: float = 0.0


@dataclass(frozen=True, eq=False)
class Stage:
    """What stays the same over a drive.

    Attributes:
        robot: for its wheels and outline.
        view: what the camera shows.
        title: what is driven, one short line.
        soil_name: name of the soil.
        beds: rows, or None for open ground.
        target_path: commanded positions (N, 2) [m], or None.
        target_radius: R* [m], or None.
    """

    robot: Robot
    view: View
    title: str
    soil_name: str
    beds: BedLayout | None = None
    target_path: Array | None = None
    target_radius: float | None = None


@dataclass(frozen=True, eq=False)
class Scene:
    """One instant of a drive.

    Attributes:
        stage: what stays.
        time: [s].
        track: true poses so far (x, y, yaw), (T, 3) [m, m, rad]; the last is now.
        ruts: sinkage of the wheels along ``track``, (T, 4) [m].
        wheel_speed: measured bank speeds (right, left) [rad/s].
        command: commanded bank speeds (right, left) [rad/s].
        slip_ratio: of the wheels now (4,).
        wheel_angle: how far the banks have rolled (right, left) [rad], for the tread.
        estimated_track: estimated positions so far (K, 2) [m], or None.
        radius: radius of the turn so far [m], or None before there is one.
        metrics: further lines to show, (name, value with unit).
    """

    stage: Stage
    time: float
    track: Array
    ruts: Array
    wheel_speed: tuple[float, float]
    command: tuple[float, float]
    slip_ratio: tuple[float, float, float, float]
    wheel_angle: tuple[float, float] = (0.0, 0.0)
    estimated_track: Array | None = None
    radius: float | None = None
    metrics: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        _check_rows("track", self.track, 3)
        _check_rows("ruts", self.ruts, 4)
        if len(self.track) != len(self.ruts):
            raise InputError(f"track has {len(self.track)} rows and ruts {len(self.ruts)}: give one for each instant.")
        if self.estimated_track is not None and len(self.estimated_track):
            _check_rows("estimated_track", self.estimated_track, 2)

    @property
    def pose(self) -> tuple[float, float, float]:
        """True pose now (x, y, yaw) [m, m, rad]."""
        x, y, yaw = self.track[-1]
        return float(x), float(y), float(yaw)

    @property
    def sinkage(self) -> tuple[float, ...]:
        """Sinkage of the wheels now (4,) [m]."""
        return tuple(float(z) for z in self.ruts[-1])


def _check_rows(name: str, rows: Array, width: int) -> None:
    shape = np.shape(rows)
    if len(shape) != 2 or shape[1] != width or not shape[0]:
        raise InputError(f"{name} has shape {shape}: give (T, {width}), one row at least.")
    if not np.isfinite(rows).all():
        raise InputError(f"{name} holds values that are not finite: a picture needs a number at every instant.")


def bed_layout(turn: RowTurn, half_track: float, extent: tuple[float, float]) -> BedLayout:
    """Beds that the robot straddles on its way in and on its way out, repeated over ``extent``.

    The distance of the rows divides 2 R* so that it comes closest to the track, which is what straddling needs.

    Args:
        turn: the commanded manoeuvre.
        half_track: of the robot [m].
        extent: lowest and highest y to cover [m].
    """
    shift = 2.0 * turn.radius
    pitch = shift / max(1, round(shift / (2.0 * half_track)))
    width = min(BED_WIDTH, max(pitch - NARROWEST_FURROW, 0.25 * pitch))
    first, last = math.floor(extent[0] / pitch) - 1, math.ceil(extent[1] / pitch) + 1
    return BedLayout(tuple(pitch * k for k in range(first, last + 1)), width)


def _reach(robot: Robot) -> float:
    tyre = max(wheel.outer_radius for wheel in robot.wheels), max(wheel.half_width for wheel in robot.wheels)
    return math.hypot(robot.half_wheelbase + tyre[0], robot.half_track + tyre[1])


def turn_stage(turn: RowTurn, robot: Robot, soil_name: str) -> Stage:
    """Stage of a row turn: the view holds the robot on the whole commanded path, with room for a wide turn."""
    reach, room = _reach(robot), 0.25 + 0.15 * turn.radius
    path = turn.sample(0.01)
    view = View(
        float(path.x.min()) - 0.8 * reach - room / 2.0,
        turn.radius + reach + room,
        float(path.y.min()) - reach - room / 2.0,
        float(path.y.max()) + reach + room / 2.0,
    )
    # A tall picture shows more of the field than the view asks for.
    more = 2.0 * (view.x_max - view.x_min)
    beds = bed_layout(turn, robot.half_track, (view.y_min - more, view.y_max + more))
    points = np.column_stack([path.x, path.y])
    return Stage(robot, view, f"Row turn, {turn.side}", soil_name, beds, points, turn.radius)


def open_stage(x: ArrayLike, y: ArrayLike, robot: Robot, soil_name: str, title: str) -> Stage:
    """Stage of any other drive on open ground, framed to the positions (T,) [m] that will be driven."""
    if not np.size(x) or np.shape(x) != np.shape(y):
        raise InputError(f"positions of shapes {np.shape(x)} and {np.shape(y)}: give one x and one y at each instant.")
    reach = 1.25 * _reach(robot)
    limits = [float(edge) for v in (x, y) for edge in (np.min(v) - reach, np.max(v) + reach)]
    return Stage(robot, View(*limits), title, soil_name)


def scenes(
    columns: Mapping[str, ArrayLike], stage: Stage, *, frame_rate: float = 25.0, side: str | None = None
) -> Iterator[Scene]:
    """Scenes of a simulated drive in real time.

    Args:
        columns: :data:`SCENE_COLUMNS`, each (T,); ``estimated_x``, ``estimated_y`` are drawn where present.
        stage: what stays.
        frame_rate: scenes per second of the drive.
        side: of the turn whose radius is shown, "left" or "right"; None for no turn.

    Raises:
        InputError: a column is missing, or the frame rate is not positive.
    """
    missing = [name for name in SCENE_COLUMNS if name not in columns]
    if missing:
        raise InputError(f"column {missing[0]!r} is missing: a scene needs {', '.join(SCENE_COLUMNS)}.")
    if not (math.isfinite(frame_rate) and frame_rate > 0.0):
        raise InputError(f"frame_rate is {frame_rate!r}: give frames per second above 0.")
    data = {name: np.asarray(columns[name], dtype=float) for name in columns}
    t = data["t"]
    count = max(1, math.ceil((t[-1] - t[0]) * frame_rate))
    picked = np.searchsorted(t, t[0] + np.arange(count + 1) / frame_rate - 1e-9)
    track = np.column_stack([data[f"true_{name}"] for name in ("x", "y", "yaw")])
    ruts = np.column_stack([data[f"true_sinkage_{i}"] for i in (1, 2, 3, 4)])
    rolled = _rolled(data)
    for index in np.minimum(picked, len(t) - 1).tolist():
        yield _scene_at(index, data, stage, (track, ruts, rolled), side)


def _rolled(data: Mapping[str, Array]) -> Array:
    """Angle rolled by the banks (T, 2) [rad] from the encoders; a missing sample holds the last one."""
    speed = np.column_stack([data["encoder_right"], data["encoder_left"]])
    step = np.diff(data["t"], prepend=data["t"][0])[:, None]
    return np.nancumsum(speed * step, axis=0)


def _scene_at(
    index: int, data: Mapping[str, Array], stage: Stage, history: tuple[Array, Array, Array], side: str | None
) -> Scene:
    track, ruts, rolled = (values[: index + 1] for values in history)
    estimate = None
    if "estimated_x" in data:
        estimate = np.column_stack([data["estimated_x"], data["estimated_y"]])[: index + 1]
    now = {name: float(values[index]) for name, values in data.items()}
    slip = tuple(now[f"true_slip_ratio_{i}"] for i in (1, 2, 3, 4))
    return Scene(
        stage=stage,
        time=now["t"],
        track=track,
        ruts=ruts,
        wheel_speed=(now["encoder_right"], now["encoder_left"]),
        command=(now["command_right"], now["command_left"]),
        slip_ratio=(slip[0], slip[1], slip[2], slip[3]),
        wheel_angle=(float(rolled[-1, 0]), float(rolled[-1, 1])),
        estimated_track=estimate,
        radius=None if side is None else running_radius(track[:, 0], track[:, 1], track[:, 2], side),
    )
