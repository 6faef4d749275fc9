"""Forces on the body that do not come from the soil under the wheels, one table row each.

A row is (kind, eight numbers); a row of ``memory`` (four numbers) holds what a force remembers. Kinds:

==================  =========================================================  =================================
kind                force                                                      numbers
==================  =========================================================  =================================
``DRAG``            -F V/(|V| + v_0) at a hitch moving with V                  F, hitch x, y, v_0
``VISCOUS``         -c |v|^(p-1) v per axis, -c_w w                            c_x, c_y, c_w, p
``TETHER``          -k max(0, d - d_0) towards an anchor                       anchor x, y, k, d_0
``WIND``            constant in the world, side area larger, one sine gust     F_x, F_y, gust share, period, area ratio
``LUGS``            A sin(n phi) per bank, along x                             A, n
``COULTER``         -F V_y/(|V_y| + v_0) sideways at a hitch                   F, hitch x, v_0
``SLOSH``           mass on a spring in the body frame                         mass, rate, damping ratio
``SLEDGE``          dragged mass on an elastic rope, Coulomb friction          F, rope length, stiffness, mass, hitch x
``HUB_DRAG``        -F V_x/(|V_x| + v_0) at one wheel's hub                    F, hub x, hub y, v_0
``RUTS``            F sin(2 pi s/l) across old ruts                            F, angle, l
``MUD``             -c sum over wheels of hub velocity                         c, half wheelbase, half track
==================  =========================================================  =================================
"""

from __future__ import annotations

import math

import numpy as np

from .jit import kernel

DRAG, VISCOUS, TETHER, WIND, LUGS, COULTER, SLOSH, SLEDGE, HUB_DRAG, RUTS, MUD = (float(k) for k in range(11))
COLUMNS = 9
NO_EXTERNALS = np.zeros((0, COLUMNS))


def row(kind: float, *numbers: float) -> np.ndarray:
    """One table row, (1, 9)."""
    padded = np.zeros((1, COLUMNS))
    padded[0, 0] = kind
    padded[0, 1 : 1 + len(numbers)] = numbers
    return padded


@kernel
def _world_to_body(f_x, f_y, yaw):  # type: ignore[no-untyped-def]
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return cosine * f_x + sine * f_y, -sine * f_x + cosine * f_y


@kernel
def _slosh(row, memory, specific, dt):  # type: ignore[no-untyped-def]
    """Spring and damper force of a mass that lags behind the body's specific force."""
    stiffness, damping = row[2] ** 2, 2.0 * row[3] * row[2]
    for axis in range(2):
        offset, rate = memory[axis], memory[axis + 2]
        rate = (rate - dt * (specific[axis] + stiffness * offset)) / (1.0 + dt * damping)
        memory[axis], memory[axis + 2] = offset + dt * rate, rate
    push_x = row[1] * (stiffness * memory[0] + damping * memory[2])
    push_y = row[1] * (stiffness * memory[1] + damping * memory[3])
    return push_x, push_y


@kernel
def _sledge(row, memory, x, y, yaw, dt):  # type: ignore[no-untyped-def]
    """Rope pull on the hitch (world frame); the sledge moves with Coulomb friction."""
    hitch_x, hitch_y = x + row[5] * math.cos(yaw), y + row[5] * math.sin(yaw)
    east, north = memory[0] - hitch_x, memory[1] - hitch_y
    length = math.hypot(east, north) + 1e-9
    pull = row[3] * max(0.0, length - row[2])
    f_x, f_y = pull * east / length, pull * north / length
    speed = math.hypot(memory[2], memory[3])
    friction = row[1] / (speed + 0.01) / row[4]
    memory[2] = (memory[2] - dt * f_x / row[4]) / (1.0 + dt * friction)
    memory[3] = (memory[3] - dt * f_y / row[4]) / (1.0 + dt * friction)
    memory[0] += dt * memory[2]
    memory[1] += dt * memory[3]
    return f_x, f_y


@kernel
def start_memory(externals, x, y, yaw):  # type: ignore[no-untyped-def]
    """Memory at the start; a sledge lies behind its hitch on a rope just taut."""
    memory = np.zeros((externals.shape[0], 4))
    for k in range(externals.shape[0]):
        if externals[k, 0] == SLEDGE:
            reach = externals[k, 5] - externals[k, 2]
            memory[k, 0], memory[k, 1] = x + reach * math.cos(yaw), y + reach * math.sin(yaw)
    return memory


@kernel
def _world_force(row, memory, pose, time, dt):  # type: ignore[no-untyped-def]
    """Forces given in the world frame, turned into the body frame."""
    if row[0] == TETHER:
        east, north = row[1] - pose[0], row[2] - pose[1]
        length = math.hypot(east, north) + 1e-9
        pull = row[3] * max(0.0, length - row[4]) / length
        return _world_to_body(pull * east, pull * north, pose[2])
    if row[0] == WIND:
        gust = 1.0 + row[3] * math.sin(2.0 * math.pi * time / row[4])
        f_x, f_y = _world_to_body(gust * row[1], gust * row[2], pose[2])
        return f_x, row[5] * f_y
    if row[0] == RUTS:
        across = -pose[0] * math.sin(row[2]) + pose[1] * math.cos(row[2])
        push = row[1] * math.sin(2.0 * math.pi * across / row[3])
        return _world_to_body(-push * math.sin(row[2]), push * math.cos(row[2]), pose[2])
    f_x, f_y = _sledge(row, memory, pose[0], pose[1], pose[2], dt)
    return _world_to_body(f_x, f_y, pose[2])


@kernel
def _friction_at(row, v_x, v_y, turn):  # type: ignore[no-untyped-def]
    """Coulomb friction at a point of the body: (f_x, f_y, moment)."""
    if row[0] == COULTER:
        side = v_y + turn * row[2]
        push = -row[1] * side / (abs(side) + row[3])
        return 0.0, push, row[2] * push
    along, side = v_x - turn * row[3], v_y + turn * row[2]
    if row[0] == HUB_DRAG:
        side = 0.0
    scale = -row[1] / (math.hypot(along, side) + row[4])
    return scale * along, scale * side, scale * (row[2] * side - row[3] * along)


@kernel
def external_wrench(row, memory, pose, velocity, specific, angles, time, dt):  # type: ignore[no-untyped-def]
    """(f_x, f_y [N], moment about the body origin [N m]) of one row, body frame.

    ``velocity`` is (v_x, v_y, yaw rate), ``specific`` the filtered specific force [m/s^2], ``angles`` the bank
    angles [rad].
    """
    kind = row[0]
    v_x, v_y, turn = velocity[0], velocity[1], velocity[2]
    if kind in (DRAG, COULTER, HUB_DRAG):
        return _friction_at(row, v_x, v_y, turn)
    if kind == VISCOUS:
        power = (math.hypot(v_x, v_y) + 1e-6) ** (row[4] - 1.0)
        return -row[1] * power * v_x, -row[2] * power * v_y, -row[3] * turn
    if kind == MUD:
        lever = row[2] ** 2 + row[3] ** 2
        return -4.0 * row[1] * v_x, -4.0 * row[1] * v_y, -4.0 * row[1] * lever * turn
    if kind == LUGS:
        right, left = row[1] * math.sin(row[2] * angles[0]), row[1] * math.sin(row[2] * angles[1])
        return right + left, 0.0, 0.58 * (right - left)
    if kind == SLOSH:
        f_x, f_y = _slosh(row, memory, specific, dt)
        return f_x, f_y, 0.0
    f_x, f_y = _world_force(row, memory, pose, time, dt)
    return f_x, f_y, row[5] * f_y if kind == SLEDGE else 0.0
