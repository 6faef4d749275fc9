"""Integrate one drive: body, wheel banks, sinkage of each wheel.

Linearly implicit Euler with the 5 x 5 derivative of the soil and motor forces in (v_x, v_y, yaw rate, omega_right,
omega_left), by differences wheel by wheel; sinkage, loads and the drives' memories advance explicitly. Unlike the
quasi-static sinkage of the package (theory: wheel model, section 5) a wheel sinks at the rate (load -
support)/soil_damping, and loads follow the specific force with a lag and the frame's twist.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .externals import external_wrench, start_memory
from .ground import RUT_CELLS, local_factors, relief, rut_share
from .jit import kernel
from .mechanics import (
    add_derivative,
    gravity_in_plane,
    local_soil,
    passive_pressure,
    solve_in_place,
    wheel_loads,
    wheel_wrench,
)
from .motors import motor_step
from .plant import Plant, settled
from .terrain_memory import FLOOR, HEIGHT_GRID, WALL_LEFT, WALL_RIGHT, new_grid, press
from .wheel import NODES, PROFILE_FIELDS, lay_profile, travel_direction, wheel_slip

SAMPLE_PERIOD = 0.02
"""[s]"""
SUBSTEPS = 8
"""Integration steps per sample."""
SETTLING = 100
"""Samples at rest before the recording, in which sinkage and loads find their balance."""
DIRECTION_BLEND = 0.005
"""Speed over which the contact turns from forward to backward [m/s]."""
PACKED_STRENGTH = 0.3
"""Gain of strength per gain of stiffness of rolled soil [-]."""
LOOSENED_LENGTH = 0.3
"""Distance over which dug-out soil or a berm is left behind [m]."""

TRUTH = (
    *("x", "y", "yaw", "v_x", "v_y", "yaw_rate", "omega_right", "omega_left", "angle_right", "angle_left"),
    *("force_x", "force_y", "yaw_acceleration", "torque_right", "torque_left"),
    *("sinkage_1", "sinkage_2", "sinkage_3", "sinkage_4", "slip_1", "slip_2", "slip_3", "slip_4"),
)
"""Columns of the truth. Pose and velocity are the body origin's; ``yaw_rate``, ``yaw_acceleration`` and ``force_*``,
the specific force at the centre of mass, are means over the sample just ended."""


class State(NamedTuple):
    """Arrays that a step changes."""

    pose: np.ndarray  # x, y, yaw of the centre of mass
    velocity: np.ndarray  # v_x, v_y, yaw rate, omega right, left
    drives: np.ndarray  # (2, 5): first filter, reference, error integral, torque, slow torque
    angles: np.ndarray  # bank angles (2,)
    specific: np.ndarray  # lagged specific force (2,)
    sinkage: np.ndarray  # (4,)
    heights: np.ndarray  # of the wheels' lowest points (4,)
    slips: np.ndarray  # (4,)
    digging: np.ndarray  # (2, 4): soil dug out, berm
    factors: np.ndarray  # (4, 6): strength, stiffness, relief under each wheel, floor and walls of its rut
    memory: np.ndarray  # of the external forces
    ruts: np.ndarray  # time of the first pass per cell
    grid: np.ndarray  # of depths that wheels left
    mean: np.ndarray  # sums over the sample of specific force (2), yaw rate, yaw acceleration


class Work(NamedTuple):
    """Scratch arrays."""

    profile: np.ndarray
    base: np.ndarray
    shifted: np.ndarray
    motion: np.ndarray
    mode: np.ndarray
    arm: np.ndarray
    system: np.ndarray
    rate: np.ndarray
    loads: np.ndarray


@kernel
def _new_state(plant, start):  # type: ignore[no-untyped-def]
    pose = start.copy()
    body = plant.body
    pose[0] += body.mass_x * math.cos(pose[2]) - body.mass_y * math.sin(pose[2])
    pose[1] += body.mass_x * math.sin(pose[2]) + body.mass_y * math.cos(pose[2])
    ruts = np.full((RUT_CELLS, RUT_CELLS) if plant.ground.rut_mode == 2 else (1, 1), np.inf)
    factors = np.ones((4, 6))
    factors[:, FLOOR:] = 0.0
    memory = start_memory(plant.externals, start[0], start[1], start[2])
    return State(
        pose,
        np.zeros(5),
        np.zeros((2, 5)),
        np.zeros(2),
        np.zeros(2),
        np.full(4, 0.008),
        np.zeros(4),
        np.zeros(4),
        np.zeros((2, 4)),
        factors,
        memory,
        ruts,
        new_grid(plant.ground.rut_mode == HEIGHT_GRID),
        np.zeros(4),
    )


@kernel
def _new_work():  # type: ignore[no-untyped-def]
    return Work(
        np.zeros((PROFILE_FIELDS, NODES)),
        np.zeros(5),
        np.zeros(5),
        np.zeros(4),
        np.zeros(6),
        np.zeros(2),
        np.zeros((5, 5)),
        np.zeros(5),
        np.zeros(4),
    )


@kernel
def _set_arm(body, wheel, arm):  # type: ignore[no-untyped-def]
    """Hub position from the centre of mass."""
    arm[0] = (body.half_wheelbase if wheel < 2 else -body.half_wheelbase) - body.mass_x
    arm[1] = (body.half_track if wheel % 2 == 1 else -body.half_track) - body.mass_y


@kernel
def _packing(ground, exponent, body, state, wheel, x, y, time):  # type: ignore[no-untyped-def]
    """Relative stiffening of soil that another wheel has just rolled."""
    if ground.rut_mode == HEIGHT_GRID:
        travel = math.hypot(state.velocity[0], state.velocity[1]) * SAMPLE_PERIOD
        under, sinkage, yaw = state.factors[wheel], state.sinkage[wheel], state.pose[2]
        return press(state.grid, ground.rebound, exponent, under, sinkage, x, y, yaw, travel, time)
    if ground.rut_mode == 2:
        return ground.rut_gain * rut_share(state.ruts, x, y, state.pose[2], time)
    v_x, turn = state.velocity[0], state.velocity[2]
    trailing = wheel >= 2 if v_x >= 0.0 else wheel < 2
    if ground.rut_mode == 0 or not trailing:
        return 0.0
    swing = 2.0 * body.half_wheelbase * turn / (abs(v_x) + 0.02)
    return ground.rut_gain * math.exp(-((swing / 0.35) ** 2)) * min(abs(v_x) / 0.02, 1.0)


@kernel
def read_ground(plant, state, arm, time):  # type: ignore[no-untyped-def]
    """Soil factors and relief under each wheel, once per sample."""
    ground = plant.ground
    cosine, sine = math.cos(state.pose[2]), math.sin(state.pose[2])
    for i in range(4):
        _set_arm(plant.body, i, arm)
        x = state.pose[0] + cosine * arm[0] - sine * arm[1]
        y = state.pose[1] + sine * arm[0] + cosine * arm[1]
        strength, stiffness = local_factors(ground, i, x, y, time)
        packed = _packing(ground, plant.soil.exponent, plant.body, state, i, x, y, time)
        state.factors[i, 0] = strength * (1.0 + PACKED_STRENGTH * packed)
        state.factors[i, 1] = stiffness * (1.0 + packed)
        state.factors[i, 2] = relief(ground, x, y)


@kernel
def _digging(ground, state, wheel, v_x, v_y, spin, radius, dt):  # type: ignore[no-untyped-def]
    """Advance the soil dug out by slip and the berm beside a wheel; return (stiffness factor, side factor)."""
    travel = max(abs(v_x), abs(radius * spin))
    left = 1.0 / (1.0 + dt * travel / LOOSENED_LENGTH)
    state.digging[0, wheel] = (state.digging[0, wheel] + dt * abs(radius * spin - v_x) / LOOSENED_LENGTH) * left
    state.digging[1, wheel] = (state.digging[1, wheel] + dt * abs(v_y) / LOOSENED_LENGTH) * left
    loose = state.digging[0, wheel] if ground.sinkage_mode == 2 else abs(state.slips[wheel])
    soften = 1.0 if ground.sinkage_mode == 0 else 1.0 / math.sqrt(1.0 + ground.sinkage_gain * loose)
    side = 0.0 if ground.bulldozing_mode == 0 else ground.bulldozing_gain
    if ground.bulldozing_mode == 2:
        side *= 3.0 * state.digging[1, wheel]
    return soften, side


@kernel
def wheel_step(plant, state, work, wheel, aging, dt):  # type: ignore[no-untyped-def]
    """Add one wheel's forces to ``work.rate``, its derivative to ``work.system``; advance its sinkage."""
    wheels, ground, motion, mode, arm = plant.wheels, plant.ground, work.motion, work.mode, work.arm
    bank = wheel % 2
    _set_arm(plant.body, wheel, arm)
    motion[0] = state.velocity[0] - state.velocity[2] * arm[1]
    motion[1] = state.velocity[1] + state.velocity[2] * arm[0]
    motion[2], motion[3] = state.velocity[2], state.velocity[3 + bank]
    radius = wheels.minor_radius + wheels.major_radius[wheel]
    spin = motion[0] / radius if wheels.free[wheel] > 0.5 else motion[3]
    state.slips[wheel] = wheel_slip(motion[0], spin, radius)
    soften, side = _digging(ground, state, wheel, motion[0], motion[1], spin, radius, dt)
    soil = local_soil(plant.soil, state.factors[wheel, 0] * aging, state.factors[wheel, 1] * soften)
    direction = travel_direction(motion[0], spin, radius, DIRECTION_BLEND)
    sign = 1.0 if direction >= 0.0 else -1.0
    shape = (wheels.minor_radius, wheels.half_width, wheels.major_radius[wheel])
    speed = math.hypot(motion[0], motion[1])
    forward, support = lay_profile(
        soil, shape, state.sinkage[wheel], sign * state.slips[wheel], direction, speed, work.profile
    )
    mode[0], mode[1], mode[2], mode[3] = direction, radius, wheels.toe[wheel], wheels.free[wheel]
    contact = 2.0 * math.sqrt(2.0 * radius * state.sinkage[wheel])
    mode[4] = side * passive_pressure(soil, state.sinkage[wheel], contact) if side > 0.0 else 0.0
    if ground.rut_mode == HEIGHT_GRID:
        wall = state.factors[wheel, WALL_LEFT if motion[1] > 0.0 else WALL_RIGHT]
        mode[4] += passive_pressure(soil, wall, contact)
    mode[5] = ground.lateral * (1.0 - ground.furrow * math.cos(2.0 * (state.pose[2] - ground.furrow_angle)))
    wheel_wrench(soil, work.profile, mode, motion, work.base)
    add_derivative(soil, work.profile, mode, motion, work.base, arm, bank, work.shifted, work.system)
    f_x, f_y = work.base[0] + sign * forward, work.base[1]
    work.rate[0] += f_x
    work.rate[1] += f_y
    work.rate[2] += work.base[3] + arm[0] * f_y - arm[1] * f_x
    work.rate[3 + bank] -= work.base[4]
    sinking = (work.loads[wheel] - support - work.base[2]) / plant.body.soil_damping
    limit = 0.98 * wheels.minor_radius
    state.sinkage[wheel] = min(max(state.sinkage[wheel] + dt * sinking, 1e-4), limit)
    state.heights[wheel] = state.factors[wheel, 2] - state.factors[wheel, FLOOR] - state.sinkage[wheel]


@kernel
def _solve_step(plant, state, work, command, time, dt):  # type: ignore[no-untyped-def]
    """Add motors and gravity, solve for the change of velocity; return the gravity that the IMU sees (x, y)."""
    body, rate, system, velocity = plant.body, work.rate, work.system, state.velocity
    power = abs(state.drives[0, 4] * velocity[3]) + abs(state.drives[1, 4] * velocity[4])
    for bank in range(2):
        torque, slope = motor_step(plant.motors, state.drives, bank, command[bank], velocity[3 + bank], power, time, dt)
        rate[3 + bank] += torque
        system[3 + bank, 3 + bank] += slope
    seen_x, seen_y = gravity_in_plane(plant, state, state.heights)
    gravity_x, gravity_y = seen_x, seen_y
    if plant.ground.rut_mode == HEIGHT_GRID:  # deeper wheels tilt the robot, which does not climb by it
        gravity_x, gravity_y = gravity_in_plane(plant, state, state.factors[:, 2])
    inertias = (body.mass, body.mass, body.inertia, plant.motors.inertia, plant.motors.inertia)
    for i in range(5):
        rate[i] *= dt / inertias[i]
        for j in range(5):
            system[i, j] *= -dt / inertias[i]
        system[i, i] += 1.0
    rate[0] += dt * (velocity[2] * velocity[1] + gravity_x)
    rate[1] += dt * (-velocity[2] * velocity[0] + gravity_y)
    solve_in_place(system, rate)
    return seen_x, seen_y


@kernel
def substep(plant, state, work, command, time, dt):  # type: ignore[no-untyped-def]
    """Advance everything by ``dt`` [s]."""
    body, velocity = plant.body, state.velocity
    work.rate[:] = 0.0
    work.system[:] = 0.0
    wheel_loads(body, plant.wheels, state.specific, state.heights, state.angles, work.loads)
    rolling = abs(velocity[3]) + abs(velocity[4])
    aging = math.exp(plant.ground.aging / (1.0 + (rolling / 0.2) ** 2))
    for i in range(4):
        wheel_step(plant, state, work, i, aging, dt)
    for k in range(plant.externals.shape[0]):
        f_x, f_y, moment = external_wrench(
            plant.externals[k], state.memory[k], state.pose, velocity, state.specific, state.angles, time, dt
        )
        work.rate[0] += f_x
        work.rate[1] += f_y
        work.rate[2] += moment - body.mass_x * f_y + body.mass_y * f_x
    gravity_x, gravity_y = _solve_step(plant, state, work, command, time, dt)
    change = work.rate
    turn = velocity[2] + 0.5 * change[2]
    force_x = change[0] / dt - turn * (velocity[1] + 0.5 * change[1]) - gravity_x
    force_y = change[1] / dt + turn * (velocity[0] + 0.5 * change[0]) - gravity_y
    state.mean[0] += force_x
    state.mean[1] += force_y
    state.mean[2] += turn
    state.mean[3] += change[2] / dt
    state.specific[0] += dt / body.transfer_time * (force_x - state.specific[0])
    state.specific[1] += dt / body.transfer_time * (force_y - state.specific[1])
    _move(state, change, turn, dt)


@kernel
def _move(state, change, turn, dt):  # type: ignore[no-untyped-def]
    """Midpoint rule for pose and bank angles, then the new velocities."""
    velocity = state.velocity
    yaw = state.pose[2] + 0.5 * dt * turn
    v_x, v_y = velocity[0] + 0.5 * change[0], velocity[1] + 0.5 * change[1]
    state.pose[0] += dt * (math.cos(yaw) * v_x - math.sin(yaw) * v_y)
    state.pose[1] += dt * (math.sin(yaw) * v_x + math.cos(yaw) * v_y)
    state.pose[2] += dt * turn
    for bank in range(2):
        state.angles[bank] += dt * (velocity[3 + bank] + 0.5 * change[3 + bank])
    for i in range(5):
        velocity[i] += change[i]


@kernel
def _record(body, state, row):  # type: ignore[no-untyped-def]
    """Write one row of the truth; pose and velocity are moved to the body origin."""
    cosine, sine = math.cos(state.pose[2]), math.sin(state.pose[2])
    row[0] = state.pose[0] - cosine * body.mass_x + sine * body.mass_y
    row[1] = state.pose[1] - sine * body.mass_x - cosine * body.mass_y
    row[2] = state.pose[2]
    row[3] = state.velocity[0] + state.velocity[2] * body.mass_y
    row[4] = state.velocity[1] - state.velocity[2] * body.mass_x
    row[5] = state.mean[2]
    row[6:8] = state.velocity[3:5]
    row[8:10] = state.angles
    row[10:12] = state.mean[0:2]
    row[12] = state.mean[3]
    row[13:15] = state.drives[:, 3]
    row[15:19] = state.sinkage
    row[19:23] = state.slips


@kernel
def _integrate(plant, commands, start, clock, substeps, settling, truth):  # type: ignore[no-untyped-def]
    state, work = _new_state(plant, start), _new_work()
    dt = SAMPLE_PERIOD / substeps
    rest = np.zeros(2)
    for k in range(-settling, truth.shape[0]):
        if k >= 0:
            state.mean[:] = state.mean / substeps
            _record(plant.body, state, truth[k])
        state.mean[:] = 0.0
        read_ground(plant, state, work.arm, clock + k * SAMPLE_PERIOD)
        for i in range(substeps):
            step = k * substeps + i
            command = commands[step] if k >= 0 else rest
            substep(plant, state, work, command, clock + step * dt, dt)
    return truth


def drive(
    plant: Plant, commands: np.ndarray, start: np.ndarray, clock: float = 0.0, substeps: int = SUBSTEPS
) -> dict[str, np.ndarray]:
    """Integrate a drive from rest.

    Args:
        plant: robot, soil, ground, motors and external forces.
        commands: (samples * substeps, 2) bank speed commands right, left at the integration rate [rad/s].
        start: x, y [m], yaw [rad] of the body origin.
        clock: time since the case's first drive began [s].
        substeps: integration steps per sample.

    Returns:
        One array per name in ``TRUTH``, sampled every ``SAMPLE_PERIOD``; row 0 is the settled robot at rest.
    """
    samples = commands.shape[0] // substeps
    truth = np.zeros((samples, len(TRUTH)))
    _integrate(
        settled(plant),
        np.ascontiguousarray(commands, dtype=np.float64),
        np.asarray(start, dtype=np.float64).copy(),
        float(clock),
        substeps,
        SETTLING,
        truth,
    )
    return {name: truth[:, k] for k, name in enumerate(TRUTH)}
