"""What ``calibrate`` hands to the fit."""

from __future__ import annotations

import numpy as np
import pytest

import ddagr_gym
from ddagr_gym.calibration import run


@pytest.fixture(scope="module")
def drives():
    commands = np.repeat(np.random.default_rng(0).uniform(-1.5, 1.5, (3, 24, 2)), 60, axis=1)
    made = [ddagr_gym.simulate(own, rate=20.0, pose_rate=5.0).recording for own in commands]
    metas = (("c", 5.0), ("a", 9.0), ("b", 5.0))
    return [r.with_meta(source=name, start_time=start) for r, (name, start) in zip(made, metas, strict=True)]


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 2, 0)])
def test_the_order_in_which_drives_are_given_does_not_matter(drives, order, monkeypatch):
    handed = []

    def fit(recordings, grounds, *rest, **options):
        handed.append(([recording.meta.source for recording in recordings], list(grounds)))

    monkeypatch.setattr(run, "calibrate_drives", fit)
    given = [drives[number] for number in order]
    ddagr_gym.calibrate(given, "ddagr", "thesis_a1", {"yard": [drives[0]], "field": [drives[1], drives[2]]})
    assert handed == [(["b", "c", "a"], ["field", "yard", "field"])]
