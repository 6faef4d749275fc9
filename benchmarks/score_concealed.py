"""Score answers of ``benchmarks/answers/run_diagnoses.py`` against the labels of a set of the project's own generator.

    python benchmarks/score_concealed.py --answers ANSWERS.json --labels LABELS.json --output RESULT.json

Every figure is ``{value, interval, count}``: shares with 95 % Wilson intervals, others with bootstrap intervals over
cases. An effect counts as detectable where its true size is at least the least detectable one that the diagnosis of
its own case states; categorical ones always. Every case that went wrong is listed.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ddagr_gym.evaluation.statistics import wilson_interval
from ddagr_gym.recordings.files import write_atomically

SAME_PARAMETERS: dict[str, dict[str, str]] = {
    "accelerometer_bias": {"x": "x", "y": "y"},
    "centre_of_mass_offset": {"x": "x", "y": "y"},
    "command_delay": {"delay": "delay"},
    "encoder_scale": {"right": "right", "left": "left"},
    "gyro_bias": {"bias": "bias"},
    "gyro_scale": {"scale": "scale"},
    "imu_lever_arm": {"x": "x", "y": "y"},
    "imu_misalignment": {"yaw": "yaw"},
    "motor_droop": {"droop": "droop"},
    "motor_lag": {"lag": "added_time_constant"},
    "payload": {"mass": "mass"},
    "pose_latency": {"latency": "latency"},
    "slope": {"angle": "angle"},
    "towed_drag": {"force": "force"},
    "viscous_drag": {"coefficient": "coefficient"},
    "wheel_radius_mismatch": {"difference": "ratio"},
}
"""Parameters that mean the same in the library and in forms of the tag "same": library field, label field."""

Case = tuple[str, Mapping[str, Any], Mapping[str, Any]]


def share(hits: Sequence[bool]) -> dict[str, Any]:
    """Share of true values with its interval."""
    if not hits:
        return {"value": None, "interval": None, "count": 0}
    found = wilson_interval(sum(hits), len(hits))
    return {"value": sum(hits) / len(hits), "interval": [found.low, found.high], "count": len(hits)}


def mean(values: Sequence[float], seed: int = 0) -> dict[str, Any]:
    """Mean with a bootstrap interval."""
    if not values:
        return {"value": None, "interval": None, "count": 0}
    rng = np.random.default_rng(seed)
    found = np.asarray(values)
    draws = rng.choice(found, (2000, len(found))).mean(axis=1)
    low, high = np.quantile(draws, [0.025, 0.975])
    return {"value": float(found.mean()), "interval": [float(low), float(high)], "count": len(found)}


def names_of(answer: Mapping[str, Any]) -> list[str]:
    """Named effects; none and unknown are no names."""
    return [name for name in answer["verdict"] if name not in ("none", "unknown")]


def right(label: Mapping[str, Any], answer: Mapping[str, Any]) -> bool:
    """Exactly the label's names."""
    return sorted(answer["verdict"]) == sorted(label["verdict"])


def in_set(label: Mapping[str, Any], answer: Mapping[str, Any]) -> bool:
    """Each of the label's effects stands in the equivalence set of some finding."""
    sets = [set(finding["equivalence_set"]) for finding in answer["findings"]]
    return all(any(name in found for found in sets) for name in label["verdict"])


def confident(answer: Mapping[str, Any]) -> bool:
    """Names effects and says that nothing else is missing."""
    return bool(names_of(answer)) and bool(answer["complete"])


def detectable(label: Mapping[str, Any], answer: Mapping[str, Any]) -> bool:
    """Whether all effects of a case are at least as large as what the diagnosis says it can show."""
    limits = answer.get("detectable") or {}
    for effect in label["effects"]:
        sizes = SAME_PARAMETERS.get(effect["name"], {})
        known = limits.get(effect["name"], {})
        reached = [
            abs(
                float(effect["parameters"][theirs])
                - (1.0 if effect["name"] in ("encoder_scale", "gyro_scale") else 0.0)
            )
            >= known[ours]
            for ours, theirs in sizes.items()
            if known.get(ours) is not None and theirs in effect["parameters"]
        ]
        if reached and not any(reached):
            return False
    return True


def covered(cases: Sequence[Case]) -> list[bool]:
    """Whether the 90 % intervals of rightly named effects of the tag "same" hold the truth."""
    hits = []
    for _, label, answer in cases:
        truth = {effect["name"]: effect for effect in label["effects"]}
        for finding in answer["findings"]:
            effect = truth.get(finding["name"])
            if effect is None or effect["tag"] != "same":
                continue
            for ours, theirs in SAME_PARAMETERS.get(finding["name"], {}).items():
                interval = finding["parameters"].get(ours, {}).get("interval")
                if interval is not None:
                    hits.append(interval[0] <= float(effect["parameters"][theirs]) <= interval[1])
    return hits


def gain_shares(cases: Sequence[Case], horizon: str = "5") -> list[float]:
    """Certified share of the explainable error that the named effects explain, where something was named."""
    found = []
    for _, _, answer in cases:
        fit = answer.get("fit") or {}
        entry = (fit.get("gain_share") or {}).get(horizon)
        if entry is not None and names_of(answer) and math.isfinite(entry["value"]):
            found.append(float(entry["value"]))
    return found


def score(labels: Mapping[str, Any], answers: Mapping[str, Any]) -> dict[str, Any]:
    """All figures of a set."""
    cases: list[Case] = [(name, labels[name], answers[name]) for name in sorted(answers)]

    def of(*kinds: str) -> list[Case]:
        return [case for case in cases if case[1]["kind"] in kinds]

    def over(chosen: Sequence[Case], test: Callable[[Any, Any], bool]) -> dict[str, Any]:
        return share([test(label, answer) for _, label, answer in chosen])

    singles = of("single")
    seen = [case for case in singles if detectable(case[1], case[2])]
    outside = of("null", "structural null", "outside")
    named = [case for case in cases if case[1]["kind"] in ("single", "double")]
    return {
        "false_alarm_rate": over(of("null", "structural null"), lambda _, a: a["verdict"] != ["none"]),
        "false_alarm_rate_structural": over(of("structural null"), lambda _, a: a["verdict"] != ["none"]),
        "top1": over(seen, right),
        "in_set": over(seen, in_set),
        "top1_all_singles": over(singles, right),
        "top1_doubles": over(of("double"), right),
        "in_set_doubles": over(of("double"), in_set),
        "unknown_outside": over(of("outside"), lambda _, a: a["verdict"] == ["unknown"]),
        "flagged_outside": over(of("outside"), lambda _, a: not a["complete"]),
        "confident_wrong": over(outside, lambda _, a: confident(a)),
        "coverage": share(covered(named)),
        "gain_share": mean(gain_shares(named)),
        "seconds": mean([float(answer["seconds"]) for _, _, answer in cases]),
        "failures": [
            {
                "case": name,
                "kind": label["kind"],
                "label": label["verdict"],
                "forms": [effect["variant"] for effect in label["effects"]],
                "structure": label["structure"],
                "verdict": answer["verdict"],
                "complete": answer["complete"],
                "equivalence": [finding["equivalence_set"] for finding in answer["findings"]],
            }
            for name, label, answer in cases
            if not right(label, answer)
        ],
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--answers", type=Path, required=True)
    parser.add_argument("--labels", type=Path, required=True)
    parser.add_argument("--output", type=Path, required=True)
    arguments = parser.parse_args()
    entries = json.loads(arguments.labels.read_text())["cases"]
    labels = {name: entry["label"] for name, entry in entries.items()}
    result = score(labels, json.loads(arguments.answers.read_text()))
    write_atomically(arguments.output, lambda to: to.write_text(json.dumps(result, indent=1) + "\n"))
    for name, entry in result.items():
        if isinstance(entry, dict) and entry["value"] is not None:
            low, high = entry["interval"]
            print(f"{name:28s} {entry['value']:.3f}  [{low:.3f}, {high:.3f}]  {entry['count']}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
