"""What an oracle gains beside the diagnosis."""

from typing import Any

import pytest

from benchmarks.concealed_oracle import compared, eligible


def estimate(value: float, low: float) -> dict[str, Any]:
    return {"5": {"corrected": {"value": value, "interval": [low, 2.0 * value]}}}


def certificate(motion: dict[str, Any], readings: dict[str, Any]) -> dict[str, Any]:
    return {"gain": motion, "gain_readings": readings}


def test_motion_counts_where_the_oracle_certainly_gains_in_it() -> None:
    ours = {"fit": certificate(estimate(0.3, 0.2), estimate(0.2, 0.1))}
    best = certificate(estimate(0.4, 0.3), estimate(0.5, 0.4))
    assert compared(ours, False, best)["share"] == pytest.approx(0.75)
    in_readings = certificate(estimate(0.4, -0.1), estimate(0.5, 0.4))
    found = compared(ours, False, in_readings)
    assert (found["of"], found["share"]) == ("gain_readings", pytest.approx(0.4))
    assert compared(ours, False, certificate(estimate(0.01, 0.005), estimate(0.4, -0.2)))["share"] is None
    assert compared(ours, True, None)["share"] == pytest.approx(1.0)


def test_only_certified_cases_with_visible_effects_of_the_library_count() -> None:
    slope = {"kind": "single", "verdict": ["slope"], "effects": [{"name": "slope", "parameters": {"angle": 0.05}}]}
    held = {"kind": "single", "verdict": ["sensor_hold"], "effects": [{"name": "sensor_hold", "parameters": {}}]}
    labels = {"a": slope, "b": slope, "c": held, "d": {"kind": "null", "verdict": ["none"], "effects": []}, "e": slope}
    seen = {"fit": {"gain": {}}, "verdict": ["slope"], "detectable": {"slope": {"angle": 0.01}}}
    answers = {
        "a": seen,
        "b": seen | {"fit": None},
        "c": seen | {"verdict": ["sensor_hold"]},
        "d": seen,
        "e": seen | {"verdict": ["payload"], "detectable": {"slope": {"angle": 0.01}}},
    }
    assert list(eligible(labels, answers, {})) == [("a", ["slope"], True), ("e", ["slope"], False)]
    hidden = seen | {"detectable": {"slope": {"angle": 0.1}}}
    assert list(eligible({"a": slope}, {"a": hidden}, {})) == []
