"""Forms of the effects of the sensors."""

from __future__ import annotations

import math

import numpy as np

from .change import Array, Change, Rng, Site, Truth, form, signed
from .drive import SAMPLE_PERIOD
from .noise import pink

IMU = ("imu_ax", "imu_ay", "imu_gz")
ENCODERS = ("enc_right", "enc_left")


@form("gyro_bias", "constant", "same", 3, 8, "w + b")
def gyro_bias(size: float, rng: Rng, site: Site) -> Change:
    bias = signed(rng) * size
    return Change({"bias": bias}, inertial=lambda m, t, r: m + np.array([0.0, 0.0, 0.0, bias]))


@form("gyro_bias", "wandering", "variant", 3, 8, "w + b (1 + 0.15 pink noise)")
def wandering_bias(size: float, rng: Rng, site: Site) -> Change:
    bias = signed(rng) * size

    def inertial(motion: Array, truth: Truth, r: Rng) -> Array:
        return np.column_stack([motion[:, :3], motion[:, 3] + bias * (1.0 + 0.15 * pink(r, len(motion), 10))])

    return Change({"bias": bias}, inertial=inertial)


@form("gyro_scale", "constant", "same", 2, 6, "w (1 + k)")
def gyro_scale(size: float, rng: Rng, site: Site) -> Change:
    scale = 1.0 + signed(rng) * size
    return Change({"scale": scale}, inertial=lambda m, t, r: m * np.array([1.0, 1.0, 1.0, scale]))


@form("gyro_scale", "uneven", "variant", 3, 7, "w (1 + k) to the left, w (1 + 0.6 k) to the right")
def uneven_scale(size: float, rng: Rng, site: Site) -> Change:
    gain = signed(rng) * size

    def inertial(motion: Array, truth: Truth, r: Rng) -> Array:
        turn = motion[:, 3]
        return np.column_stack([motion[:, :3], turn * (1.0 + gain * np.where(turn > 0, 1.0, 0.6))])

    return Change({"scale": 1.0 + 0.8 * gain}, inertial=inertial)


@form("gyro_sign", "flipped", "same", 0, 0, "-w")
def gyro_sign(size: float, rng: Rng, site: Site) -> Change:
    return Change({"sign": -1.0}, logged=lambda log, r: {**log, "imu_gz": -log["imu_gz"]})


@form("accelerometer_bias", "constant", "same", 3, 8, "a + b, both axes")
def accelerometer_bias(size: float, rng: Rng, site: Site) -> Change:
    angle = rng.uniform(-math.pi, math.pi)
    bias = np.array([size * math.cos(angle), size * math.sin(angle), 0.0, 0.0])
    return Change({"x": bias[0], "y": bias[1]}, inertial=lambda m, t, r: m + bias)


@form("accelerometer_bias", "turn-on", "variant", 3, 8, "one axis, 15 % different in every drive")
def turn_on_bias(size: float, rng: Rng, site: Site) -> Change:
    axis, bias = int(rng.integers(2)), signed(rng) * size
    unit = np.eye(4)[axis]

    def inertial(motion: Array, truth: Truth, r: Rng) -> Array:
        return motion + unit * bias * (1.0 + 0.15 * r.standard_normal())

    return Change({"x": bias * unit[0], "y": bias * unit[1]}, inertial=inertial)


def _flipped(axes: tuple[str, ...]) -> Change:
    def logged(log: dict[str, Array], r: Rng) -> dict[str, Array]:
        return {**log, **{name: -log[name] for name in axes}}

    return Change({"axes": list(axes)}, logged=logged)


@form("accelerometer_sign", "one axis", "same", 0, 0, "-a_x or -a_y")
def one_axis_flipped(size: float, rng: Rng, site: Site) -> Change:
    return _flipped((str(rng.choice(IMU[:2])),))


@form("accelerometer_sign", "both axes", "variant", 0, 0, "-a_x and -a_y (reaction instead of specific force)")
def both_axes_flipped(size: float, rng: Rng, site: Site) -> Change:
    return _flipped(IMU[:2])


@form("imu_misalignment", "yaw", "same", 2, 6, "sensor turned by A about z: (a_x, a_y) rotated by -A")
def misalignment(size: float, rng: Rng, site: Site) -> Change:
    angle = signed(rng) * size
    cosine, sine = math.cos(angle), math.sin(angle)

    def inertial(motion: Array, truth: Truth, r: Rng) -> Array:
        a_x, a_y = motion[:, 0], motion[:, 1]
        return np.column_stack([cosine * a_x + sine * a_y, -sine * a_x + cosine * a_y, motion[:, 2:]])

    return Change({"yaw": angle}, inertial=inertial)


@form("imu_tilt", "mounting", "same", 3, 10, "sensor pitched and rolled: gravity leaks in, w times cos(tilt)")
def tilt(size: float, rng: Rng, site: Site) -> Change:
    axis = rng.uniform(-math.pi, math.pi)
    k_x, k_y = math.cos(axis), math.sin(axis)
    cosine, sine = math.cos(size), math.sin(size)

    def inertial(motion: Array, truth: Truth, r: Rng) -> Array:
        f_x, f_y, f_z, turn = motion.T
        across = k_x * f_x + k_y * f_y
        g_x = cosine * f_x - sine * k_y * f_z + (1.0 - cosine) * k_x * across
        g_y = cosine * f_y + sine * k_x * f_z + (1.0 - cosine) * k_y * across
        return np.column_stack([g_x, g_y, f_z, cosine * turn])

    return Change({"roll": size * k_x, "pitch": size * k_y}, inertial=inertial)


@form("imu_lever_arm", "rigid", "same", 3, 8, "f + w' x r - w^2 r")
def lever_arm(size: float, rng: Rng, site: Site) -> Change:
    angle = rng.uniform(-math.pi, math.pi)
    x, y = size * math.cos(angle), size * math.sin(angle)

    def inertial(motion: Array, truth: Truth, r: Rng) -> Array:
        turn, swing = truth["yaw_rate"], truth["yaw_acceleration"]
        shift = np.column_stack([-swing * y - turn**2 * x, swing * x - turn**2 * y])
        return np.column_stack([motion[:, :2] + shift, motion[:, 2:]])

    return Change({"x": x, "y": y}, inertial=inertial)


@form("encoder_scale", "both banks", "same", 2, 6, "both encoders read (1 + k) times the speed", needs_pose=True)
def both_scales(size: float, rng: Rng, site: Site) -> Change:
    scale = 1.0 + signed(rng) * size
    return Change({"right": scale, "left": scale}, encoder=lambda a, t, r: a * scale)


@form("encoder_scale", "one bank", "variant", 2, 6, "one encoder reads (1 + k) times the wheel's speed")
def one_scale(size: float, rng: Rng, site: Site) -> Change:
    scale = np.ones(2)
    scale[rng.integers(2)] += signed(rng) * size
    return Change({"right": scale[0], "left": scale[1]}, encoder=lambda a, t, r: a * scale)


@form("encoder_scale", "in the loop", "different", 2, 6, "right encoder reads (1 + k) times, and the loop believes it")
def scale_in_loop(size: float, rng: Rng, site: Site) -> Change:
    scale = np.array([1.0 + signed(rng) * size, 1.0])

    def command(commands: Array, r: Rng) -> Array:
        return commands / scale

    return Change({"right": scale[0], "left": 1.0}, command=command, encoder=lambda a, t, r: a * scale)


def _late(pose: Array, seconds: Array) -> Array:
    time = np.arange(len(pose)) * SAMPLE_PERIOD
    return np.column_stack([np.interp(time - seconds, time, pose[:, k]) for k in range(3)])


@form("pose_latency", "constant", "same", 2, 6, "pose(t - T)", needs_pose=True)
def pose_latency(size: float, rng: Rng, site: Site) -> Change:
    return Change({"latency": size}, pose=lambda p, t, r: _late(p, np.full(len(p), size)))


@form("pose_latency", "jitter", "variant", 2, 6, "pose(t - T_k), T_k within 25 % of T", needs_pose=True)
def pose_jitter(size: float, rng: Rng, site: Site) -> Change:
    return Change({"latency": size}, pose=lambda p, t, r: _late(p, size * r.uniform(0.75, 1.25, len(p))))


def _held(values: Array, fresh: Array) -> Array:
    """Last fresh value at every sample."""
    return values[np.maximum.accumulate(np.where(fresh, np.arange(len(values)), 0))]


@form("sensor_hold", "slow update", "same", 2, 8, "IMU updated only every H, held in between")
def slow_update(size: float, rng: Rng, site: Site) -> Change:
    every = max(round(size / SAMPLE_PERIOD), 2)

    def logged(log: dict[str, Array], r: Rng) -> dict[str, Array]:
        fresh = np.arange(len(log["t"])) % every == 0
        return {**log, **{name: _held(log[name], fresh) for name in IMU}}

    return Change({"hold": every * SAMPLE_PERIOD, "channels": list(IMU)}, logged=logged)


@form("sensor_hold", "encoders", "variant", 2, 8, "encoders updated only every H, held in between")
def held_encoders(size: float, rng: Rng, site: Site) -> Change:
    every = max(round(size / SAMPLE_PERIOD), 2)

    def logged(log: dict[str, Array], r: Rng) -> dict[str, Array]:
        fresh = np.arange(len(log["t"])) % every == 0
        return {**log, **{name: _held(log[name], fresh) for name in ENCODERS}}

    return Change({"hold": every * SAMPLE_PERIOD, "channels": list(ENCODERS)}, logged=logged)


@form("sensor_hold", "sticking", "different", 4, 8, "IMU sample kept with probability 1 - dt/H: holds of mean length H")
def sticking(size: float, rng: Rng, site: Site) -> Change:
    def logged(log: dict[str, Array], r: Rng) -> dict[str, Array]:
        fresh = r.random(len(log["t"])) < SAMPLE_PERIOD / size
        return {**log, **{name: _held(log[name], fresh) for name in IMU}}

    return Change({"hold": size, "channels": list(IMU)}, logged=logged)
