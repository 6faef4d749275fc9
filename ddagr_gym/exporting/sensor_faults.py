"""Sensor faults that effects stand for, as numbers of a sensor; and what becomes of every effect."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ddagr_gym.exporting.working_point import LEFT_OUT
from ddagr_gym.parameters import Imu
from ddagr_gym.physics.effects import Effect

_FIELDS: Mapping[str, Mapping[str, str]] = {
    "gyro_scale": {"scale": "gyro_scale"},
    "gyro_bias": {"bias": "gyro_bias"},
    "accelerometer_bias": {"x": "accelerometer_bias_x", "y": "accelerometer_bias_y"},
    "imu_tilt": {"roll": "imu_roll", "pitch": "imu_pitch"},
    "imu_misalignment": {"yaw": "imu_yaw"},
    "imu_lever_arm": {"x": "imu_x", "y": "imu_y"},
    "encoder_scale": {"right": "encoder_scale_right", "left": "encoder_scale_left"},
    "pose_latency": {"latency": "pose_latency"},
}
"""Effect -> its parameter -> field of :class:`SensorFaults`."""

_NOT_WRITTEN = {
    "gyro_sign": "not carried over: turn the sign in your reader of the gyro",
    "accelerometer_sign": "not carried over: turn the sign in your reader of the accelerometer",
    "sensor_hold": "not carried over: readings that stop are nothing that these formats have",
}


@dataclass(frozen=True)
class SensorFaults:
    """Faults and noise of the sensors; as :class:`~ddagr_gym.exporting.carried_over.CarriedOver` has them."""

    gyro_scale: float = 1.0
    gyro_bias: float = 0.0
    accelerometer_bias_x: float = 0.0
    accelerometer_bias_y: float = 0.0
    imu_roll: float = 0.0
    imu_pitch: float = 0.0
    imu_yaw: float = 0.0
    imu_x: float = 0.0
    imu_y: float = 0.0
    encoder_scale_right: float = 1.0
    encoder_scale_left: float = 1.0
    pose_latency: float = 0.0
    gyro_noise: float = Imu().gyro_noise
    accelerometer_noise: float = Imu().accelerometer_noise


def sensor_faults(effects: tuple[Effect, ...]) -> SensorFaults:
    """Faults of the effects that are faults of sensors."""
    found = {
        place: float(getattr(effect, name))
        for effect in effects
        for name, place in _FIELDS.get(effect.name, {}).items()
    }
    return SensorFaults(**found)


def what_becomes_of(effect: Effect) -> str:
    """How an effect carries over, in words."""
    if effect.name in _FIELDS:
        return "a number of the sensor: " + ", ".join(_FIELDS[effect.name].values())
    if effect.name in LEFT_OUT:
        return LEFT_OUT[effect.name]
    if effect.name in _NOT_WRITTEN:
        return _NOT_WRITTEN[effect.name]
    return "in the numbers at the working point, which were measured with it; elsewhere not"
