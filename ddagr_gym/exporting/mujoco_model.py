"""A robot as a MuJoCo model (MJCF): four driven wheels that slide, with friction along and across them.

Two properties of MuJoCo's contacts matter for a skid-steer robot, whose wheels always slide sideways in a turn:

- A contact pushes apart what slides on it, by ``friction * b_t v_t / k`` for a sliding speed ``v_t``, the damping
  ``b_t`` of its friction and the stiffness ``k`` of its normal. With the defaults that is more than the wheels sink
  in, so the robot hops. Here the normal is a soft spring, and the lift a small part of the sinkage.
- Friction belongs to the axes of the contact's frame, which for a sphere or a cylinder are the world's. A capsule's
  contact has the capsule's axis as its first tangent, which stays when the wheel spins.

The reference of the format is https://mujoco.readthedocs.io/en/stable/XMLreference.html, that of the contacts
https://mujoco.readthedocs.io/en/stable/modeling.html#solver-parameters.
"""

from __future__ import annotations

import math
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ddagr_gym.exporting.carried_over import CarriedOver
from ddagr_gym.exporting.chassis import HORIZONTAL_INERTIA, WHEEL_MASS, WHEELS, chassis, check_friction
from ddagr_gym.parameters import STANDARD_GRAVITY

TIMESTEP = 0.002
"""Of the simulation [s]."""

_CONTACT_LENGTH = 0.01
"""Half length of the capsules that touch the ground, over the radius: a sphere that has an axis."""

_SINKAGE = 0.02
"""Over the radius, by which the stiffness is set; wheels of two contacts each sink in about a quarter of it (ours)."""

_IMPEDANCE = 0.01
"""Of a contact's normal: close to none it is a spring with a damper (ours)."""

_STICKING = 0.02
"""Time in which a sliding that friction can hold ends [s] (ours)."""

_IMPEDANCE_RATIO = 1e4
"""Of friction over normal: wheels on a slope creep by less than a millimetre a second (ours)."""

_STIFF_LAG = 1e-4
"""Shortest time in which a speed loop moves a quarter of the robot [s]: the ground hardly slows it down (ours)."""


def mujoco_model(name: str, found: CarriedOver) -> str:
    """Text of the model.

    Args:
        name: of the robot.
        found: what carries over.

    Raises:
        InputError: no friction with which rigid wheels turn as fast.
    """
    check_friction(name, found)
    model = Element("mujoco", model=name)
    SubElement(model, "compiler", angle="radian", eulerseq="yxz", autolimits="true", inertiafromgeom="false")
    SubElement(
        model, "option", timestep=_text(TIMESTEP), integrator="implicitfast", cone="elliptic",
        impratio=_text(_IMPEDANCE_RATIO), gravity=_text(*_gravity(found)),
    )  # fmt: skip
    _add_numbers(model, found)
    world = SubElement(model, "worldbody")
    SubElement(world, "light", pos="0 0 6", dir="0 0 -1")
    SubElement(world, "geom", name="ground", type="plane", size="100 100 1", rgba="0.75 0.7 0.6 1")
    _add_robot(world, found)
    _add_contacts(model, found)
    _add_actuators(model, found)
    _add_sensors(model, found)
    ElementTree.indent(model)
    return ElementTree.tostring(model, encoding="unicode") + "\n"


def _text(*numbers: float) -> str:
    return " ".join(f"{number:.8g}" for number in numbers)


def _gravity(found: CarriedOver) -> tuple[float, float, float]:
    """Gravity in a world whose plane is the sloping ground."""
    along = STANDARD_GRAVITY * math.sin(found.slope_angle)
    east, north = math.cos(found.slope_direction), math.sin(found.slope_direction)
    return -along * east, -along * north, -STANDARD_GRAVITY * math.cos(found.slope_angle)


def _add_numbers(model: Element, found: CarriedOver) -> None:
    """Sensor faults that the format has no place for, for whoever reads the sensors."""
    custom = SubElement(model, "custom")
    for name in (
        "gyro_scale", "gyro_bias", "accelerometer_bias_x", "accelerometer_bias_y",
        "encoder_scale_right", "encoder_scale_left", "pose_latency",
    ):  # fmt: skip
        SubElement(custom, "numeric", name=name, data=_text(getattr(found, name)))


def _add_robot(world: Element, found: CarriedOver) -> None:
    radius = found.rolling_radius
    base = SubElement(world, "body", name="base", pos=_text(0.0, 0.0, radius))
    SubElement(base, "freejoint", name="base")
    body = chassis(found)
    SubElement(base, "inertial", pos=_text(*body.centre), mass=_text(body.mass), diaginertia=_text(*body.inertia))
    box = _text(0.5 * found.wheelbase, 0.5 * found.track - 0.6 * found.wheel_width, 0.4 * radius)
    SubElement(
        base, "geom", _untouched(), type="box", size=box, pos=_text(0.0, 0.0, 0.5 * radius), rgba="0.2 0.45 0.7 1"
    )
    tilt = _text(found.imu_pitch, found.imu_roll, found.imu_yaw)
    SubElement(base, "site", name="imu", pos=_text(found.imu_x, found.imu_y, 0.0), euler=tilt, size="0.02")
    for name, forward, left in WHEELS:
        _add_wheel(base, found, name, (0.5 * forward * found.wheelbase, 0.5 * left * found.track))


def _untouched() -> dict[str, str]:
    """Contacts are listed in pairs."""
    return {"contype": "0", "conaffinity": "0"}


def wheel_inertia(found: CarriedOver) -> float:
    """What a wheel's motor turns [kg m^2]: half a bank's inertia, or that of the wheel as a disc.

    At least what its loop brakes in two time steps: MuJoCo finds the contacts' forces as if the motors' torques stayed
    the same in a step, and friction would follow the torque instead of the sliding.
    """
    disc = 0.5 * WHEEL_MASS * found.mass * found.rolling_radius**2
    return max(0.5 * found.bank_inertia, disc, 2.0 * TIMESTEP * loop_gain(found))


def _add_wheel(base: Element, found: CarriedOver, name: str, place: tuple[float, float]) -> None:
    radius, mass = found.rolling_radius, WHEEL_MASS * found.mass
    disc = 0.5 * mass * radius**2
    body = SubElement(base, "body", name=name, pos=_text(*place, 0.0))
    armature = _text(max(wheel_inertia(found) - disc, 0.0))
    SubElement(body, "joint", name=name, type="hinge", axis="0 1 0", armature=armature)
    SubElement(
        body,
        "inertial",
        pos="0 0 0",
        mass=_text(mass),
        diaginertia=_text(HORIZONTAL_INERTIA * disc, disc, HORIZONTAL_INERTIA * disc),
    )
    for kind, half, looks in (
        ("capsule", _CONTACT_LENGTH * radius, {"name": name, "rgba": "0 0 0 0"}),
        ("cylinder", 0.5 * found.wheel_width, {"rgba": "0.15 0.15 0.15 1"}),
    ):
        ends = _text(0.0, -half, 0.0, 0.0, half, 0.0)
        SubElement(body, "geom", _untouched() | looks, type=kind, fromto=ends, size=_text(radius))


def _add_contacts(model: Element, found: CarriedOver) -> None:
    """Soft contacts with friction across the wheel first, which is along the axis of its capsule."""
    contact = SubElement(model, "contact")
    stiffness = (1.0 - _IMPEDANCE) * STANDARD_GRAVITY / (_SINKAGE * found.rolling_radius)
    normal = _text(-stiffness, -2.0 * math.sqrt(stiffness))
    tangents = _text(-1.0, -_IMPEDANCE / _STICKING)
    impedance = _text(_IMPEDANCE, _IMPEDANCE, 1.0, 0.5, 1.0)
    friction = _text(found.friction_across, found.friction_along, 0.0, 0.0, 0.0)
    for name, _, _ in WHEELS:
        SubElement(
            contact, "pair", name=name, geom1="ground", geom2=name, condim="3", friction=friction,
            solref=normal, solreffriction=tangents, solimp=impedance,
        )  # fmt: skip


def loop_gain(found: CarriedOver) -> float:
    """Torque of a wheel's motor per speed error [N m s/rad]."""
    stiffest = _inertia_of_quarter(found) / _STIFF_LAG
    return min(0.5 / found.speed_loss, stiffest) if found.speed_loss > 0.0 else stiffest


def _inertia_of_quarter(found: CarriedOver) -> float:
    """What a wheel moves of the robot straight ahead [kg m^2]."""
    return 0.25 * found.mass * found.rolling_radius**2


def filter_time(found: CarriedOver) -> float:
    """Time constant of the filter before the speed loop [s], which makes up the lag together with it."""
    moved = wheel_inertia(found) + _inertia_of_quarter(found)
    return max(found.time_constant - moved / loop_gain(found), TIMESTEP)


def _add_actuators(model: Element, found: CarriedOver) -> None:
    """One motor with a speed loop a wheel; both wheels of a bank take the same command."""
    actuator = SubElement(model, "actuator")
    gain = loop_gain(found)
    samples = max(math.ceil(found.command_delay / TIMESTEP), 1)
    delay = {"delay": _text(found.command_delay), "nsample": str(samples)} if found.command_delay > TIMESTEP else {}
    torque = min(found.acceleration_limit * wheel_inertia(found), 0.5 * found.torque_limit)
    force = {"forcerange": _text(-torque, torque)} if math.isfinite(torque) else {}
    for name, _, left in WHEELS:
        scale = found.command_gain_left if left > 0 else found.command_gain_right
        SubElement(
            actuator, "general", force | delay, name=name, joint=name, dyntype="filterexact",
            dynprm=_text(filter_time(found)),
            gainprm=_text(gain * scale), biastype="affine", biasprm=_text(0.0, 0.0, -gain),
            ctrlrange=_text(-found.speed_limit, found.speed_limit),
        )  # fmt: skip


def _add_sensors(model: Element, found: CarriedOver) -> None:
    sensor = SubElement(model, "sensor")
    SubElement(sensor, "gyro", name="gyro", site="imu", noise=_text(found.gyro_noise))
    SubElement(sensor, "accelerometer", name="accelerometer", site="imu", noise=_text(found.accelerometer_noise))
    for name, _, _ in WHEELS:
        SubElement(sensor, "jointvel", name=f"speed_{name}", joint=name)
