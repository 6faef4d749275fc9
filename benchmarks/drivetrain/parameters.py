"""The numbers of the model: what they mean, where a fit starts, and what value leaves a part out.

Torques are divided by the inertia of straight driving, that of the wheels and half of the vehicle: rad/s^2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import unknown_name

_NEVER = 1e6
"""A limit that is never reached, in any of the units below."""


@dataclass(frozen=True)
class Parameter:
    """One number of the model.

    Attributes:
        unit: SI unit.
        meaning: what it does.
        start: value from which a fit starts.
        absent: value that leaves its part out; of the wheels' share the value that it has where it is not fitted: four
            wheels of 20 kg of a Warthog of 470 kg make 0.06, gears and motors add to it, and the drives cannot tell.
        positive: whether it is fitted as a logarithm.
        used: whether the model of the study has it; the others are tried and were found wanting.
    """

    unit: str
    meaning: str
    start: float
    absent: float
    positive: bool = True
    used: bool = True


ROBOT: Mapping[str, Parameter] = {
    "delay": Parameter("s", "from the command to the first change of the drive's set point", 0.2, 0.0),
    "turning_limit": Parameter("rad/s", "largest distance of a set point from the mean of both", 9.0, _NEVER),
    "mean_ramp": Parameter("rad/s^2", "largest rate of the mean of both set points", 20.0, _NEVER),
    "turning_ramp": Parameter("rad/s^2", "largest rate of a set point's distance from that mean", 10.0, _NEVER),
    "ramp": Parameter("rad/s^2", "largest rate of each set point", 35.0, _NEVER, used=False),
    "top_speed": Parameter("rad/s", "largest set point", 13.2, _NEVER),
    "proportional": Parameter("1/s", "torque per speed error", 4.0, 0.0),
    "integral": Parameter("1/s^2", "torque per integrated speed error", 1.7, 0.0),
    "integral_limit": Parameter("rad/s^2", "largest torque of the integral part", 12.0, _NEVER, used=False),
    "power": Parameter("rad^2/s^3", "largest torque times speed of a driving bank", 160.0, _NEVER),
    "asymmetry": Parameter("-", "torque limit of the right bank above the mean, of the left below", 0.14, 0.0, False),
    "viscous": Parameter("1/s", "friction per speed", 0.38, 0.0, False),
    "wheel_share": Parameter("-", "share of the wheels and motors in the inertia", 0.1, 0.1, used=False),
    "yaw_inertia": Parameter("-", "inertia in turning over that in straight driving", 2.2, 1.0, used=False),
    "gain": Parameter("-", "set point per command", 1.0, 1.0, used=False),
    "lag": Parameter("s", "time constant of the set point", 0.1, 1e-6, used=False),
    "dead_band": Parameter("rad/s", "commands below it are zero", 0.2, 0.0, False, False),
    "slowing_ramp": Parameter("-", "rate of the set point towards zero over that away from it", 1.2, 1.0, used=False),
    "torque_limit": Parameter("rad/s^2", "largest torque", 30.0, _NEVER, used=False),
    "stall_torque": Parameter("rad/s^2", "limit at rest of one that falls with speed", 60.0, _NEVER, used=False),
    "no_load_speed": Parameter("rad/s", "where that limit is zero", 16.0, _NEVER, used=False),
    "coupling": Parameter("-", "power limit lost per power of the other bank", 0.1, 0.0, False, False),
    "start_delay": Parameter("s", "further delay of a command to a robot that stands", 0.1, 0.0, False, False),
    "averaging": Parameter("s", "time over which an encoder reading is a mean", 0.1, 0.0, used=False),
}  # fmt: skip
"""Parameters of the robot, which its drives share."""

LOAD: Mapping[str, Parameter] = {
    "turning_load": Parameter("rad/s^2", "torque on a bank of the ground that resists turning, at most", 10.0, 0.0),
    "turning_speed": Parameter("rad/s", "yaw rate, as a difference of the banks, that mobilises 71 % of it", 6.0, 1.0),
    "rolling_load": Parameter("rad/s^2", "torque on a bank of the ground that resists rolling", 0.8, 0.0),
    "traction": Parameter("rad/s^2", "torque that the ground can take from a bank, at most", 30.0, 200.0, used=False),
    "slip_speed": Parameter("rad/s", "rim speed against the ground that mobilises 71 % of it", 0.7, 0.05, used=False),
}
"""Parameters of the load, of one drive on its ground."""

ALL: Mapping[str, Parameter] = {**ROBOT, **LOAD}
NAMES = tuple(ALL)
"""Order in the vector of the kernel."""
USED = tuple(name for name in ROBOT if ROBOT[name].used)
"""Parameters of the robot in the model of the study."""
OWN = tuple(name for name in LOAD if LOAD[name].used)
"""Parameters of the load in the model of the study."""

ANTI_WINDUP = {"none": 0, "conditional": 1, "back_calculation": 2, "within_limit": 3}
"""What the integral part does at the torque limit: goes on; stops; is driven back by the excess over the limit; is
itself held within the limit."""


def parameter_vector(values: Mapping[str, float]) -> NDArray[np.float64]:
    """Vector of the kernel; parameters that are not given leave their part out.

    Raises:
        InputError: an unknown name.
    """
    for name in values:
        if name not in ALL:
            raise unknown_name("parameter of the drivetrain", name, NAMES)
    return np.array([values.get(name, parameter.absent) for name, parameter in ALL.items()])


def starting_values(names: Sequence[str]) -> dict[str, float]:
    """Values from which a fit of these parameters starts."""
    return {name: ALL[name].start for name in names}
