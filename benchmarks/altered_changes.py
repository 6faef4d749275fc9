"""Known changes to a real drive: arithmetic on the columns of its file, without effects or diagnosis.

:mod:`benchmarks.altered_drives` says why each is made.
"""

from __future__ import annotations

import csv
import gzip
import io
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.presets import get_robot

Array = NDArray[np.float64]
Table = Mapping[str, Sequence[str]]
"""Columns of a file as text, so that what is not altered stays as it was."""

DRIVES = ("warthog_asphalt", "warthog_grass", "warthog_sand")
"""Names of the open drives, which are ordinary."""

ROBOT = "warthog"

STEPS = 30
"""Of a drive in steps, from its start: 180 s under command."""

LATE_POSES = 0.5
"""A pose computer whose clock was never synchronised, or a solution stamped on arrival [s]."""

LATE_SENSORS = 0.3
"""Commands logged on another computer than the sensors, whose clock is ahead [s]."""

SCALE = 1.1
"""A worn or wrong gear, tyre or full scale in a table; of encoders and gyro."""

TURNED = 0.3
"""An IMU fixed by eye to a bracket that is not square to the robot (17 degrees) [rad]."""

TILTED = math.radians(3.0)
"""An IMU on a deck that hangs forward [rad]."""

SHORT = 0.9
"""Of encoders whose table has wheels a tenth too small, or gears that were exchanged for those of another model."""

DOUBLED = 2.0
"""Encoders of which both edges are counted where the driver expects one."""

ONE_ENCODER = 1.2
"""One encoder of two whose gear or count was exchanged."""

BIASED = 0.05
"""A gyro that was switched on cold [rad/s]."""

WEAKENED = 0.85
"""Commands of one side, as if its motor had another gain; of both, as if converted with too large a wheel radius."""

QUARTER_TURN = math.pi / 2.0
"""An IMU whose axes were taken from the wrong drawing [rad]."""


@dataclass(frozen=True)
class Layout:
    """Names of the columns in one form of file.

    Attributes:
        commands: what the robot was told, the time, and what counts the rows: all that no sensor wrote.
        encoders: which the log repeats between updates.
        pose: likewise, with the mark of a new one.
        accelerometer: x, y, z.
        gyro: x, y, z; "" where the file has none.
    """

    commands: tuple[str, ...]
    encoders: tuple[str, ...]
    pose: tuple[str, ...]
    accelerometer: tuple[str, str, str]
    gyro: tuple[str, str, str]


IN_STEPS = Layout(
    ("seq", "calib_step", "window", "t", "phase", "cmd_left", "cmd_right"), ("enc_left", "enc_right"),
    ("x", "y", "z", "roll", "pitch", "yaw"), ("imu_ax", "imu_ay", "imu_az"), ("", "", "imu_gz"),
)  # fmt: skip
CONTINUOUS = Layout(
    ("t", "calib_state", "calib_step", "cmd_v", "cmd_w"), ("enc_left", "enc_right"),
    ("icp_x", "icp_y", "icp_z", "icp_roll", "icp_pitch", "icp_yaw", "icp_new"), ("acc_x", "acc_y", "acc_z"),
    ("gyro_x", "gyro_y", "gyro_z"),
)  # fmt: skip
JOIN = 0.05
"""Missing between two windows of a step [s]."""


@dataclass(frozen=True)
class Change:
    """What is written into a drive.

    Attributes:
        name: in the result.
        words: in the picture.
        effect: that it is in the library; "none" for nothing.
        truth: its sizes there, by field.
        write: gives the altered columns.
    """

    name: str
    words: str
    effect: str
    truth: Mapping[str, float] = field(default_factory=dict)
    write: Callable[[Table], Table] = lambda table: table


def layout_of(table: Table) -> Layout:
    """Layout of a file by its columns."""
    return IN_STEPS if "seq" in table else CONTINUOUS


def numbers(table: Table, name: str) -> Array:
    """A column as numbers."""
    return np.array([float(text) for text in table[name]])


def texts(values: Array) -> list[str]:
    """Numbers as a file holds them; NaN is an empty field."""
    return ["" if math.isnan(value) else f"{value:.9g}" for value in values]


def step_numbers(table: Table) -> Array:
    """Number of the step of each row; zero in a drive without steps."""
    return numbers(table, "seq") if "seq" in table else np.zeros(len(table["t"]))


def rows_before(table: Table, seconds: float) -> NDArray[np.int64]:
    """Row of each row that many seconds earlier in the same step, -1 where there is none.

    Args:
        table: in the order of time; without steps it is one.
        seconds: a multiple of the log's period, which it meets within jitter.
    """
    step = step_numbers(table)
    clock = numbers(table, "t") + (JOIN * numbers(table, "window") if "window" in table else 0.0)
    found = np.full(len(clock), -1, dtype=np.int64)
    for number in np.unique(step):
        rows = np.flatnonzero(step == number)
        slack = 0.5 * float(np.median(np.diff(clock[rows])))
        before = np.searchsorted(clock[rows], clock[rows] - seconds + slack) - 1
        found[rows] = np.where(before >= 0, rows[np.maximum(before, 0)], -1)
    return found


def late(table: Table, names: Sequence[str], seconds: float) -> Table:
    """Columns as a log writes them whose sources are late.

    Rows before the first late sample of a step repeat that step's first one where the log repeats samples, and are
    empty elsewhere: the diagnosis takes neither for a new sample.

    Args:
        table: of the drive.
        names: of the columns.
        seconds: by which they are late [s].
    """
    layout, before = layout_of(table), rows_before(table, seconds)
    _, first, step = np.unique(step_numbers(table), return_index=True, return_inverse=True)
    altered = dict(table)
    for name in names:
        column = table[name]
        repeated = name not in (*layout.accelerometer, *layout.gyro)
        altered[name] = [
            column[row] if row >= 0 else column[start] if repeated else ""
            for row, start in zip(before, first[step], strict=True)
        ]
    return altered


def late_poses(table: Table) -> Table:
    """Poses of some time ago under the present stamp."""
    return late(table, layout_of(table).pose, LATE_POSES)


def late_sensors(table: Table, seconds: float = LATE_SENSORS) -> Table:
    """Everything but the commands late [s]: the robot seems to answer that much later, as with a dead time."""
    return late(table, [name for name in table if name not in layout_of(table).commands], seconds)


def scaled(table: Table, names: Sequence[str], factor: float) -> Table:
    """Columns times a factor."""
    return {**table, **{name: texts(factor * numbers(table, name)) for name in names}}


def biased(table: Table) -> Table:
    """A yaw rate that reads too much."""
    (name,) = _yaw_rate(table)
    return {**table, name: texts(numbers(table, name) + BIASED)}


def one_side_commanded(table: Table, half_track: float) -> Table:
    """Commands of the right side times a factor; those of the body are taken apart into sides and put together again.

    Args:
        table: of the drive.
        half_track: of the robot, as the map takes it [m].
    """
    if "cmd_right" in table:
        return scaled(table, ("cmd_right",), WEAKENED)
    v, turn = numbers(table, "cmd_v"), half_track * numbers(table, "cmd_w")
    right, left = WEAKENED * (v + turn), v - turn
    return {
        **table, "cmd_v": texts(0.5 * (right + left)), "cmd_w": texts(0.5 * (right - left) / half_track),
    }  # fmt: skip


def encoders_exchanged(table: Table) -> Table:
    """Each encoder's readings in the column of the other."""
    left, right = layout_of(table).encoders
    return {**table, left: table[right], right: table[left]}


def turned(table: Table, axes: Array) -> Table:
    """Readings of an IMU in other axes; a gyro axis that the file lacks reads nothing.

    Args:
        table: of the drive.
        axes: of the sensor in the robot's frame, (3, 3), one a column.
    """
    layout, altered = layout_of(table), dict(table)
    for triad in (layout.accelerometer, layout.gyro):
        known = [numbers(table, name) if name else np.zeros(len(table["t"])) for name in triad]
        for name, values in zip(triad, axes.T @ np.stack(known), strict=True):
            if name:
                altered[name] = texts(values)
    return altered


def about_vertical(angle: float) -> Array:
    """Axes turned counter-clockwise [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def nose_down(angle: float) -> Array:
    """Axes pitched about y (REP 103) [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def _yaw_rate(table: Table) -> tuple[str]:
    return (layout_of(table).gyro[2],)


def _both(factor: float) -> dict[str, float]:
    return {"right": factor, "left": factor}


CONTROL = Change("nothing", "nothing (control)", "none")
CHANGES = (
    CONTROL,
    Change("late_poses", f"poses {LATE_POSES:g} s late", "pose_latency", {"latency": LATE_POSES}, late_poses),
    Change(
        "late_sensors", f"sensors {LATE_SENSORS:g} s after commands", "command_delay", {"delay": LATE_SENSORS},
        late_sensors,
    ),
    Change(
        "encoders_scaled", f"encoders times {SCALE:g}", "encoder_scale", _both(SCALE),
        lambda table: scaled(table, layout_of(table).encoders, SCALE),
    ),
    Change(
        "imu_turned", f"IMU turned {TURNED:g} rad", "imu_misalignment", {"yaw": TURNED},
        lambda table: turned(table, about_vertical(TURNED)),
    ),
    Change(
        "imu_tilted", "IMU pitched 3 degrees", "imu_tilt", {"pitch": TILTED},
        lambda table: turned(table, nose_down(TILTED)),
    ),
    Change(
        "gyro_scaled", f"yaw rate times {SCALE:g}", "gyro_scale", {"scale": SCALE},
        lambda table: scaled(table, _yaw_rate(table), SCALE),
    ),
    Change("gyro_reversed", "yaw rate reversed", "gyro_sign", {}, lambda table: scaled(table, _yaw_rate(table), -1.0)),
    Change(
        "encoders_doubled", f"encoders times {DOUBLED:g}", "encoder_scale", _both(DOUBLED),
        lambda table: scaled(table, layout_of(table).encoders, DOUBLED),
    ),
    Change(
        "imu_quarter_turn", "IMU turned 90 degrees", "imu_misalignment", {"yaw": QUARTER_TURN},
        lambda table: turned(table, about_vertical(QUARTER_TURN)),
    ),
)  # fmt: skip


FURTHER = (
    Change(
        "encoder_scaled", f"left encoder times {ONE_ENCODER:g}", "encoder_scale", {"left": ONE_ENCODER, "right": 1.0},
        lambda table: scaled(table, layout_of(table).encoders[:1], ONE_ENCODER),
    ),
    Change("gyro_biased", f"yaw rate + {BIASED:g} rad/s", "gyro_bias", {"bias": BIASED}, biased),
    Change(
        "one_side_commanded", "commands of the right side times 0.85", "command_gain",
        {"right": 1.0 / WEAKENED, "left": 1.0},
        partial(one_side_commanded, half_track=get_robot(ROBOT).half_track),
    ),
    Change("encoders_exchanged", "encoders exchanged", "encoders_exchanged", {}, encoders_exchanged),
)  # fmt: skip
BOTH_SIDES = (
    Change(
        "encoders_short", f"encoders times {SHORT:g}", "encoder_scale", _both(SHORT),
        lambda table: scaled(table, layout_of(table).encoders, SHORT),
    ),
    Change(
        "both_commanded", f"commands times {WEAKENED:g}", "command_gain", _both(1.0 / WEAKENED),
        lambda table: scaled(table, layout_of(table).commands[-2:], WEAKENED),
    ),
)  # fmt: skip
"""Encoders or commands that are wrong alike on both sides, which a data sheet leaves open."""
ALL = {change.name: change for change in (*CHANGES, *FURTHER)}
"""By name, what is also asked against a calibration."""
ABSOLUTE = ALL | {change.name: change for change in BOTH_SIDES}
"""By name, what is asked without one."""


def read_table(path: Path, steps: int = STEPS) -> Table:
    """Columns of a drive; of one in steps the first ones.

    Args:
        path: gzip CSV.
        steps: to keep.
    """
    with gzip.open(path, "rt", newline="") as stream:
        head, *rows = csv.reader(stream)
    if "seq" in head:
        place = head.index("seq")
        rows = [row for row in rows if int(row[place]) < steps]
    return dict(zip(head, map(list, zip(*rows, strict=True)), strict=True))


def packed(table: Table) -> bytes:
    """The file of a table; the same table gives the same bytes."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table)
    writer.writerows(zip(*table.values(), strict=True))
    return gzip.compress(text.getvalue().encode(), mtime=0)
