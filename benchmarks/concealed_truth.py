"""True sizes of concealed cases in the library's terms: which parameters mean the same, and what follows."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from ddagr_gym.physics.effects.registry import effect_kind

Case = tuple[str, Mapping[str, Any], Mapping[str, Any]]
"""Name, label, answer."""

Sizes = Mapping[str, Mapping[str, float]]
"""Of effects, by name and field."""

Truth = tuple[str, Callable[[float], float]]


def _same(value: float) -> float:
    return value


def _ratio(logarithm: float) -> float:
    return math.exp(logarithm)


def _inverse(logarithm: float) -> float:
    """The generator's ratios are right over left, the library's left over right."""
    return math.exp(-logarithm)


SAME_PARAMETERS: dict[str, dict[str, Truth]] = {
    "accelerometer_bias": {"x": ("x", _same), "y": ("y", _same)},
    "centre_of_mass_offset": {"x": ("x", _same), "y": ("y", _same)},
    "command_deadband": {"width": ("deadband", _same)},
    "command_delay": {"delay": ("delay", _same)},
    "encoder_scale": {"right": ("right", _same), "left": ("left", _same)},
    "gyro_bias": {"bias": ("bias", _same)},
    "gyro_scale": {"scale": ("scale", _same)},
    "imu_lever_arm": {"x": ("x", _same), "y": ("y", _same)},
    "imu_misalignment": {"yaw": ("yaw", _same)},
    "imu_tilt": {"roll": ("roll", _same), "pitch": ("pitch", _same)},
    "motor_droop": {"droop": ("droop", _same)},
    "motor_lag": {"lag": ("added_time_constant", _same)},
    "motor_saturation": {"speed_limit": ("speed_limit", _same)},
    "multipass": {"stiffening": ("stiffening", _same)},
    "payload": {"mass": ("mass", _same)},
    "pose_latency": {"latency": ("latency", _same)},
    "slope": {"angle": ("angle", _same)},
    "soil_change": {"strength": ("ln_strength", _ratio), "stiffness": ("ln_stiffness", _ratio)},
    "soil_patch": {"strength": ("ln_strength", _ratio), "stiffness": ("ln_stiffness", _ratio)},
    "soil_split": {"strength": ("ln_strength_ratio", _inverse), "stiffness": ("ln_stiffness_ratio", _inverse)},
    "towed_drag": {"force": ("force", _same)},
    "viscous_drag": {"coefficient": ("coefficient", _same)},
    "wheel_radius_mismatch": {"difference": ("ratio", _same)},
}
"""Parameters that mean the same in the library and in the generator: library field, label field and conversion.

Left out: `lateral_bulldozing` and `slip_sinkage`, whose sizes multiply different laws, `sensor_hold`, whose duration
is read off without an interval, and the signs, which have no size.
"""


def true_sizes(effect: Mapping[str, Any]) -> dict[str, float]:
    """Sizes of a label's effect by library field, as far as they mean the same.

    Args:
        effect: entry of a label.
    """
    fields = SAME_PARAMETERS.get(effect["name"], {})
    known = effect["parameters"]
    return {ours: convert(float(known[theirs])) for ours, (theirs, convert) in fields.items() if theirs in known}


def detectable(label: Mapping[str, Any], answer: Mapping[str, Any], equivalents: Sizes | None = None) -> bool:
    """Whether all effects of a case are at least as large as what the diagnosis says it can show.

    Args:
        label: of the case.
        answer: with the least detectable distances from neutral, by effect and field. Of a single effect they count as
            they are before anything was named: a wrong name beside it does not make it undetectable.
        equivalents: sizes in the library's terms of effects whose own mean something else, by name.
    """
    alone = answer.get("detectable_alone") if len(label["effects"]) == 1 else None
    limits = alone or answer.get("detectable") or {}
    known = equivalents or {}
    return all(
        is_detectable(effect["name"], true_sizes(effect) or known.get(effect["name"], {}), limits)
        for effect in label["effects"]
    )


def is_detectable(kind: str, sizes: Mapping[str, float], limits: Mapping[str, Mapping[str, float | None]]) -> bool:
    """An effect without sizes, or of which the diagnosis says nothing, counts; one that it cannot show does not."""
    if not sizes or kind not in limits:
        return True
    if not effect_kind(kind).differentiable:
        # the diagnosis says which limits show, as they are
        return any(value <= float(least) for field, value in sizes.items() if (least := limits[kind].get(field)))
    return any(
        abs(value - float(effect_kind(kind).parameter(field).metadata["neutral"])) >= float(least)
        for field, value in sizes.items()
        if (least := limits[kind].get(field)) is not None
    )


class Stated(NamedTuple):
    """A stated size beside the true one, both in the library's terms and the unit of its field.

    Attributes:
        case: name.
        effect: name.
        field: of the effect.
        truth: true size.
        value: stated size.
        interval: stated with it.
    """

    case: str
    effect: str
    field: str
    truth: float
    value: float
    interval: Sequence[float]


def _stated(cases: Sequence[Case]) -> Iterator[Stated]:
    """Every size with an interval of a rightly named effect of the tag "same"."""
    for case, label, answer in cases:
        truth = {effect["name"]: effect for effect in label["effects"] if effect["tag"] == "same"}
        for finding in answer["findings"]:
            if finding["name"] not in truth or finding["name"] not in answer["verdict"]:
                continue
            for field, size in true_sizes(truth[finding["name"]]).items():
                estimate = finding["parameters"].get(field, {})
                if estimate.get("interval") is not None:
                    yield Stated(case, finding["name"], field, size, float(estimate["value"]), estimate["interval"])


def covered(cases: Sequence[Case]) -> list[bool]:
    """Whether each stated interval holds the truth, where the effect was rightly named and has the library's form."""
    return [_holds(stated) for stated in _stated(cases)]


def _holds(stated: Stated) -> bool:
    return stated.interval[0] <= stated.truth <= stated.interval[1]


def misses(cases: Sequence[Case]) -> list[dict[str, Any]]:
    """The intervals that do not hold the truth."""
    return [
        {"case": s.case, "effect": s.effect, "parameter": s.field, "truth": s.truth, "interval": list(s.interval)}
        for s in _stated(cases)
        if not _holds(s)
    ]


def size_errors(cases: Sequence[Case]) -> list[float]:
    """Relative error of the size of every rightly named effect that has the library's form [-].

    |found - true| / max(|true - neutral|, least), from neutral because a gain of 1 or a factor of 1 is no effect; least
    is the library's least meaningful distance, so that a small error of next to nothing is not called large. Several
    sizes of an effect (x and y, roll and pitch, strength and stiffness) are one vector in units of their least
    distances, and count once: a component near zero has no relative error of its own. An angle's size is the angle
    itself (all are far below a turn; directions are no sizes). A limit is compared with the true limit, since neutral
    is no limit at all. Sizes without an interval were not fitted and do not count, as in :func:`covered`.

    Args:
        cases: singles and doubles.
    """
    by_effect: dict[tuple[str, str], list[Stated]] = {}
    for stated in _stated(cases):
        by_effect.setdefault((stated.case, stated.effect), []).append(stated)
    return [_relative_error(sizes) for sizes in by_effect.values()]


def _relative_error(sizes: Sequence[Stated]) -> float:
    """Length of the error over that of the true vector, in units of the least meaningful distances."""
    scales = [_neutral_and_least(stated) for stated in sizes]
    off = math.hypot(*((s.value - s.truth) / least for s, (_, least) in zip(sizes, scales, strict=True)))
    true = math.hypot(*((s.truth - neutral) / least for s, (neutral, least) in zip(sizes, scales, strict=True)))
    return off / max(true, 1.0)


def _neutral_and_least(stated: Stated) -> tuple[float, float]:
    """Where a size is counted from, and its unit; a limit from 0 in units of the true one."""
    kind = effect_kind(stated.effect)
    if not kind.differentiable:
        return 0.0, abs(stated.truth)
    data = kind.parameter(stated.field).metadata
    return float(data["neutral"]), float(data["least"])


def sizes(answer: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Sizes that an answer states, with their intervals, by effect and field."""
    return {
        finding["name"]: {
            field: {"value": estimate["value"], "interval": estimate["interval"]}
            for field, estimate in finding["parameters"].items()
        }
        for finding in answer["findings"]
    }
