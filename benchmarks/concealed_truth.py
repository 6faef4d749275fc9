"""True sizes of concealed cases in the library's terms: which parameters mean the same, and what follows."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

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
        answer: with the least detectable distances from neutral, by effect and field.
        equivalents: sizes in the library's terms of effects whose own mean something else, by name.
    """
    limits = answer.get("detectable") or {}
    known = equivalents or {}
    return all(
        _is_detectable(effect["name"], true_sizes(effect) or known.get(effect["name"], {}), limits)
        for effect in label["effects"]
    )


def _is_detectable(kind: str, sizes: Mapping[str, float], limits: Mapping[str, Mapping[str, float | None]]) -> bool:
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


def _stated(cases: Sequence[Case]) -> Iterator[tuple[str, str, str, float, Sequence[float]]]:
    """Case, effect, field, truth and interval of every size of a rightly named effect of the tag "same"."""
    for case, label, answer in cases:
        truth = {effect["name"]: effect for effect in label["effects"] if effect["tag"] == "same"}
        for finding in answer["findings"]:
            if finding["name"] not in truth or finding["name"] not in answer["verdict"]:
                continue
            for field, value in true_sizes(truth[finding["name"]]).items():
                interval = finding["parameters"].get(field, {}).get("interval")
                if interval is not None:
                    yield case, finding["name"], field, value, interval


def covered(cases: Sequence[Case]) -> list[bool]:
    """Whether each stated interval holds the truth, where the effect was rightly named and has the library's form."""
    return [interval[0] <= value <= interval[1] for *_, value, interval in _stated(cases)]


def misses(cases: Sequence[Case]) -> list[dict[str, Any]]:
    """The intervals that do not hold the truth."""
    return [
        {"case": case, "effect": effect, "parameter": field, "truth": value, "interval": list(interval)}
        for case, effect, field, value, interval in _stated(cases)
        if not interval[0] <= value <= interval[1]
    ]


def sizes(answer: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Sizes that an answer states, with their intervals, by effect and field."""
    return {
        finding["name"]: {
            field: {"value": estimate["value"], "interval": estimate["interval"]}
            for field, estimate in finding["parameters"].items()
        }
        for finding in answer["findings"]
    }
