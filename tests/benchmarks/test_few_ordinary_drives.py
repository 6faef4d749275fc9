"""Comparisons with few ordinary drives, on scans of known numbers."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.few_ordinary_drives import BY_FEW, NOW, compared, draw, figures, least_told, surest


def drive(size: float, windows: float = 40.0) -> dict[str, object]:
    """Known to half a least size within it, and expected to differ by a tenth of one."""
    return {"value": [size], "within": [[0.25]], "between": [[0.01]], "windows": windows}


def scan(size: float, ground: str = "sand") -> dict[str, object]:
    effects = [
        {
            "effect": name,
            "has_sizes": True,
            "drives": [drive(value), *(drive(k) for k in (-0.1, 0.0, 0.1, 0.05, -0.05))],
        }
        for name, value in (("gyro_bias", size), ("encoder_scale", 0.0))
    ]
    return {"drive": "a", "ground": ground, "effects": effects, "moved": [{"soil_strength": 0.1}] * 6}


def test_what_windows_and_agreeing_drives_tell_makes_smaller_changes_known():
    for ground in ("sand", ""):
        now, few = (least_told(scan(0.0, ground), (0, 1, 2), rule)["gyro_bias"] for rule in (NOW, BY_FEW))
        assert 0.5 < now / few < 0.85
    assert compared(scan(0.0)["effects"][0], (0, 1, 2), "sand", BY_FEW).degrees == pytest.approx(6.0)


def test_a_change_is_an_alarm_of_its_effect():
    assert surest(scan(0.5), (0, 1, 2), NOW)[0] > 0.05
    probability, name = surest(scan(5.0), (0, 1, 2), NOW)
    assert probability < 0.01
    assert name == "gyro_bias"


def test_figures_count_every_choice_of_drives_and_leave_refused_ones_out(tmp_path):
    found = figures([scan(0.0), scan(9.0), {"drive": "b", "ground": "", "refused": "too short"}])
    assert [found[count][NOW]["alarms"]["count"] for count in ("2", "3", "4", "5")] == [20, 20, 10, 2]
    assert found["5"][NOW]["alarms"]["value"] == 0.5
    assert found["5"][NOW]["of"] == ["a: gyro_bias"]
    assert np.isfinite(list(found["3"][BY_FEW]["least"].values())).all()
    draw(found, tmp_path / "drives.png")
    assert (tmp_path / "drives.png").stat().st_size > 10_000
