"""What a calibration says of sensors and of the gains of commands, in the words of a diagnosis.

A data sheet states that poses come at once, what an encoder counts, that both banks obey alike, and where the IMU sits.
Where the drives say otherwise, that is a finding as a missing part of the drivetrain is: decided by forecasts of what
was left out of the fit, and named from the least size that matters. The gyro is held against the poses instead
(:mod:`ddagr_gym.diagnosis.result.inertial_findings`), which say more of it than forecasts do.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from ddagr_gym.calibration.accelerometer_results import MountingSize
from ddagr_gym.calibration.forecast_findings import folds_of, forecast_finding
from ddagr_gym.calibration.imu_mounting import LEAST
from ddagr_gym.calibration.part_comparison import least_growth, surely_above
from ddagr_gym.calibration.parts import factors_of_banks
from ddagr_gym.calibration.result import Calibration
from ddagr_gym.calibration.simulator_values import calibrated_effects
from ddagr_gym.diagnosis.answer.verdict import Estimate, Finding
from ddagr_gym.diagnosis.preprocessing.data_checks import NO_DOUBT, DoubtedBanks
from ddagr_gym.diagnosis.result.encoder_findings import BANKS, Named
from ddagr_gym.diagnosis.result.uncertainty import answer_interval
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.command_gain import CommandGain
from ddagr_gym.physics.effects.encoder_scale import EncoderScale
from ddagr_gym.physics.effects.imu_lever_arm import ImuLeverArm
from ddagr_gym.physics.effects.imu_misalignment import ImuMisalignment
from ddagr_gym.physics.effects.pose_latency import PoseLatency
from ddagr_gym.recordings.checks.command_gains import GAIN_BALANCE
from ddagr_gym.recordings.checks.findings import Question
from ddagr_gym.recordings.checks.turning import BALANCE

OF_MOUNTING: Mapping[type[Effect], Mapping[str, str]] = {
    ImuLeverArm: {"x": "imu_x", "y": "imu_y"},
    ImuMisalignment: {"yaw": "imu_yaw"},
}
"""What the fields of an effect are called in a mounting of the IMU; in one drive nothing tells a tilt from a bias."""

BALANCES: Mapping[str, Question] = {EncoderScale.name: BALANCE, CommandGain.name: GAIN_BALANCE}
"""What the right bank may be over the left one, by what is fitted of each."""

IN_COMMON = 1.05
"""What both banks have in common, or one over it, from which it is named [-] (ours)."""


def named_sensors(calibration: Calibration, doubted: DoubtedBanks = NO_DOUBT) -> tuple[Named, ...]:
    """Findings on poses, encoders, commands and IMU with the effects of the library that they are.

    What was fitted of both banks counts even where it has no name, since the rest was fitted beside it.

    Args:
        calibration: of the recordings that are diagnosed.
        doubted: what of the banks was in doubt.
    """
    named = [*_late_poses(calibration)]
    for effect in calibrated_effects(calibration):
        if isinstance(effect, EncoderScale | CommandGain):
            named.append((_of_banks(calibration, effect, doubted), effect))
        elif type(effect) in OF_MOUNTING and (finding := _mounting(calibration, effect)) is not None:
            named.append((finding, effect))
    return tuple(named)


def _late_poses(calibration: Calibration) -> list[Named]:
    """Poses that come behind the gyro, by as much as makes their headings agree best: seen in the values.

    Fits move the poses by it beforehand. A simulator keeps no longer past than its effect allows.
    """
    latency = PoseLatency.parameter("latency").metadata
    late = max((drive.pose_lateness for drive in calibration.drives), default=0.0)
    if late < latency["least"]:
        return []
    told = [(item.pose_lateness, item.lateness_interval) for item in calibration.drives]
    ends = [end for value, interval in told if interval is not None for end in answer_interval(value, interval)]
    interval = (max(min(ends), 0.0), max(ends)) if ends else None
    finding = Finding.seen(PoseLatency.name, {"latency": Estimate(late, latency["unit"], interval)})
    return [(finding, PoseLatency(min(late, latency["high"])))]


def _of_banks(calibration: Calibration, effect: EncoderScale | CommandGain, doubted: DoubtedBanks) -> Finding | None:
    """Banks that differ by more than their balance may, or have much in common where that was in doubt.

    Args:
        calibration: of the recordings that are diagnosed.
        effect: that was fitted.
        doubted: what of the banks was in doubt.
    """
    common = doubted.common
    differ = abs(math.log(effect.left / effect.right)) >= math.log(BALANCES[effect.name].expected[1])
    both = math.sqrt(effect.right * effect.left)
    if not differ and (effect.name not in common or abs(math.log(both)) < math.log(IN_COMMON)):
        return None
    sizes = _sizes_of_banks(calibration, effect)
    if not differ:
        sizes = _alike(sizes, doubted)
    elif isinstance(effect, CommandGain):
        sizes = {field: _reaching(size, size.value / both) for field, size in sizes.items()}
    part = next(item for item in calibration.parts if item.name == effect.name)
    gate = least_growth(part.error, folds_of(calibration))
    finding = forecast_finding(effect.name, sizes, part.growth, part.error, gate)
    return finding if differ else replace(finding, equivalence_set=dict.fromkeys(common, 1.0 / len(common)))


def _sizes_of_banks(calibration: Calibration, effect: EncoderScale | CommandGain) -> dict[str, Estimate]:
    intervals = {item.name: item.interval for item in calibration.parameters if item.calibrated}
    return {
        field: Estimate(getattr(effect, field), "-", intervals.get(name))
        for field, name in zip(BANKS, factors_of_banks(effect.name), strict=True)
    }


def _alike(sizes: Mapping[str, Estimate], doubted: DoubtedBanks) -> dict[str, Estimate]:
    """Factors of both banks with the interval that holds those of both, and that of banks that follow their commands.

    Motors may differ by as little as the banks do, and may fall less short of held commands than those of the fit.
    """
    ends = [end for size in sizes.values() for end in size.interval or ()]
    ends += [answer_interval(gain, (low, gain))[0] for gain, (low, _) in doubted.held if math.isfinite(low)]
    return {field: _reaching(size, *ends) for field, size in sizes.items()}


def _reaching(size: Estimate, *values: float) -> Estimate:
    """Factor of a bank whose interval, where it has one, reaches to further values.

    What both banks have in common may be friction, load or the highest speed of a drivetrain.
    """
    if size.interval is None:
        return size
    ends = (*size.interval, *values)
    return replace(size, interval=(min(ends), max(ends)))


def _mounting(calibration: Calibration, effect: Effect) -> Finding | None:
    """A mounting of which some size that matters is surely not nothing."""
    found = {} if calibration.imu is None else {item.name: item for item in calibration.imu.sizes}
    items = {field: found[name] for field, name in OF_MOUNTING[type(effect)].items()}
    if not any(_is_sure(item) for item in items.values()):
        return None
    one = next(iter(items.values()))
    sizes = {field: Estimate(item.value, item.unit, item.interval) for field, item in items.items()}
    gate = surely_above(folds_of(calibration)) * (one.error or 0.0)
    return forecast_finding(effect.name, sizes, one.growth or 0.0, one.error, gate)


def _is_sure(item: MountingSize) -> bool:
    """Whether a size matters and its interval does not hold zero."""
    return (
        abs(item.value) >= LEAST[item.name]
        and item.interval is not None
        and not item.interval[0] <= 0.0 <= item.interval[1]
    )
