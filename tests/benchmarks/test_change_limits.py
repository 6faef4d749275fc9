"""Questions about pieces of real drives and small delays, and the score of their answers."""

from __future__ import annotations

import pytest

from benchmarks.change_limits import DELAYS, KNOWN, UNKNOWN, draw, figures, late_by, piece_numbers


def in_steps(*steps: int) -> dict[str, list[str]]:
    return {"seq": [str(step) for step in steps], "t": ["0"] * len(steps)}


def answer(change: str, verdict: str, ground: str, piece: int | None = None, truth: str = "none") -> dict:
    names = [] if verdict in ("none", "unknown") else [[verdict]]
    return {
        "change": change, "truth": truth, "ground": ground, "verdict": [verdict], "complete": True, "sets": names,
        "piece": piece,
    }  # fmt: skip


def test_pieces_of_a_drive_in_steps_hold_fifteen_of_them():
    assert piece_numbers(in_steps(0, 14, 15, 29)).tolist() == [0.0, 0.0, 1.0, 1.0]


def test_what_is_left_at_the_end_is_no_piece():
    assert piece_numbers(in_steps(0, 14, 15, 28)).tolist() == [0.0, 0.0, -1.0, -1.0]
    assert piece_numbers({"t": ["0", "89.9", "90.1", "170"]}).tolist() == [0.0, 0.0, -1.0, -1.0]


def test_a_name_or_unknown_in_a_piece_is_a_false_alarm():
    cases = [
        answer("nothing", "none", "sand", 0),
        answer("nothing", "unknown", "sand", 1),
        answer("nothing", "payload", "", 2),
        {"change": "nothing", "truth": "none", "piece": 3, "refused": "too short"},
    ]
    found = figures(cases)
    assert found["false alarms in pieces"]["count"] == 3
    assert found["false alarms in pieces"]["value"] == pytest.approx(2.0 / 3.0)
    assert found["sure and wrong in pieces"]["value"] == pytest.approx(1.0 / 3.0)


def test_delays_are_scored_by_what_is_said_of_the_ground():
    change, longer = late_by(0.15), late_by(0.3)
    cases = [
        answer(change.name, change.effect, "sand", truth=change.effect),
        answer(longer.name, "none", "", truth=longer.effect),
    ]
    found = figures(cases)
    assert found[f"delay of 0.15 s, ground {KNOWN}"]["value"] == 1.0
    assert found[f"delay of 0.3 s, ground {UNKNOWN}"]["value"] == 0.0
    assert {name for name in found if name.startswith("delay")} == {
        f"delay of {delay:g} s, ground {ground}" for ground, delays in DELAYS.items() for delay in delays
    }


def test_a_late_drive_has_its_readings_of_some_rows_before():
    table = {
        "seq": ["0"] * 5, "window": ["0"] * 5, "t": [f"{0.05 * k:.2f}" for k in range(5)], "calib_step": ["0"] * 5,
        "phase": ["steady"] * 5, "cmd_left": ["1"] * 5, "cmd_right": ["1"] * 5,
        "enc_left": list("abcde"), "imu_gz": list("ABCDE"),
    }  # fmt: skip
    written = late_by(0.1).write(table)
    assert written["enc_left"][2:] == ["a", "b", "c"]
    assert written["imu_gz"][2:] == ["A", "B", "C"]
    assert written["cmd_left"] == table["cmd_left"]


def test_the_picture_is_written(tmp_path):
    path = tmp_path / "limits.png"
    draw(figures([answer("nothing", "none", "sand", 0)]), path)
    assert path.stat().st_size > 5000
