"""Errors of sensitivities, and their picture."""

from __future__ import annotations

import json

import numpy as np
import pytest

from benchmarks.sensitivities import RESULT, WAYS, draw, errors


def test_errors_are_relative_and_by_window():
    accurate = np.ones((2, 3, 4, 5))
    accurate[1, 2] = 0.0  # changes nothing there
    found = accurate * np.array([1.1, 1.0])[:, None, None, None]
    found[0, 1] = 3.0
    off = errors(found, accurate)
    np.testing.assert_allclose(off[0], [0.1, 2.0, 0.1])
    np.testing.assert_allclose(off[1, :2], 0.0)
    assert np.isnan(off[1, 2])


def test_the_kept_result_says_that_following_is_faster_and_surer_and_is_drawn(tmp_path):
    table = json.loads(RESULT.read_text())["ways"]
    assert set(table) == {"accurate", *WAYS}
    for steps in ("25 ms", "50 ms"):
        anew, following = table[f"anew, steps of {steps}"], table[f"following, steps of {steps}"]
        assert following["seconds"] < 0.5 * anew["seconds"]
        assert following["of all"]["ninth in ten"] < 0.6 * anew["of all"]["ninth in ten"]
        assert following["of all"]["median"] == pytest.approx(anew["of all"]["median"], abs=0.01)
    draw(table, tmp_path / "picture.png")
    assert (tmp_path / "picture.png").stat().st_size > 10_000
