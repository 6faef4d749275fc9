"""Parts of a drivetrain that can stand for one another, and where fits begin in which one does what another did.

A dead time, ramps, a filter of the commands and slow motors all make the wheels late: a fit has a minimum for each,
and does not get from one to the other by itself. An integral part undoes what friction does: a fit gets from both to
neither only where friction goes together with the share that undoes it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ddagr_gym.calibration.joint_fit import Standing
from ddagr_gym.calibration.parts import FILTER_DEVIATION, FIRST_SHARE
from ddagr_gym.parameters import Robot

DELAY, RAMP, FILTER, SPEED_LOOP = "command_delay", "command_ramp", "command_filter", "speed_loop"
MEAN_RAMP, TURNING_RAMP, FRICTION, INTEGRAL = "mean_ramp", "turning_ramp", "friction", "integral"
"""Names of these parts."""

TRIED_DELAY = 0.3
"""From which the fit with a dead time in place of the others starts [s]: of a Husky and a Warthog (0.2 to 0.43 s)."""

MOTORS, INTEGRAL_RATE, VISCOUS_RATE = "motor_rate", "integral_rate", "viscous_rate"
"""Parameters of the speed loop, its integral part and friction."""


def other_starts(
    part: str, standing: Standing, robot: Robot, left_out: frozenset[str]
) -> Iterator[tuple[str, Standing]]:
    """Where else a fit without a part may begin, with a text that tells the starts apart.

    Args:
        part: to be without.
        standing: of the fit with it.
        robot: of the model.
        left_out: names of parts that are out already.
    """
    if part == FILTER and SPEED_LOOP not in left_out and has_slow_motors(standing):
        yield ", slower motors", with_slow_motors(standing, robot)
    undone = INTEGRAL not in left_out and INTEGRAL_RATE in standing.values
    if part == FRICTION and undone and standing.values.get(VISCOUS_RATE, 0.0) > 0.0:
        yield ", less integral", with_integral_less_friction(standing, robot)
    if part in (RAMP, FILTER) and DELAY not in left_out and standing.values.get(DELAY, 0.0) < TRIED_DELAY:
        yield f", dead time from {TRIED_DELAY:g}", with_late_commands(standing)


def with_late_commands(standing: Standing) -> Standing:
    """Where a fit stands, but for a longer dead time."""
    return replace(standing, values={**standing.values, DELAY: TRIED_DELAY})


def has_slow_motors(standing: Standing) -> bool:
    """Whether a fit has what :func:`with_slow_motors` moves: data sheets may be sure of their motors."""
    return {FILTER, MOTORS} <= standing.values.keys()


def with_slow_motors(standing: Standing, robot: Robot) -> Standing:
    """Where a fit stands, but for motors as slow as its filter and its motors are together, and hardly a filter.

    Two first-order lags in series delay a slow command by the sum of their time constants.

    Args:
        standing: of a fit with a filter; its motor rate is the logarithm of a factor on that of the robot.
        robot: of the model.
    """
    lag = np.exp(-standing.values[MOTORS]) + standing.values[FILTER] * robot.motor_rate
    slow = {MOTORS: -float(np.log(lag)), FILTER: FIRST_SHARE * FILTER_DEVIATION}
    return replace(standing, values={**standing.values, **slow})


def with_integral_less_friction(standing: Standing, robot: Robot) -> Standing:
    """Where a fit stands, but for an integral part without its share that undoes friction.

    Where k_i = k c_v nothing tells both from a loop with neither (docs/theory/drivetrain.md, eq. (5a)), and a fit finds
    no way there with one of them alone.

    Args:
        standing: of a fit with both; its motor rate is the logarithm of a factor on that of the robot, which holds
            where there is none.
        robot: of the model.
    """
    rate = robot.motor_rate * float(np.exp(standing.values.get(MOTORS, 0.0)))
    integral = standing.values[INTEGRAL_RATE] - rate * standing.values[VISCOUS_RATE]
    return replace(standing, values={**standing.values, INTEGRAL_RATE: integral})
