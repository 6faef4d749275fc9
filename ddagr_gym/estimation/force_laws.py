"""Forces of the soil on one wheel as functions of slip: four parameters, closed derivatives.

======================  ======  =========================================================================
name                    thesis  meaning
======================  ======  =========================================================================
traction_limit          a1      longitudinal force at full slip [N]
traction_rate           a2      how fast slip mobilises it [-]: 1/a2 is the slip at 63 %
lateral_stiffness       b       lateral force per slip angle at small slip [N/rad]
motion_resistance       Rc      force against rolling, which the thesis's law lacks [N]
======================  ======  =========================================================================

Slip (theory: filter, eq. (1)): ``s_x = (rim - v_x)/d``, ``s_y = -v_y/d`` with ``rim = R0 omega`` and, ours near rest,
``d = sqrt(max(rim^2, v_x^2) + rest_speed^2)``. Resistance is ``-Rc t/sqrt(t^2 + reversal_speed^2)``, ``t = rim + v_x``:
soil piles up on the side to which the wheel rolls, also while its hub already moves the other way (ours: smoothed).

The laws return 16 numbers: F_x, its derivatives by v_x, v_y, rim, ln a1, ln a2, ln b, ln Rc; the same for F_y.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

from ddagr_gym.jit import kernel

_SLIP_FLOOR = 1e-12
"""Added to the squared slip so that its direction has a derivative at zero slip."""

Gradient = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float, float, float, float
]


class LawParameters(NamedTuple):
    """Parameters of a force law: its inputs besides the wheel's motion.

    Attributes:
        limit: a1 [N].
        rate: a2 [-].
        stiffness: b [N/rad].
        resistance: Rc [N].
        rest_speed: smoothing of slip near standstill [m/s].
        reversal_speed: smoothing of the resistance where rolling reverses [m/s].
    """

    limit: float
    rate: float
    stiffness: float
    resistance: float
    rest_speed: float
    reversal_speed: float


class ForceLaw(IntEnum):
    """Choice of force law.

    Attributes:
        thesis: (3.15), (3.16) with consistent signs, and resistance: see :func:`thesis_law`.
        coupled: ours; slip and slip angle share one traction: see :func:`coupled_law`.
    """

    thesis = 0
    coupled = 1


@kernel(inline=True)
def _slip(v_x: float, rim: float, rest_speed: float) -> tuple[float, float, float, float, float, float]:
    """Slip s_x, its derivatives by v_x and rim; 1/d; derivatives of ln d by v_x and rim."""
    rim_squared, speed_squared = rim * rim, v_x * v_x
    driven = rim_squared >= speed_squared
    inverse = 1.0 / math.sqrt(max(rim_squared, speed_squared) + rest_speed * rest_speed)
    divisor_v = 0.0 if driven else v_x * inverse
    divisor_rim = rim * inverse if driven else 0.0
    slip = (rim - v_x) * inverse
    slip_v = -(1.0 + slip * divisor_v) * inverse
    slip_rim = (1.0 - slip * divisor_rim) * inverse
    return slip, slip_v, slip_rim, inverse, divisor_v * inverse, divisor_rim * inverse


@kernel(inline=True)
def _resistance(v_x: float, rim: float, resistance: float, reversal_speed: float) -> tuple[float, float]:
    """Force against rolling [N] and its derivative by v_x, which is also that by rim."""
    travel = rim + v_x
    inverse = 1.0 / math.sqrt(travel * travel + reversal_speed * reversal_speed)
    direction = travel * inverse
    return -resistance * direction, -resistance * (1.0 - direction * direction) * inverse


@kernel(inline=True)
def thesis_law(v_x: float, v_y: float, rim: float, parameters: LawParameters) -> Gradient:
    """``F_x = a1 sgn(s_x) (1 - exp(-a2 |s_x|)) - resistance``, ``F_y = -b atan2(v_y, |v_x|)``.

    Thesis (3.15), (3.16) with consistent signs, plus motion resistance (theory: filter, eq. (3)).

    Args:
        v_x: hub velocity forward [m/s].
        v_y: hub velocity to the left [m/s].
        rim: R0 omega [m/s].
        parameters: of soil and wheel.
    """
    limit, rate, stiffness, resistance, rest_speed, reversal_speed = parameters
    slip, slip_v, slip_rim, _, _, _ = _slip(v_x, rim, rest_speed)
    decay = math.exp(-rate * abs(slip))
    traction = math.copysign(limit * (1.0 - decay), slip)
    slope = limit * rate * decay
    drag, drag_v = _resistance(v_x, rim, resistance, reversal_speed)
    speed = math.sqrt(v_x * v_x + rest_speed * rest_speed)
    lateral = -stiffness * math.atan2(v_y, speed)
    squared = speed * speed + v_y * v_y
    return (
        traction + drag, slope * slip_v + drag_v, 0.0, slope * slip_rim + drag_v, traction, slope * slip, 0.0, drag,
        lateral, stiffness * v_y * v_x / (speed * squared), -stiffness * speed / squared, 0.0, 0.0, 0.0, lateral, 0.0,
    )  # fmt: skip


@kernel(inline=True)
def coupled_law(v_x: float, v_y: float, rim: float, parameters: LawParameters) -> Gradient:
    """``F_x = g s_x - resistance``, ``F_y = g c s_y`` (ours; theory: filter, eq. (4)): one traction for both slips.

    ``g = a1 (1 - exp(-a2 q))/q``, ``q^2 = s_x^2 + c s_y^2``, ``c = b/(a1 a2)``: both forces derive from one
    dissipation potential of q. Without lateral slip F_x is (3.15), at small slip F_y is (3.16); a wheel that
    skids sideways has no full longitudinal force left, and the reverse. Arguments as :func:`thesis_law`.
    """
    limit, rate, stiffness, resistance, rest_speed, reversal_speed = parameters
    slip, slip_v, slip_rim, inverse, divisor_v, divisor_rim = _slip(v_x, rim, rest_speed)
    lateral_slip = -v_y * inverse
    full = limit * rate
    ratio = stiffness / full
    total_squared = slip * slip + ratio * lateral_slip * lateral_slip + _SLIP_FLOOR
    inverse_total = 1.0 / math.sqrt(total_squared)
    left = math.exp(-rate * total_squared * inverse_total)
    mobilised = full * left
    g = limit * (1.0 - left) * inverse_total
    # dg/dq over q, from which all derivatives of q follow
    g_q = (mobilised - g) * inverse_total * inverse_total
    side = ratio * lateral_slip
    g_slip, g_lateral = g_q * slip, g_q * side
    g_ratio = 0.5 * g_lateral * lateral_slip  # by ln c
    x_slip, x_lateral = g + g_slip * slip, g_lateral * slip
    y_slip, y_lateral = g_slip * side, g * ratio + g_lateral * side
    lateral_v, lateral_rim = -lateral_slip * divisor_v, -lateral_slip * divisor_rim
    drag, drag_v = _resistance(v_x, rim, resistance, reversal_speed)
    x_ratio, y_ratio = g_ratio * slip, (g + g_ratio) * side
    return (
        g * slip + drag, x_slip * slip_v + x_lateral * lateral_v + drag_v, -x_lateral * inverse,
        x_slip * slip_rim + x_lateral * lateral_rim + drag_v,
        g * slip - x_ratio, mobilised * slip - x_ratio, x_ratio, drag,
        g * side, y_slip * slip_v + y_lateral * lateral_v, -y_lateral * inverse,
        y_slip * slip_rim + y_lateral * lateral_rim,
        g * side - y_ratio, mobilised * side - y_ratio, y_ratio, 0.0,
    )  # fmt: skip


@kernel(inline=True)
def wheel_law(law: float, v_x: float, v_y: float, rim: float, parameters: LawParameters) -> Gradient:
    """The law ``law`` (a :class:`ForceLaw`); the other arguments as :func:`thesis_law`."""
    if law == 1.0:
        return coupled_law(v_x, v_y, rim, parameters)
    return thesis_law(v_x, v_y, rim, parameters)
