"""What a calibration says of the sensors, in the words of a diagnosis.

A data sheet states that poses come at once, that a gyro reads what the robot turns, and where the IMU sits. Where the
drives say otherwise, that is a finding as a missing part of the drivetrain is: decided by forecasts of what was left
out of the fit, and named from the least size that matters.
"""

from __future__ import annotations

from collections.abc import Mapping

from ddagr_gym.calibration.part_selection import least_growth, surely_above
from ddagr_gym.calibration.parts import ENCODER_SCALES
from ddagr_gym.calibration.result import Calibration
from ddagr_gym.calibration.simulator_values import calibrated_effects
from ddagr_gym.diagnosis.answer.verdict import Estimate, Finding
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.encoder_scale import EncoderScale
from ddagr_gym.physics.effects.gyro_scale import GyroScale
from ddagr_gym.physics.effects.imu_lever_arm import ImuLeverArm
from ddagr_gym.physics.effects.imu_misalignment import ImuMisalignment
from ddagr_gym.physics.effects.pose_latency import PoseLatency

OF_PARTS: Mapping[type[Effect], Mapping[str, str]] = {
    GyroScale: {"scale": "gyro_scale"},
    EncoderScale: dict(zip(("right", "left"), ENCODER_SCALES, strict=True)),
}
"""What the fields of an effect are called among the parameters of a calibration."""

OF_MOUNTING: Mapping[type[Effect], Mapping[str, str]] = {
    ImuLeverArm: {"x": "imu_x", "y": "imu_y"},
    ImuMisalignment: {"yaw": "imu_yaw"},
}
"""The same in its mounting of the IMU; in one drive nothing tells a tilt from a bias."""

Named = tuple[Finding, Effect]


def named_sensors(calibration: Calibration) -> tuple[Named, ...]:
    """Findings on the sensors with the effects of the library that they are: poses, gyro, encoders, IMU.

    Args:
        calibration: of the recordings that are diagnosed.
    """
    named = [*_late_poses(calibration)]
    for effect in calibrated_effects(calibration):
        if type(effect) in OF_PARTS and _matters(effect, OF_PARTS[type(effect)]):
            named.append((_of_part(calibration, effect), effect))
        elif type(effect) in OF_MOUNTING:
            named.append((_of_mounting(calibration, effect), effect))
    return tuple(named)


def _late_poses(calibration: Calibration) -> list[Named]:
    """Poses that come behind the gyro, by as much as makes their headings agree best."""
    late = max((drive.pose_lateness for drive in calibration.drives), default=0.0)
    if late < _least(PoseLatency, "latency"):
        return []
    effect = PoseLatency(late)
    return [(_finding(effect, {"latency": Estimate(late, "s")}, 0.0, 0.0, 0.0), effect)]


def _matters(effect: Effect, names: Mapping[str, str]) -> bool:
    """Whether a scale is off by enough."""
    return any(abs(getattr(effect, field) - 1.0) >= _least(type(effect), field) for field in names)


def _of_part(calibration: Calibration, effect: Effect) -> Finding:
    part = next(item for item in calibration.parts if item.name == effect.name)
    found = {item.name: item for item in calibration.parameters if item.calibrated}
    sizes = {
        field: Estimate(getattr(effect, field), found[name].unit, found[name].interval)
        for field, name in OF_PARTS[type(effect)].items()
        if name in found
    }
    error = part.error or 0.0
    return _finding(effect, sizes, part.growth, error, least_growth(error, _folds(calibration)))


def _of_mounting(calibration: Calibration, effect: Effect) -> Finding:
    found = {} if calibration.imu is None else {item.name: item for item in calibration.imu.sizes}
    items = {field: found[name] for field, name in OF_MOUNTING[type(effect)].items()}
    one = next(iter(items.values()))
    growth, error = one.growth or 0.0, one.error or 0.0
    sizes = {field: Estimate(item.value, item.unit, item.interval) for field, item in items.items()}
    return _finding(effect, sizes, growth, error, surely_above(_folds(calibration)) * error)


def _folds(calibration: Calibration) -> int:
    """Into how many drives, or parts of one, the forecasts are left out."""
    return len({item.drive for item in calibration.forecasts})


def _finding(effect: Effect, sizes: Mapping[str, Estimate], growth: float, error: float, gate: float) -> Finding:
    """Its gain is the growth of the loss of what was left out without it; 0 with its gate where it is seen directly."""
    score = growth / error if error > 0.0 else 0.0
    return Finding(effect.name, dict(sizes), growth, gate, score, growth, {}, {effect.name: 1.0})


def _least(kind: type[Effect], name: str) -> float:
    return float(kind.parameter(name).metadata["least"])
