"""Drives whose physics is written down here, apart from the simulator, with faults of known size."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from ddagr_gym.recordings.schema import Recording, RobotGeometry


@dataclass(frozen=True)
class Faults:
    """What is wrong with a drive; the defaults are a sound one."""

    effective_track: float = 1.6
    pose_latency: float = 0.0
    encoder_latency: float = 0.0
    command_delay: float = 0.1
    motor_rate: float = 5.0
    gyro_scale: float = 1.0
    gyro_bias: float = 0.0
    right_scale: float = 1.0
    left_scale: float = 1.0
    command_scale: float = 1.0
    mounting_yaw: float = 0.0
    force_x_sign: float = 1.0
    force_y_sign: float = 1.0
    force_offset: tuple[float, float] = (0.0, 0.0)
    slope: tuple[float, float] = (0.0, 0.0)
    travel: float = 0.95


def delayed(t: np.ndarray, values: np.ndarray, delay: float) -> np.ndarray:
    return np.interp(t - delay, t, values)


def drive(
    geometry: RobotGeometry, faults: Faults = Faults(), *, seed: int = 0, seconds: float = 120.0, period: float = 0.02
) -> Recording:
    """Steps of both bank commands with rests; first-order motors; a wider effective track and a little slip."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, period)
    command = np.zeros((t.size, 2))
    start = 4.0
    while start < seconds - 5:
        length = rng.uniform(3.0, 6.0)
        rows = (t >= start) & (t < start + length)
        command[rows] = rng.uniform(-4, 6, 2) if rng.random() < 0.75 else 0.0
        start += length
    omega = np.zeros_like(command)
    lagged = np.stack([delayed(t, command[:, i], faults.command_delay) for i in range(2)], axis=1)
    for k in range(1, t.size):
        omega[k] = omega[k - 1] + period * faults.motor_rate * (lagged[k] - omega[k - 1])
    radius, half_track = geometry.wheel_radius, geometry.half_track
    v = faults.travel * radius * omega.mean(axis=1)
    w = radius * (omega[:, 0] - omega[:, 1]) / (2 * half_track * faults.effective_track)
    yaw = np.concatenate([[0.0], np.cumsum(0.5 * (w[1:] + w[:-1])) * period])
    x = np.concatenate([[0.0], np.cumsum((v * np.cos(yaw))[1:]) * period])
    y = np.concatenate([[0.0], np.cumsum((v * np.sin(yaw))[1:]) * period])
    force_x = np.gradient(v, t) + faults.slope[0] * np.cos(yaw) + faults.slope[1] * np.sin(yaw)
    force_y = v * w - faults.slope[0] * np.sin(yaw) + faults.slope[1] * np.cos(yaw)
    c, s = np.cos(faults.mounting_yaw), np.sin(faults.mounting_yaw)
    seen_x, seen_y = c * force_x + s * force_y, -s * force_x + c * force_y
    noise = rng.standard_normal((6, t.size))
    new_pose = np.arange(t.size) % 10 == 0
    late = [delayed(t, value, faults.pose_latency) for value in (x, y, yaw)]
    columns = {
        "t": t,
        "command_right": faults.command_scale * command[:, 0],
        "command_left": command[:, 1],
        "encoder_right": faults.right_scale * delayed(t, omega[:, 0], faults.encoder_latency),
        "encoder_left": faults.left_scale * delayed(t, omega[:, 1], faults.encoder_latency),
        "specific_force_x": faults.force_x_sign * seen_x + faults.force_offset[0] + 0.05 * noise[0],
        "specific_force_y": faults.force_y_sign * seen_y + faults.force_offset[1] + 0.05 * noise[1],
        "specific_force_z": 9.81 + 0.05 * noise[2],
        "yaw_rate": faults.gyro_scale * w + faults.gyro_bias + 0.003 * noise[3],
        "pose_x": np.where(new_pose, late[0] + 0.01 * noise[4], np.nan),
        "pose_y": np.where(new_pose, late[1] + 0.01 * noise[5], np.nan),
        "pose_yaw": np.where(new_pose, (late[2] + 0.005 * noise[4] + np.pi) % (2 * np.pi) - np.pi, np.nan),
    }
    return Recording.from_columns(columns, geometry, source="written down")


@pytest.fixture(scope="session")
def warthog() -> RobotGeometry:
    return RobotGeometry("warthog", 0.3, 0.54)


@pytest.fixture(scope="session")
def make_drive(warthog: RobotGeometry) -> Callable[..., Recording]:
    """Function that makes a drive from faults by name."""

    def make(*, seed: int = 0, seconds: float = 120.0, period: float = 0.02, **faults: object) -> Recording:
        return drive(warthog, Faults(**faults), seed=seed, seconds=seconds, period=period)  # type: ignore[arg-type]

    return make


@pytest.fixture(scope="session")
def rested() -> Callable[[Recording, float], Recording]:
    """Function that lets the robot of a drive stand for a time behind it [s]; poses go on."""

    def rest(made: Recording, seconds: float) -> Recording:
        count, rng = round(seconds / made.period), np.random.default_rng(1)
        columns = {"t": np.arange(len(made) + count) * made.period}
        for name, values in made.channels.items():
            still = name.startswith(("command", "encoder", "yaw_rate", "specific_force"))
            level = 0.0 if still else values[np.isfinite(values)][-1]
            noise = 0.0 if name.startswith(("command", "encoder")) else 0.003 * rng.standard_normal(count)
            kept = np.arange(count) % 10 == 0 if name.startswith("pose") else np.ones(count, dtype=bool)
            columns[name] = np.concatenate([values, np.where(kept, level + noise, np.nan)])
        return Recording.from_columns(columns, made.meta.geometry, source=made.meta.source)

    return rest


@pytest.fixture(scope="session")
def recordings_dir() -> Path:
    """Folder of the real drives: DDAGR_RECORDINGS, else ``recordings`` of the shared folder; skips when absent."""
    shared = Path(os.environ.get("DDAGR_SHARED") or Path(__file__).resolve().parents[3] / "shared")
    folder = Path(os.environ.get("DDAGR_RECORDINGS") or shared / "recordings")
    if not (folder / "open").is_dir():
        pytest.skip(f"real drives are not at {folder}: set DDAGR_RECORDINGS to their folder")
    return folder


# ---------------------------------------------------------------------------------------------------------------------
# Messages of a small drive, for bags and MCAP files


@dataclass(frozen=True)
class Message:
    """One message: topic, type with package, stamp and time of receipt [s], and the values it carries."""

    topic: str
    kind: str
    stamp: float
    receive: float
    values: dict[str, float]


def drive_messages(seconds: float = 4.0, start: float = 1_700_000_000.0, late: float = 0.05) -> list[Message]:
    """Imu at 50 Hz, JointState at 10 Hz, Odometry at 5 Hz, Twist at 20 Hz; received ``late`` after their stamps."""
    found = []
    for topic, kind, rate, values in (
        ("/imu/data", "sensor_msgs/msg/Imu", 50, lambda t: {"az": 9.8, "ax": 0.1 * t, "gz": 0.2 + t}),
        ("/joint_states", "sensor_msgs/msg/JointState", 10, lambda t: {"right": 1.0 + t, "left": 2.0 + t}),
        ("/odom", "nav_msgs/msg/Odometry", 5, lambda t: {"x": t, "y": -t, "yaw": 0.1 * t}),
        ("/cmd_vel", "geometry_msgs/msg/Twist", 20, lambda t: {"v": 0.6, "w": 0.5}),
    ):
        for k in range(int(seconds * rate)):
            t = k / rate
            found.append(Message(topic, kind, start + t, start + t + late, values(t)))
    return sorted(found, key=lambda m: m.receive)


@pytest.fixture(scope="session")
def messages() -> list[Message]:
    return drive_messages()
