"""A robot as a MuJoCo model (MJCF): four driven wheels that roll at the commanded track.

Wheels that are dragged sideways do not work there: MuJoCo's contacts push apart what slides on them, in proportion to
friction times sliding speed, and a skid-steer robot with friction by direction hopped through its turns at 0.1 to
0.9 of the yaw rate. So the wheels touch the ground at the commanded track, with friction along them only, and a
further contact in the middle has the friction across: nothing slides in a turn, and its yaw rate is that of the
kinematic model.

The reference of the format is https://mujoco.readthedocs.io/en/stable/XMLreference.html.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ddagr_gym.errors import InputError
from ddagr_gym.exporting.carried_over import CarriedOver
from ddagr_gym.parameters import STANDARD_GRAVITY

WHEELS = (("front_right", 1, -1), ("front_left", 1, 1), ("rear_right", -1, -1), ("rear_left", -1, 1))
"""Name, and signs of the position forward and to the left, in the package's order."""

TIMESTEP = 0.002
"""Of the simulation [s]."""

WHEEL_MASS = 0.01
"""Of the robot, each; what a wheel spins with is the bank's inertia (ours)."""

HORIZONTAL_INERTIA = 0.6
"""Of a body about its other axes, over that about the main one; ours, neither matters on level ground."""

_CONTACT_LENGTH = 0.01  # [m], half: a short capsule is a sphere with an axis, which the friction is aligned with
_SHARE_OF_WHEELS = 0.8
"""Of the load that four of five alike contacts carry."""

_NO_FRICTION = 0.01
"""Along a direction that is to have none: less makes the solver complain (ours)."""

MIDDLE = "middle"
"""Name of the contact that holds the robot sideways."""

_STIFF_LAG = 0.02  # [s] of a speed loop that loses no speed
_COLLISIONS = 0  # contype and conaffinity: contacts are listed in pairs


@dataclass(frozen=True)
class Chassis:
    """The robot without its wheels.

    Attributes:
        mass: [kg].
        inertia: about x, y, z through its centre of mass [kg m^2].
        centre: of mass, from the middle of the hubs [m].
    """

    mass: float
    inertia: tuple[float, float, float]
    centre: tuple[float, float, float]


def chassis(found: CarriedOver, track: float) -> Chassis:
    """What is left when four wheels that hang at the hubs' height are taken off.

    Args:
        found: what carries over.
        track: at which the wheels are [m].
    """
    wheel = WHEEL_MASS * found.mass
    mass = found.mass - 4.0 * wheel
    yaw = found.yaw_inertia - wheel * (found.wheelbase**2 + track**2)
    share = found.mass / mass
    height = found.centre_of_mass_height - found.rolling_radius
    centre = (share * found.centre_of_mass_x, share * found.centre_of_mass_y, share * height)
    return Chassis(mass, (HORIZONTAL_INERTIA * yaw, HORIZONTAL_INERTIA * yaw, yaw), centre)


def check_friction(name: str, found: CarriedOver) -> None:
    """Refuse a robot for which no friction was found; InputError."""
    if not found.slides_alike:
        raise InputError(
            f"no friction makes rigid wheels turn as {name} does at this working point (effective track "
            f"{found.effective_track:.2f} m, track {found.track:.2f} m): choose another --speed, or --to randomisation."
        )


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
        model, "option", timestep=_text(TIMESTEP), integrator="implicitfast", cone="elliptic", impratio="10",
        gravity=_text(*_gravity(found)),
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
    body = chassis(found, found.commanded_track)
    SubElement(base, "inertial", pos=_text(*body.centre), mass=_text(body.mass), diaginertia=_text(*body.inertia))
    box = _text(0.5 * found.wheelbase, 0.5 * found.track - 0.6 * found.wheel_width, 0.4 * radius)
    SubElement(
        base, "geom", _untouched(), type="box", size=box, pos=_text(0.0, 0.0, 0.5 * radius), rgba="0.2 0.45 0.7 1"
    )
    tilt = _text(found.imu_pitch, found.imu_roll, found.imu_yaw)
    SubElement(base, "site", name="imu", pos=_text(found.imu_x, found.imu_y, 0.0), euler=tilt, size="0.02")
    for name, forward, left in WHEELS:
        _add_wheel(base, found, name, (0.5 * forward * found.wheelbase, 0.5 * left * found.commanded_track))
    _add_rolling(base, found, MIDDLE)


def _add_rolling(body: Element, found: CarriedOver, name: str) -> None:
    """What touches the ground."""
    half = _text(0.0, -_CONTACT_LENGTH, 0.0, 0.0, _CONTACT_LENGTH, 0.0)
    radius = _text(found.rolling_radius)
    SubElement(body, "geom", _untouched(), name=name, type="capsule", fromto=half, size=radius, rgba="0 0 0 0")


def _untouched() -> dict[str, str]:
    return {"contype": str(_COLLISIONS), "conaffinity": str(_COLLISIONS)}


def wheel_inertia(found: CarriedOver) -> float:
    """What a wheel's motor turns [kg m^2]: half a bank's inertia, or that of the wheel as a disc."""
    disc = 0.5 * WHEEL_MASS * found.mass * found.rolling_radius**2
    return max(0.5 * found.bank_inertia, disc)


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
    _add_rolling(body, found, name)
    inward = math.copysign(0.5 * (found.commanded_track - found.track), -place[1])
    drawn = _text(0.0, inward - 0.5 * found.wheel_width, 0.0, 0.0, inward + 0.5 * found.wheel_width, 0.0)
    SubElement(body, "geom", _untouched(), type="cylinder", fromto=drawn, size=_text(radius), rgba="0.15 0.15 0.15 1")


def _add_contacts(model: Element, found: CarriedOver) -> None:
    """Friction across first: a capsule's contact has its axis as the first tangent."""
    contact = SubElement(model, "contact")
    along = _text(_NO_FRICTION, found.friction_along / _SHARE_OF_WHEELS, 0.0, 0.0, 0.0)
    across = _text(found.friction_across / (1.0 - _SHARE_OF_WHEELS), _NO_FRICTION, 0.0, 0.0, 0.0)
    for name, friction in (*((name, along) for name, _, _ in WHEELS), (MIDDLE, across)):
        SubElement(contact, "pair", name=name, geom1="ground", geom2=name, condim="3", friction=friction)


def loop_gain(found: CarriedOver) -> float:
    """Torque of a wheel's motor per speed error [N m s/rad]."""
    if found.speed_loss > 0.0:
        return 0.5 / found.speed_loss
    return moved_inertia(found) / _STIFF_LAG


def moved_inertia(found: CarriedOver) -> float:
    """What a wheel's motor accelerates straight ahead [kg m^2]: its wheel and a quarter of the robot."""
    return wheel_inertia(found) + 0.25 * found.mass * found.rolling_radius**2


def filter_time(found: CarriedOver) -> float:
    """Time constant of the filter before the speed loop [s], which makes up the lag together with it."""
    return max(found.time_constant - moved_inertia(found) / loop_gain(found), TIMESTEP)


def _add_actuators(model: Element, found: CarriedOver) -> None:
    """One motor with a speed loop a wheel; both wheels of a bank take the same command."""
    actuator = SubElement(model, "actuator")
    gain = loop_gain(found)
    samples = max(math.ceil(found.command_delay / TIMESTEP), 1)
    delay = {"delay": _text(found.command_delay), "nsample": str(samples)} if found.command_delay > TIMESTEP else {}
    torque = found.acceleration_limit * wheel_inertia(found)
    force = {"forcerange": _text(-torque, torque)} if found.bank_inertia > 0.0 and math.isfinite(torque) else {}
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
