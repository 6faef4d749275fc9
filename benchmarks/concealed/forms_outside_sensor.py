"""Effects that no library lists: sensors. Sizes are multiples of the figure in the equation."""

from __future__ import annotations

import math

import numpy as np
from scipy.signal import lfilter

from .change import Array, Change, Rng, Site, Truth, outside, signed
from .drive import SAMPLE_PERIOD


def _samples(seconds: float) -> int:
    return round(seconds / SAMPLE_PERIOD)


@outside("magnetic_heading", "hard iron", "pose yaw + 0.06 rad sin(yaw - iron)", needs_pose=True)
def magnetic_heading(size: float, rng: Rng, site: Site) -> Change:
    gain, iron = 0.06 * size, rng.uniform(-math.pi, math.pi)

    def pose(values: Array, truth: Truth, r: Rng) -> Array:
        yaw = values[:, 2]
        return np.column_stack([values[:, :2], yaw + gain * np.sin(yaw - iron)])

    return Change({"gain": gain, "angle": iron}, pose=pose)


@outside("gyro_warming", "turn-on drift", "w + 8 mrad/s (1 - exp(-t/25 s)) anew in every drive")
def gyro_warming(size: float, rng: Rng, site: Site) -> Change:
    end = signed(rng) * 0.008 * size

    def inertial(motion: Array, truth: Truth, r: Rng) -> Array:
        drift = end * (1.0 - np.exp(-np.arange(len(motion)) * SAMPLE_PERIOD / 25.0))
        return np.column_stack([motion[:, :3], motion[:, 3] + drift])

    return Change({"end": end}, inertial=inertial)


@outside("encoder_slip", "loose coupling", "counts lost: 20 % of the turn while |speed change| > 0.8 rad/s^2")
def encoder_slip(size: float, rng: Rng, site: Site) -> Change:
    def encoder(angles: Array, truth: Truth, r: Rng) -> Array:
        speeds = np.column_stack([truth["omega_right"], truth["omega_left"]])
        fast = np.abs(np.gradient(speeds, SAMPLE_PERIOD, axis=0)) > 0.8
        turned = np.diff(angles, axis=0, prepend=angles[:1])
        return angles[:1] + np.cumsum(turned * np.where(fast, 1.0 - 0.2 * size, 1.0), axis=0)

    return Change({"share": 0.2 * size}, encoder=encoder)


@outside("imu_crosstalk", "electrical", "a_y + 0.5 m/s w, w + 0.02 s/m a_x")
def imu_crosstalk(size: float, rng: Rng, site: Site) -> Change:
    to_force, to_turn = signed(rng) * 0.5 * size, signed(rng) * 0.02 * size

    def inertial(motion: Array, truth: Truth, r: Rng) -> Array:
        f_x, f_y, f_z, turn = motion.T
        return np.column_stack([f_x, f_y + to_force * turn, f_z, turn + to_turn * f_x])

    return Change({"to_force": to_force, "to_turn": to_turn}, inertial=inertial)


@outside("pose_multipath", "jumps", "position off by 0.12 m for 2-6 s, some five times a drive", needs_pose=True)
def pose_multipath(size: float, rng: Rng, site: Site) -> Change:
    def pose(values: Array, truth: Truth, r: Rng) -> Array:
        moved = values.copy()
        for start in r.integers(0, len(values), 5):
            angle, stop = r.uniform(-math.pi, math.pi), start + _samples(r.uniform(2.0, 6.0))
            moved[start:stop, :2] += 0.12 * size * np.array([math.cos(angle), math.sin(angle)])
        return moved

    return Change({"jump": 0.12 * size}, pose=pose)


@outside("encoder_eccentricity", "once per turn", "right encoder's angle + 0.03 rad sin(angle)")
def encoder_eccentricity(size: float, rng: Rng, site: Site) -> Change:
    depth = 0.03 * size

    def encoder(angles: Array, truth: Truth, r: Rng) -> Array:
        return np.column_stack([angles[:, 0] + depth * np.sin(angles[:, 0]), angles[:, 1]])

    return Change({"depth": depth}, encoder=encoder)


@outside("pose_clock", "drift", "pose(t - 0.008 t)", needs_pose=True, reserved=True)
def pose_clock(size: float, rng: Rng, site: Site) -> Change:
    drift = 0.008 * size

    def pose(values: Array, truth: Truth, r: Rng) -> Array:
        time = np.arange(len(values)) * SAMPLE_PERIOD
        return np.column_stack([np.interp(time * (1.0 - drift), time, values[:, k]) for k in range(3)])

    return Change({"drift": drift}, pose=pose)


@outside("imu_resonance", "soft mount", "a seen through a 5 Hz mount of damping ratio 0.12/size", reserved=True)
def imu_resonance(size: float, rng: Rng, site: Site) -> Change:
    rate, damping = 2.0 * math.pi * 5.0 * SAMPLE_PERIOD, 0.12 / size
    pole = 2.0 * math.exp(-damping * rate) * math.cos(rate * math.sqrt(1.0 - damping**2))
    tail = -math.exp(-2.0 * damping * rate)

    def inertial(motion: Array, truth: Truth, r: Rng) -> Array:
        shaken = lfilter([1.0 - pole - tail], [1.0, -pole, -tail], motion[:, :2], axis=0)
        return np.column_stack([shaken, motion[:, 2:]])

    return Change({"damping": damping}, inertial=inertial)


@outside("gyro_dead_zone", "threshold", "w = 0 while |w| < 25 mrad/s", reserved=True)
def gyro_dead_zone(size: float, rng: Rng, site: Site) -> Change:
    zone = 0.025 * size

    def logged(log: dict[str, Array], r: Rng) -> dict[str, Array]:
        return {**log, "imu_gz": np.where(np.abs(log["imu_gz"]) < zone, 0.0, log["imu_gz"])}

    return Change({"zone": zone}, logged=logged)


@outside("imu_clipping", "small range", "|a| <= 0.16 m/s^2 / size", reserved=True)
def imu_clipping(size: float, rng: Rng, site: Site) -> Change:
    limit = 0.16 / size

    def logged(log: dict[str, Array], r: Rng) -> dict[str, Array]:
        return {**log, **{name: np.clip(log[name], -limit, limit) for name in ("imu_ax", "imu_ay")}}

    return Change({"limit": limit}, logged=logged)
