"""One sensor sample of the simulator, compiled: the only place where the order of things is set.

    commands -> motors -> loads -> soil -> body (forces inside) -> readings

Environments are rows of a matrix and independent of each other; see :mod:`ddagr_gym.physics.layout`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel
from ddagr_gym.physics.body_dynamics import evaluate_forces, place_wheels, restore_body
from ddagr_gym.physics.callbacks import apply_effects
from ddagr_gym.physics.integrators import advance_body
from ddagr_gym.physics.layout import (
    BASE_MOTOR_RATE,
    COMMAND,
    DERIVATIVE_VALID,
    GRAVITY,
    MAXIMUM_WHEEL_SPEED,
    MEAN_SPECIFIC_FORCE,
    MEAN_YAW_ACCELERATION,
    MOTOR_RATE,
    MOTOR_TARGET,
    OMEGA,
    OPTION_DIVISIONS,
    OPTION_LAUNCH_CHANGE,
    OPTION_MAXIMUM_STEP,
    OPTION_REFRESH,
    OPTION_STEPS,
    POINT_COMMANDS,
    POINT_LOADS,
    POINT_MOTORS,
    POINT_READINGS,
    POINT_SOIL,
    READING,
    SAMPLE_PERIOD,
    TIME,
    V_X,
    V_Y,
    WHEEL,
    YAW_RATE,
)
from ddagr_gym.physics.terrain import sample_soil
from ddagr_gym.sensors.imu import read_imu
from ddagr_gym.sensors.pose_receiver import read_pose
from ddagr_gym.sensors.wheel_encoder import read_encoders

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@kernel()
def _drive(row: Array, command: Array, points: Integers, addresses: Integers, parameters: Array, memory: Array) -> None:
    """Commands and motor loops for the coming sample."""
    row[COMMAND] = command[0]
    row[COMMAND + 1] = command[1]
    apply_effects(POINT_COMMANDS, row, points, addresses, parameters, memory)
    for bank in range(2):
        limit = row[MAXIMUM_WHEEL_SPEED]
        row[COMMAND + bank] = min(max(row[COMMAND + bank], -limit), limit)
        row[MOTOR_TARGET + bank] = row[COMMAND + bank]
        row[MOTOR_RATE + bank] = row[BASE_MOTOR_RATE]
    apply_effects(POINT_MOTORS, row, points, addresses, parameters, memory)


@kernel()
def _division(row: Array, options: Array) -> int:
    """Steps for the coming sample: more while a bank's rim speed changes fast against the wheel's speed."""
    steps = max(int(options[OPTION_STEPS]), math.ceil(row[SAMPLE_PERIOD] / options[OPTION_MAXIMUM_STEP] - 1e-9))
    step = row[SAMPLE_PERIOD] / steps
    for bank in range(2):
        rim = row[WHEEL + bank] + row[WHEEL + 8 + bank]
        change = (row[MOTOR_TARGET + bank] - row[OMEGA + bank]) * (1.0 - math.exp(-row[MOTOR_RATE + bank] * step))
        speed = max(abs(rim * row[OMEGA + bank]), abs(row[V_X]))
        if abs(rim * change) > options[OPTION_LAUNCH_CHANGE] * speed and change != 0.0:
            return steps * int(options[OPTION_DIVISIONS])
    return steps


@kernel()
def _prepare_ground(
    row: Array, values: Array, geometry: Array, use_field: bool, points: Integers, addresses: Integers,
    parameters: Array, memory: Array,
) -> None:  # fmt: skip
    """Loads and soil as the effects leave them."""
    restore_body(row)
    apply_effects(POINT_LOADS, row, points, addresses, parameters, memory)
    place_wheels(row)
    sample_soil(row, values, geometry, use_field)
    apply_effects(POINT_SOIL, row, points, addresses, parameters, memory)


@kernel()
def _average_motion(row: Array, v_x: float, v_y: float, yaw_rate: float) -> None:
    """Mean specific force and yaw acceleration over the sample that began at the given motion.

    The change of velocity in body axes is that of the inertial one less the turning of the axes and gravity.
    """
    period = row[SAMPLE_PERIOD]
    turning_x = 0.5 * (yaw_rate * v_y + row[YAW_RATE] * row[V_Y])
    turning_y = 0.5 * (yaw_rate * v_x + row[YAW_RATE] * row[V_X])
    row[MEAN_SPECIFIC_FORCE] = (row[V_X] - v_x) / period - turning_x - row[GRAVITY]
    row[MEAN_SPECIFIC_FORCE + 1] = (row[V_Y] - v_y) / period + turning_y - row[GRAVITY + 1]
    row[MEAN_YAW_ACCELERATION] = (row[YAW_RATE] - yaw_rate) / period


@kernel()
def settle_rows(
    rows: Array, chosen: Integers, fields: Array, field_geometry: Array, field_index: Integers, points: Integers,
    addresses: Integers, parameters: Array, memory: Array, options: Array, section: Array, contact: Array,
    coarse: Array,
) -> None:  # fmt: skip
    """Sinkages and forces at the rows' present motion, from nothing; arguments as :func:`advance_rows`."""
    for n in chosen:
        row = rows[n]
        use_field = field_index[n] >= 0
        values = fields[max(field_index[n], 0)]
        geometry = field_geometry[max(field_index[n], 0)]
        _prepare_ground(row, values, geometry, use_field, points, addresses, parameters[n], memory[n])
        row[DERIVATIVE_VALID] = 0.0
        evaluate_forces(
            row, options[OPTION_REFRESH], options, section, contact, coarse, points, addresses, parameters[n],
            memory[n],
        )  # fmt: skip


@kernel()
def remember_rows(
    rows: Array, past: Array, points: Integers, addresses: Integers, parameters: Array, memory: Array
) -> None:
    """Let effects on commands and motors see what was commanded before the rows' present motion, which stays.

    Args:
        rows: (N, layout.SIZE).
        past: (N, H, 2) commands of the samples before, the latest last; NaN where unknown.
        points: see :func:`advance_rows`, and the others.
        addresses: see there.
        parameters: see there.
        memory: see there.
    """
    count = past.shape[1]
    for n in range(rows.shape[0]):
        row, now = rows[n], rows[n, TIME]
        for k in range(count):
            if math.isnan(past[n, k, 0]):
                continue
            row[TIME] = now - (count - k) * row[SAMPLE_PERIOD]
            _drive(row, past[n, k], points, addresses, parameters[n], memory[n])
        row[TIME] = now


@kernel()
def advance_rows(
    rows: Array, first: int, last: int, commands: Array, noise: Array, fields: Array, field_geometry: Array,
    field_index: Integers, points: Integers, addresses: Integers, parameters: Array, memory: Array, options: Array,
    section: Array, contact: Array, coarse: Array, readings: Array, recorded: Integers, record: Array,
) -> None:  # fmt: skip
    """Advance rows ``first`` to ``last`` (exclusive) by the samples in ``readings``.

    Args:
        rows: (N, layout.SIZE), updated.
        first: first row.
        last: one past the last row.
        commands: (N, samples or 1, 2) bank speed commands; one is held over all samples.
        noise: (N, samples, NOISE_CHANNELS) standard normal draws.
        fields: (fields or 1, nx, ny, 9) soil grids.
        field_geometry: (fields or 1, 4).
        field_index: (N,) grid of each row, -1 for its base soils.
        points: (effects,).
        addresses: (effects,).
        parameters: (N, effects, EFFECT_PARAMETERS).
        memory: (N, effects, EFFECT_MEMORY), updated.
        options: numerics in the order of ``layout.OPTION_*``.
        section: section rule.
        contact: contact rule.
        coarse: contact rule of the derivative.
        readings: (N, samples, 8), written.
        recorded: (K,) row entries to record.
        record: (N, samples, K), written.
    """
    samples = readings.shape[1]
    held = commands.shape[1] == 1
    for n in range(first, last):
        row, own_parameters, own_memory = rows[n], parameters[n], memory[n]
        use_field = field_index[n] >= 0
        values = fields[max(field_index[n], 0)]
        geometry = field_geometry[max(field_index[n], 0)]
        for k in range(samples):
            _drive(row, commands[n, 0 if held else k], points, addresses, own_parameters, own_memory)
            _prepare_ground(row, values, geometry, use_field, points, addresses, own_parameters, own_memory)
            v_x, v_y, yaw_rate = row[V_X], row[V_Y], row[YAW_RATE]
            steps = _division(row, options)
            for _ in range(steps):
                advance_body(
                    row, row[SAMPLE_PERIOD] / steps, options, section, contact, coarse, points, addresses,
                    own_parameters, own_memory,
                )  # fmt: skip
            _average_motion(row, v_x, v_y, yaw_rate)
            read_imu(row, noise[n, k, 0:3])
            read_encoders(row, noise[n, k, 3:5], row[SAMPLE_PERIOD])
            read_pose(row, noise[n, k, 5:8])
            apply_effects(POINT_READINGS, row, points, addresses, own_parameters, own_memory)
            for j in range(8):
                readings[n, k, j] = row[READING + j]
            for j in range(recorded.shape[0]):
                record[n, k, j] = row[recorded[j]]
