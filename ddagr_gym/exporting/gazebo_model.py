"""A robot as an SDFormat model for Gazebo: four wheels, their friction by direction, and a differential drive.

The reference of the format is http://sdformat.org/spec, that of the plugin https://gazebosim.org/api/sim/8
(``gz::sim::systems::DiffDrive``).
"""

from __future__ import annotations

import math
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from ddagr_gym.exporting.carried_over import CarriedOver
from ddagr_gym.exporting.chassis import HORIZONTAL_INERTIA, WHEEL_MASS, WHEELS, chassis, check_friction

NAMESPACE = "http://gazebosim.org/schema"
PLUGIN = "gz::sim::systems::DiffDrive"


def gazebo_model(name: str, found: CarriedOver) -> str:
    """Text of the model.

    Args:
        name: of the robot.
        found: what carries over.

    Raises:
        InputError: no friction with which rigid wheels turn as fast.
    """
    check_friction(name, found)
    ElementTree.register_namespace("gz", NAMESPACE)
    root = Element("sdf", version="1.9")
    model = SubElement(root, "model", name=name)
    _add_base(model, found)
    for wheel, forward, left in WHEELS:
        _add_wheel(model, found, wheel, (0.5 * forward * found.wheelbase, 0.5 * left * found.track))
    _add_drive(model, found)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _put(parent: Element, name: str, *values: float | str) -> None:
    words = [value if isinstance(value, str) else f"{value:.8g}" for value in values]
    SubElement(parent, name).text = " ".join(words)


def _add_inertia(link: Element, mass: float, diagonal: tuple[float, float, float], pose: tuple[float, ...]) -> None:
    inertial = SubElement(link, "inertial")
    _put(inertial, "pose", *pose, 0.0, 0.0, 0.0)
    _put(inertial, "mass", mass)
    inertia = SubElement(inertial, "inertia")
    for name, value in zip(("ixx", "iyy", "izz"), diagonal, strict=True):
        _put(inertia, name, value)


def _add_base(model: Element, found: CarriedOver) -> None:
    link = SubElement(model, "link", name="base_link")
    _put(link, "pose", 0.0, 0.0, found.rolling_radius, 0.0, 0.0, 0.0)
    body = chassis(found)
    _add_inertia(link, body.mass, body.inertia, body.centre)
    visual = SubElement(link, "visual", name="chassis")
    _put(visual, "pose", 0.0, 0.0, 0.5 * found.rolling_radius, 0.0, 0.0, 0.0)
    box = SubElement(SubElement(visual, "geometry"), "box")
    _put(box, "size", found.wheelbase, found.track - found.wheel_width, 0.8 * found.rolling_radius)
    _add_imu(link, found)


def _add_imu(link: Element, found: CarriedOver) -> None:
    """IMU at its place with noise and constant bias; the format has no scale factor."""
    sensor = SubElement(link, "sensor", name="imu", type="imu")
    _put(sensor, "pose", found.imu_x, found.imu_y, 0.0, found.imu_roll, found.imu_pitch, found.imu_yaw)
    _put(sensor, "update_rate", 125.0)
    _put(sensor, "always_on", "true")
    imu = SubElement(sensor, "imu")
    rate = SubElement(imu, "angular_velocity")
    force = SubElement(imu, "linear_acceleration")
    _add_noise(rate, "z", found.gyro_noise, found.gyro_bias)
    _add_noise(force, "x", found.accelerometer_noise, found.accelerometer_bias_x)
    _add_noise(force, "y", found.accelerometer_noise, found.accelerometer_bias_y)


def _add_noise(reading: Element, axis: str, deviation: float, bias: float) -> None:
    noise = SubElement(SubElement(reading, axis), "noise", type="gaussian")
    # a bias_mean would do, but Gazebo turns its sign by chance
    _put(noise, "mean", bias)
    _put(noise, "stddev", deviation)


def _add_wheel(model: Element, found: CarriedOver, name: str, place: tuple[float, float]) -> None:
    radius, mass = found.rolling_radius, WHEEL_MASS * found.mass
    link = SubElement(model, "link", name=name)
    _put(link, "pose", *place, radius, 0.0, 0.0, 0.0)
    spin = max(0.5 * found.bank_inertia, 0.5 * mass * radius**2)
    # an inertia is that of a body only if no axis has more than the two others together
    _add_inertia(link, mass, (HORIZONTAL_INERTIA * spin, spin, HORIZONTAL_INERTIA * spin), (0.0, 0.0, 0.0))
    for kind in ("collision", "visual"):
        part = SubElement(link, kind, name=f"{name}_{kind}")
        _put(part, "pose", 0.0, 0.0, 0.0, 0.5 * math.pi, 0.0, 0.0)
        cylinder = SubElement(SubElement(part, "geometry"), "cylinder")
        _put(cylinder, "radius", radius)
        _put(cylinder, "length", found.wheel_width)
        if kind == "collision":
            ode = SubElement(SubElement(SubElement(part, "surface"), "friction"), "ode")
            _put(ode, "mu", found.friction_along)
            _put(ode, "mu2", found.friction_across)
            direction = SubElement(ode, "fdir1", {f"{{{NAMESPACE}}}expressed_in": "base_link"})
            direction.text = "1 0 0"
    joint = SubElement(model, "joint", name=f"{name}_joint", type="revolute")
    _put(joint, "parent", "base_link")
    _put(joint, "child", name)
    axis = SubElement(joint, "axis")
    _put(axis, "xyz", "0 1 0")
    limit = SubElement(axis, "limit")
    _put(limit, "velocity", found.speed_limit)
    if math.isfinite(found.torque_limit):
        _put(limit, "effort", 0.5 * found.torque_limit)


def _add_drive(model: Element, found: CarriedOver) -> None:
    """Wheel speeds for a commanded twist, by rolling radius and track; limits of the robot, straight ahead."""
    plugin = SubElement(model, "plugin", filename="gz-sim-diff-drive-system", name=PLUGIN)
    for wheel, _, left in WHEELS:
        _put(plugin, "left_joint" if left > 0 else "right_joint", f"{wheel}_joint")
    _put(plugin, "wheel_separation", found.commanded_track)
    _put(plugin, "wheel_radius", found.rolling_radius)
    fastest = found.speed_limit * found.rolling_radius
    _put(plugin, "max_linear_velocity", fastest)
    _put(plugin, "min_linear_velocity", -fastest)
    turning = 2.0 * fastest / found.commanded_track
    _put(plugin, "max_angular_velocity", turning)
    _put(plugin, "min_angular_velocity", -turning)
    # the fastest change of a first-order lag, at the start of a step to the largest speed
    steepest = min(found.acceleration_limit, found.speed_limit / found.time_constant)
    for sign, bound in ((1.0, "max"), (-1.0, "min")):
        _put(plugin, f"{bound}_linear_acceleration", sign * steepest * found.rolling_radius)
        _put(
            plugin,
            f"{bound}_angular_acceleration",
            sign * 2.0 * steepest * found.rolling_radius / found.commanded_track,
        )
    _put(plugin, "odom_publish_frequency", 50.0)


def gazebo_config(name: str, source: str) -> str:
    """Text of ``model.config``, by which Gazebo finds the model.

    Args:
        name: of the robot.
        source: where it comes from, for people.
    """
    root = Element("model")
    _put(root, "name", name)
    _put(root, "version", "1.0")
    SubElement(root, "sdf", version="1.9").text = "model.sdf"
    _put(root, "description", f"{name}, corrected: {source}")
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"
