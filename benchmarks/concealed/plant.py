"""The robot and its drives as plain numbers, and the whole plant that a drive is integrated with.

Sources: thesis Table 6.1 (mass, inertia, W, L), theory: wheel model, sections 1 and 6 (torus wheels, k_omega).
The speed loop, the frame's compliance and the height of the centre of mass are assumptions of this benchmark.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .externals import NO_EXTERNALS
from .ground import Ground
from .soil import Soil

GRAVITY = 9.80665
"""Standard gravity [m/s^2]."""


class Body(NamedTuple):
    """Rigid body on a slightly flexible frame; positions from the centre of the four wheels."""

    mass: float = 168.0  # [kg]
    inertia: float = 100.0  # about the vertical through the centre of mass [kg m^2]
    half_wheelbase: float = 0.33  # L [m]
    half_track: float = 0.58  # W [m]
    mass_x: float = 0.0  # centre of mass, forward [m]
    mass_y: float = 0.0  # to the left [m]
    mass_height: float = 0.42  # above the ground [m]
    transfer_time: float = 0.12  # of load transfer through tyres and frame [s]
    torsion: float = 12000.0  # load per metre of frame twist on each wheel [N/m]
    soil_damping: float = 8000.0  # of the sinkage's relaxation [N s/m]


class Wheels(NamedTuple):
    """Wheels 1 front right, 2 front left, 3 rear right, 4 rear left."""

    minor_radius: float = 0.05  # [m]
    half_width: float = 0.1016  # [m]
    major_radius: np.ndarray = np.full(4, 0.2294)  # [m]
    toe: np.ndarray = np.zeros(4)  # yaw of the wheel's plane [rad]
    free: np.ndarray = np.zeros(4)  # 1 where the wheel is not driven
    bounce: np.ndarray = np.zeros(4)  # relative change of load once per turn [-]


class Motors(NamedTuple):
    """Speed loop of each bank: reference filter, then a PI on torque with the reference's acceleration fed forward."""

    rate_up: float = 4.5  # reference filter while speeding up, k_omega [1/s]
    rate_down: float = 4.5  # and while slowing down [1/s]
    second_lag: float = 0.0  # time constant of a second pole [s]
    inertia: float = 4.0  # of a bank at the wheel, gear included [kg m^2]
    carried_inertia: float = 6.6  # half the robot's mass at the wheel's radius, as the loop was tuned for [kg m^2]
    bandwidth: float = 25.0  # of the PI loop [rad/s]
    damping: float = 0.9  # of the PI loop [-]
    torque_limit: float = 300.0  # per bank [N m]
    speed_limit: float = 10.0  # of the reference [rad/s]
    load_line: float = 0.0  # fall of the speed limit with torque [rad/s per N m]
    droop: float = 0.0  # static speed loss per torque [rad/s per N m]
    sag: float = 0.0  # relative speed loss of both banks per total power [1/W]
    fading: float = 0.0  # relative loss of rate and torque per second of operation [1/s]
    fold_back: float = 0.0  # relative fall of the torque limit per speed [s/rad]
    power_limit: float = 0.0  # of a bank that drives [W]; 0 for none
    integral_limit: float = 0.0  # of the torque of the loop's integral part [N m]; 0 for none


class Plant(NamedTuple):
    """Everything a drive needs besides commands and start."""

    body: Body
    wheels: Wheels
    soil: Soil
    ground: Ground
    motors: Motors
    externals: np.ndarray  # rows of benchmarks.concealed.externals


def nominal_plant(soil: Soil | None = None, ground: Ground | None = None) -> Plant:
    """The DDAGR on the nominal soil without spatial variation."""
    flat = Ground(strength_spread=0.0, stiffness_spread=0.0)
    return Plant(Body(), Wheels(), soil or Soil(), ground or flat, Motors(), NO_EXTERNALS)


def _settled(record: NamedTuple) -> NamedTuple:
    """The same record with the kernel's types: int stays int, other numbers float64, arrays contiguous."""
    changes = {}
    for name, value in record._asdict().items():
        declared = type(record)._field_defaults.get(name)
        if isinstance(value, np.ndarray):
            changes[name] = np.ascontiguousarray(value, dtype=np.float64)
        elif isinstance(declared, int) and not isinstance(declared, bool):
            changes[name] = int(value)
        else:
            changes[name] = float(value)
    return type(record)(**changes)


def settled(plant: Plant) -> Plant:
    """Plant with exactly the types that the kernels were compiled for."""
    parts = [_settled(part) for part in plant[:5]]
    return Plant(*parts, np.ascontiguousarray(plant.externals, dtype=np.float64))
