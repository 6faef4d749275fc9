"""Cases of ruts and offset masses: their drives, counts and picture."""

import numpy as np
import pytest

from benchmarks import kept_ruts
from benchmarks.kept_ruts import CASES, OFFSET, RUTS, Truth, draw, drives, summary
from ddagr_gym.errors import InputError


def said(truth, *names, complete=True):
    """An answer that names these, each in a set of its own."""
    return {
        "case": truth.words, "truth": truth.names, "verdict": list(names) or ["none"], "complete": complete,
        "sets": [{name: 1.0} for name in names],
    }  # fmt: skip


def test_there_are_ruts_masses_and_both():
    assert [truth.names for truth in CASES].count([RUTS]) == 6
    assert [truth.names for truth in CASES].count([OFFSET]) == 4
    assert [truth.names for truth in CASES].count([RUTS, OFFSET]) == 2
    assert [truth.number for truth in CASES] == list(range(12))


def test_ruts_show_in_what_the_robot_records_and_the_drives_begin_alike():
    kept, plain = drives(Truth(0, 0.2))[1], drives(Truth(0))[1]
    np.testing.assert_array_equal(kept["command_right"], plain["command_right"])
    gap = np.abs(kept["yaw_rate"] - plain["yaw_rate"])
    assert np.nanmax(gap[:50]) < 1e-3 < np.nanmax(gap[50:])


def test_counts_tell_right_names_from_the_other_axle_effect(tmp_path):
    ruts, mass, both = CASES[0], CASES[6], CASES[-1]
    answers = [said(ruts, RUTS), said(ruts, OFFSET), said(ruts), said(mass, OFFSET), said(both, OFFSET, RUTS)]
    found = summary(answers)
    assert found["ruts"] == {
        "cases": 3, "named": 1, "in_set": 1, "nothing": 1, "other_axle_effect_without_it": 1,
    }  # fmt: skip
    assert found["offset_mass"]["named"] == found["offset_mass"]["cases"] == 1
    assert found["both_named"] == found["both"] == 1
    draw(answers, tmp_path / "picture.png")
    assert (tmp_path / "picture.png").stat().st_size > 5000


def test_a_cluster_needs_its_extra(tmp_path, monkeypatch):
    monkeypatch.setattr("ddagr_gym.extras.find_spec", lambda name: None)
    with pytest.raises(InputError, match="'ray', which is not installed"):
        kept_ruts.main(["--parts", str(tmp_path / "parts"), "--cluster", "local"])
    assert not (tmp_path / "parts").exists()
