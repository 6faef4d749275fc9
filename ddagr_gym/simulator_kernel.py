"""One sensor sample of the simulator, compiled: the only place where the order of things is set.

    commands -> motors -> loads -> soil -> body (forces inside) -> readings

Environments are rows of a matrix and independent of each other; see :mod:`ddagr_gym.physics.layout`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import borrowed, claim, count_of, count_up, kernel
from ddagr_gym.physics.body_dynamics import evaluate_forces, place_wheels, restore_body
from ddagr_gym.physics.callbacks import EffectActions, actions_on, apply_effects
from ddagr_gym.physics.drivetrain import (
    bank_acceleration,
    delay_by_dead_time,
    follows_past,
    mark_dynamic_banks,
    set_targets,
    turn_banks,
    wind_up,
)
from ddagr_gym.physics.force_record import (
    FOLLOWS,
    IDLE,
    RECORDS,
    ForceRecord,
    decision_at,
    is_same_ground,
    keep_decision,
    keep_ground,
    record_of,
)
from ddagr_gym.physics.integrators import advance_body
from ddagr_gym.physics.layout import (
    COMMAND,
    COMMAND_DELAY,
    COMMAND_GAIN,
    DERIVATIVE_VALID,
    DYNAMIC_BANKS,
    FELT_DEPTH,
    GRAVITY,
    MEAN_SPECIFIC_FORCE,
    MEAN_YAW_ACCELERATION,
    MOTOR_RATE,
    MOTOR_TARGET,
    OMEGA,
    POINT_COMMANDS,
    POINT_LOADS,
    POINT_MOTORS,
    POINT_READINGS,
    POINT_SET_POINTS,
    POINT_SOIL,
    READING,
    SAMPLE_PERIOD,
    TIME,
    V_X,
    V_Y,
    WHEEL,
    YAW_RATE,
)
from ddagr_gym.physics.numerics import StepNumerics, named_numerics
from ddagr_gym.physics.terrain import SoilGrids, sample_soil
from ddagr_gym.sensors.imu import read_imu
from ddagr_gym.sensors.normal_draws import GIVEN, draw_normals
from ddagr_gym.sensors.pose_receiver import read_pose
from ddagr_gym.sensors.wheel_encoder import read_encoders

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Bundle = tuple[Any, ...]
"""Fields of a named tuple as a plain one: numba takes these from Python several times faster."""


class Stretch(NamedTuple):
    """Samples to drive over: what N environments are given, and what is written of them.

    Attributes:
        commands: (N, samples or 1, 2) bank speed commands; a single one for all samples [rad/s].
        noise: (N, samples, NOISE_CHANNELS) standard normal draws.
        fill: address of the function that draws them.
        generators: (N,) addresses of the generators to draw ``noise`` from; GIVEN where it has been written.
        recorded: (K,) row entries to record.
        readings: (N, samples, 8), written.
        record: (N, samples, K), written.
    """

    commands: Array
    noise: Array
    fill: int
    generators: Integers
    recorded: Integers
    readings: Array
    record: Array


@kernel()
def _drive(row: Array, command: Array, actions: EffectActions) -> None:
    """Commands and motor loops for the coming sample."""
    row[COMMAND] = row[COMMAND_GAIN] * command[0]
    row[COMMAND + 1] = row[COMMAND_GAIN + 1] * command[1]
    apply_effects(POINT_COMMANDS, row, actions)
    set_targets(row)
    if row[COMMAND_DELAY] > 0.0:
        delay_by_dead_time(row)
    apply_effects(POINT_SET_POINTS, row, actions)
    apply_effects(POINT_MOTORS, row, actions)
    mark_dynamic_banks(row)


@kernel(inline=True)
def _speed_change(row: Array, bank: int, step: float) -> float:
    """About how much a bank's speed changes in the coming ``step`` [s]."""
    if row[DYNAMIC_BANKS] != 0.0:
        return bank_acceleration(row, bank) * step
    return (row[MOTOR_TARGET + bank] - row[OMEGA + bank]) * (1.0 - math.exp(-row[MOTOR_RATE + bank] * step))


@kernel()
def _division(row: Array, numerics: StepNumerics) -> int:
    """Steps for the coming sample: more while a bank's rim speed changes fast against the wheel's speed.

    A wheel slower than the rest speed counts as that fast: one that hardly begins to turn divides nothing.
    """
    steps = max(numerics.substeps, math.ceil(row[SAMPLE_PERIOD] / numerics.maximum_step - 1e-9))
    step = row[SAMPLE_PERIOD] / steps
    for bank in range(2):
        rim = row[WHEEL + bank] + row[WHEEL + 8 + bank]
        change = _speed_change(row, bank, step)
        speed = max(abs(rim * row[OMEGA + bank]), abs(row[V_X]), numerics.forces.rest_speed)
        if abs(rim * change) > numerics.launch_change * speed:
            return steps * numerics.launch_substeps
    return steps


@kernel()
def _prepare_ground(row: Array, grids: SoilGrids, n: int, actions: EffectActions) -> None:
    """Loads and soil as the effects leave them."""
    restore_body(row)
    apply_effects(POINT_LOADS, row, actions)
    place_wheels(row)
    sample_soil(row, grids, n)
    for i in range(4):
        row[FELT_DEPTH + i] = 1.0
    apply_effects(POINT_SOIL, row, actions)


@kernel()
def _average_motion(row: Array, v_x: float, v_y: float, yaw_rate: float) -> None:
    """Mean specific force and yaw acceleration over the sample that began at the given motion.

    The change of velocity in body axes is that of the inertial one less the turning of the axes and gravity.
    Theory: wheel model, eq. (34).
    """
    period = row[SAMPLE_PERIOD]
    turning_x = 0.5 * (yaw_rate * v_y + row[YAW_RATE] * row[V_Y])
    turning_y = 0.5 * (yaw_rate * v_x + row[YAW_RATE] * row[V_X])
    row[MEAN_SPECIFIC_FORCE] = (row[V_X] - v_x) / period - turning_x - row[GRAVITY]
    row[MEAN_SPECIFIC_FORCE + 1] = (row[V_Y] - v_y) / period + turning_y - row[GRAVITY + 1]
    row[MEAN_YAW_ACCELERATION] = (row[YAW_RATE] - yaw_rate) / period


@kernel()
def settle_rows(rows: Array, chosen: Integers, grids: Bundle, actions: Bundle, numerics: Bundle) -> None:
    """Sinkages and forces at the present motion of the rows ``chosen`` (K,), independent of earlier values."""
    accuracy = named_numerics(numerics)
    for n in chosen:
        row, own = rows[n], actions_on(EffectActions(*actions), n)
        _prepare_ground(row, SoilGrids(*grids), n, own)
        row[DERIVATIVE_VALID] = 0.0
        evaluate_forces(row, accuracy.jacobian_refresh, accuracy, own)


@kernel()
def remember_rows(rows: Array, past: Array, speeds: Array, actions: Bundle) -> None:
    """Let drivetrains, and effects on commands and motors, see what was before the rows' present motion, which stays.

    Args:
        rows: (N, layout.SIZE).
        past: (N, H, 2) commands of the samples before, the latest last; NaN where unknown.
        speeds: (N, H, 2) bank speeds at the ends of these samples, for the speed loops' integral parts; NaN: unknown.
        actions: of N environments.
    """
    count = past.shape[1]
    for n in range(rows.shape[0]):
        row, now, own = rows[n], rows[n, TIME], actions_on(EffectActions(*actions), n)
        right, left = row[OMEGA], row[OMEGA + 1]
        for k in range(count):
            if math.isnan(past[n, k, 0]):
                continue
            row[TIME] = now - (count - k) * row[SAMPLE_PERIOD]
            if follows_past(row):
                turn_banks(row, speeds[n, k])  # where the speed before this sample is unknown
                turn_banks(row, speeds[n, max(k - 1, 0)])
            _drive(row, past[n, k], own)
            if row[DYNAMIC_BANKS] != 0.0:
                wind_up(row, speeds[n, k])
        row[TIME], row[OMEGA], row[OMEGA + 1] = now, right, left


@kernel()
def _recorded_steps(row: Array, sample: int, accuracy: StepNumerics, record: ForceRecord) -> tuple[int, ForceRecord]:
    """Steps of a sample, and the record that serves in it: nothing is extrapolated where the ground is another one."""
    if record.state[0] == FOLLOWS:
        steps = decision_at(record, 0)
        record.state[2] += 1
        limit = record.limit if is_same_ground(row, record, sample) else 0.0
        return steps, ForceRecord(record.entries, record.decisions, record.grounds, record.state, limit)
    steps = _division(row, accuracy)
    if record.state[0] == RECORDS:
        keep_ground(row, record, sample)
        keep_decision(record, 0, steps)
        record.state[2] += 1
    return steps, record


@kernel(inline=True)
def _advance_row(
    row: Array, n: int, stretch: Stretch, grids: SoilGrids, actions: EffectActions, accuracy: StepNumerics,
    record: ForceRecord,
) -> None:  # fmt: skip
    """Advance row ``n`` by the samples of ``stretch``; ``actions`` and ``record`` are its own."""
    held = stretch.commands.shape[1] == 1
    if stretch.generators[n] != GIVEN:
        draw_normals(stretch.fill, stretch.generators[n], stretch.noise[n])
    for k in range(stretch.readings.shape[1]):
        _drive(row, stretch.commands[n, 0 if held else k], actions)
        _prepare_ground(row, grids, n, actions)
        v_x, v_y, yaw_rate = row[V_X], row[V_Y], row[YAW_RATE]
        if record.state[0] == IDLE:
            steps = _division(row, accuracy)
            for _ in range(steps):
                advance_body(row, row[SAMPLE_PERIOD] / steps, accuracy, actions, None)
        else:
            steps, here = _recorded_steps(row, k, accuracy, record)
            for _ in range(steps):
                advance_body(row, row[SAMPLE_PERIOD] / steps, accuracy, actions, here)
        _average_motion(row, v_x, v_y, yaw_rate)
        read_imu(row, stretch.noise[n, k, 0:3])
        read_encoders(row, stretch.noise[n, k, 3:5], row[SAMPLE_PERIOD])
        read_pose(row, stretch.noise[n, k, 5:8])
        apply_effects(POINT_READINGS, row, actions)
        for j in range(8):
            stretch.readings[n, k, j] = row[READING + j]
        for j in range(stretch.recorded.shape[0]):
            stretch.record[n, k, j] = row[stretch.recorded[j]]


@kernel()
def advance_rows(
    rows: Array, ends: Integers, part: int, turn: int, claims: Integers, finished: Integers,
    stretch: Bundle, grids: Bundle, actions: Bundle, numerics: Bundle, record: Bundle,
) -> None:  # fmt: skip
    """Advance by the samples of ``stretch`` all rows that no other thread has claimed, those of one part first.

    A thread goes up its own part, which its processor has in its cache from the step before, and then down the others'.
    One that is late, after all of its turn has been done, changes nothing.

    Args:
        rows: (N, layout.SIZE), updated.
        ends: (P + 1,) first row of each part, and N.
        part: of this thread, from 0 to P - 1.
        turn: number of this call, the same for all threads and higher than before.
        claims: (N,) turn in which some thread has last taken the row; shared by the threads.
        finished: (1,) rows that have been advanced, counted from the first turn on; shared by the threads.
        stretch: fields of :class:`Stretch`.
        grids: fields of :class:`SoilGrids`.
        actions: fields of :class:`EffectActions` on N environments.
        numerics: fields of :class:`StepNumerics`.
        record: fields of :class:`ForceRecord` on N environments.
    """
    parts, accuracy = ends.size - 1, named_numerics(numerics)
    rows, stretch, grids, actions = borrowed(rows), borrowed(stretch), borrowed(grids), borrowed(actions)
    record = borrowed(record)
    for shift in range(parts):
        p = (part + shift) % parts
        for i in range(ends[p + 1] - ends[p]):
            n = ends[p] + i if shift == 0 else ends[p + 1] - 1 - i
            if claim(claims, n, turn):
                own = actions_on(EffectActions(*actions), n)
                kept = record_of(ForceRecord(*record), n)
                _advance_row(rows[n], n, Stretch(*stretch), SoilGrids(*grids), own, accuracy, kept)
                count_up(finished)


@kernel()
def wait_until_finished(finished: Integers, count: int, looks: int) -> bool:
    """Whether the other threads' last rows, too, are finished, before one has looked so many times.

    Looking costs this thread's time; being woken up would cost more than another thread takes for its last row.
    """
    look = 0
    while look < looks and count_of(finished) < count:
        look += 1
    return look < looks
