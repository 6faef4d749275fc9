"""The filter's model of a skid-steer turn as CasADi expressions, for controllers that plan ahead.

Force law and motion are those of :mod:`ddagr_gym.estimation` (coupled law; rows (4.6), (4.7), (4.10)), written once
more because CasADi needs symbols; a test holds both together. The wheel commands enter linearly, through the lag of the
motors: the model is control-affine. Errors of position follow the commanded path:

=====  ==============  =====  ==============================================================
entry  name            unit   meaning
=====  ==============  =====  ==============================================================
0, 1   v_x, v_y        m/s    velocity of the body origin
2      yaw_rate        rad/s
3, 4   omega           rad/s  bank speeds right, left
5      lateral_error   m      distance from the path, positive to the left of its direction
6      heading_error   rad    heading less the path's
=====  ==============  =====  ==============================================================

Everything here takes an imported ``casadi`` module, so that the package does not need it.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

from ddagr_gym.extras import need
from ddagr_gym.parameters import Robot

STATE_SIZE, INPUT_SIZE, PARAMETER_SIZE = 7, 2, 7
"""Parameters: a1 [N], a2 [-], b [N/rad], Rc [N], curvature of the path [1/m], offsets of v_x and yaw rate."""

_SLIP_FLOOR = 1e-12
"""Added to the squared slip, as in the filter's force law, so that its direction has a derivative at zero slip."""
_STEPS = 2
"""Integration steps in one control period."""


@dataclass(frozen=True)
class PredictiveModel:
    """Constants of the prediction: everything but the soil.

    Attributes:
        robot: nominal robot.
        outer_radius: R0 [m].
        rest_speed: smoothing of slip near standstill [m/s], as the filter has it.
        reversal_speed: smoothing of the resistance where rolling reverses [m/s], as the filter has it.
        period: control period [s].
    """

    robot: Robot
    outer_radius: float
    rest_speed: float
    reversal_speed: float
    period: float


def import_casadi() -> Any:
    """The ``casadi`` module; InputError with the remedy where it is not installed."""
    need("casadi")
    return importlib.import_module("casadi")


def wheel_forces(ca: Any, model: PredictiveModel, v_x: Any, v_y: Any, rim: Any, soil: Any) -> tuple[Any, Any]:
    """F_x and F_y [N] of a wheel by the coupled law, see ``coupled_law`` of :mod:`ddagr_gym.estimation.force_laws`.

    Args:
        ca: the casadi module.
        model: for the smoothing speeds.
        v_x: hub velocity forward [m/s].
        v_y: hub velocity to the left [m/s].
        rim: R0 omega [m/s].
        soil: a1, a2, b, Rc.
    """
    limit, rate, stiffness, resistance = (soil[i] for i in range(4))
    inverse = 1.0 / ca.sqrt(ca.fmax(rim * rim, v_x * v_x) + model.rest_speed**2)
    slip, lateral_slip = (rim - v_x) * inverse, -v_y * inverse
    coupling = stiffness / (limit * rate)
    total = ca.sqrt(slip * slip + coupling * lateral_slip * lateral_slip + _SLIP_FLOOR)
    traction = limit * (1.0 - ca.exp(-rate * total)) / total
    travel = rim + v_x
    drag = -resistance * travel / ca.sqrt(travel * travel + model.reversal_speed**2)
    return traction * slip + drag, traction * coupling * lateral_slip


def body_acceleration(ca: Any, model: PredictiveModel, velocity: Any, omega: Any, soil: Any) -> Any:
    """d/dt of (v_x, v_y, yaw_rate) for bank speeds right, left."""
    robot = model.robot
    v_x, v_y, rate = velocity[0], velocity[1], velocity[2]
    total_x, total_y, moment = 0.0, 0.0, 0.0
    for x, y in zip(robot.wheel_x, robot.wheel_y, strict=True):
        rim = model.outer_radius * omega[0 if y < 0.0 else 1]
        f_x, f_y = wheel_forces(ca, model, v_x - rate * y, v_y + rate * x, rim, soil)
        total_x, total_y = total_x + f_x, total_y + f_y
        moment = moment + x * f_y - y * f_x
    return ca.vertcat(rate * v_y + total_x / robot.mass, -rate * v_x + total_y / robot.mass, moment / robot.yaw_inertia)


def _implicit_step(ca: Any, model: PredictiveModel, velocity: Any, omega: Any, soil: Any, step: float) -> Any:
    """Linearly implicit Euler: the body is stiff, its time constants are milliseconds."""
    start = ca.SX.sym("v", 3)
    banks, ground = ca.SX.sym("omega", 2), ca.SX.sym("soil", 4)
    rate = body_acceleration(ca, model, start, banks, ground)
    matrix = ca.SX.eye(3) - step * ca.jacobian(rate, start)
    moved = start + ca.solve(matrix, step * rate)
    return ca.Function("body", [start, banks, ground], [moved])(velocity, omega, soil)


def transition(ca: Any, model: PredictiveModel) -> Any:
    """CasADi function (state (7,), input (2,), parameters (7,)) -> state one control period later.

    The commands stay constant, the banks follow them exactly with their lag; body and position errors take two steps.
    """
    x, u, p = ca.SX.sym("x", STATE_SIZE), ca.SX.sym("u", INPUT_SIZE), ca.SX.sym("p", PARAMETER_SIZE)
    step = model.period / _STEPS
    velocity, omega, lateral, heading = x[0:3], x[3:5], x[5], x[6]
    curvature, offset_speed, offset_rate = p[4], p[5], p[6]
    decay = ca.exp(-model.robot.motor_rate * step)
    for _ in range(_STEPS):
        omega = u + (omega - u) * decay
        velocity = _implicit_step(ca, model, velocity, omega, p[0:4], step)
        speed, rate = velocity[0] + offset_speed, velocity[2] + offset_rate
        along = speed * ca.cos(heading) - velocity[1] * ca.sin(heading)
        lateral = lateral + step * (speed * ca.sin(heading) + velocity[1] * ca.cos(heading))
        heading = heading + step * (rate - curvature * along / (1.0 - curvature * lateral))
    return ca.Function("transition", [x, u, p], [ca.vertcat(velocity, omega, lateral, heading)])


def linearised_transition(ca: Any, model: PredictiveModel) -> Any:
    """CasADi function (state, input, parameters) -> next state, its Jacobian by the state, and by the input."""
    x, u, p = ca.SX.sym("x", STATE_SIZE), ca.SX.sym("u", INPUT_SIZE), ca.SX.sym("p", PARAMETER_SIZE)
    after = transition(ca, model)(x, u, p)
    return ca.Function("linearised", [x, u, p], [after, ca.jacobian(after, x), ca.jacobian(after, u)])
