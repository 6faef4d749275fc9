"""Scores of what is said of changed drives, and the changes that only this benchmark writes."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.altered_changes import BIASED, WEAKENED, biased, encoders_exchanged, one_side_commanded
from benchmarks.what_changed import (
    ALL,
    coverage_of,
    draw,
    drives,
    figures,
    is_right,
    is_sure_and_wrong,
)

STEPS = {"seq": ["0", "0"], "cmd_left": ["1", "2"], "cmd_right": ["3", "4"], "enc_left": ["1", "2"],
         "enc_right": ["5", "6"], "imu_gz": ["0.1", ""]}  # fmt: skip
CONTINUOUS = {"t": ["0", "1"], "cmd_v": ["1", "2"], "cmd_w": ["0.5", "-0.5"], "gyro_z": ["0.1", "0.2"],
              "enc_left": ["1", "2"], "enc_right": ["5", "6"]}  # fmt: skip


def case(change: str, verdict: list[str], complete: bool = True, **others):
    return {
        "drive": "open/warthog_sand", "change": change, "truth": ALL[change].effect, "verdict": verdict,
        "complete": complete, "sets": [[name] for name in verdict if name not in ("none", "unknown")], "sizes": {},
        "checks": [], **others,
    }  # fmt: skip


def test_the_true_name_alone_or_in_a_small_set_is_right():
    assert is_right(case("gyro_scaled", ["gyro_scale"]))
    assert is_right(case("gyro_scaled", ["pose_latency"], sets=[["gyro_scale", "pose_latency"]]))
    assert not is_right(case("gyro_scaled", ["gyro_scale"], sets=[["a", "b", "c", "gyro_scale"]]))
    assert not is_right(case("gyro_scaled", ["gyro_scale", "payload"]))
    assert not is_right(case("gyro_scaled", ["none"]))
    assert is_right(case("nothing", ["none"]))
    assert not is_right({"truth": "gyro_scale", "change": "gyro_scaled", "refused": "too short"})


def test_what_is_no_effect_is_seen_in_the_values():
    assert ALL["encoders_exchanged"].effect == "encoders_exchanged"
    assert is_right(case("encoders_exchanged", ["encoders_exchanged"]))
    assert not is_right(case("encoders_exchanged", ["encoder_scale"]))


def test_a_complete_answer_with_another_name_is_sure_and_wrong():
    assert is_sure_and_wrong(case("gyro_scaled", ["payload"]))
    assert is_sure_and_wrong(case("nothing", ["payload"]))
    assert not is_sure_and_wrong(case("gyro_scaled", ["payload"], complete=False))
    assert not is_sure_and_wrong(case("gyro_scaled", ["payload"], sets=[["payload", "gyro_scale"]]))
    assert not is_sure_and_wrong(case("gyro_scaled", ["none"]))


def test_intervals_count_where_the_true_effect_has_one():
    held = case("gyro_scaled", ["gyro_scale"], sizes={"gyro_scale": {"scale": [1.09, 1.05, 1.12]}})
    missed = case("gyro_scaled", ["gyro_scale"], sizes={"gyro_scale": {"scale": [1.05, 1.04, 1.06]}})
    unstated = case("gyro_scaled", ["gyro_scale"], sizes={"gyro_scale": {"scale": [1.05, None, None]}})
    assert [coverage_of(item) for item in (held, missed, unstated)] == [[True], [False], []]
    found = figures([held, missed, case("nothing", ["none"])])
    assert found["intervals that hold the size"]["value"] == 0.5
    assert found["right or in a set of at most three"]["count"] == 2
    assert found["ordinary drives with a name or unknown"]["value"] == 0.0


def test_grounds_are_known_where_another_drive_was_on_them():
    found = {name: drive.ground for name, drive in drives().items()}
    assert found["open/warthog_sand"] == "sand"
    assert found["open/warthog_grass"] == ""


@pytest.mark.parametrize(("table", "name"), [(STEPS, "imu_gz"), (CONTINUOUS, "gyro_z")])
def test_a_biased_gyro_reads_more_in_every_sample(table, name):
    before = np.array([float(text) if text else np.nan for text in table[name]])
    after = np.array([float(text) if text else np.nan for text in biased({**table, name: texts_of(before)})[name]])
    np.testing.assert_allclose(after, before + BIASED)


def texts_of(values):
    return ["nan" if np.isnan(value) else str(value) for value in values]


def test_commands_of_one_side_are_scaled_in_either_layout():
    assert one_side_commanded(STEPS, 0.5)["cmd_right"] == [f"{3 * WEAKENED:.9g}", f"{4 * WEAKENED:.9g}"]
    found = one_side_commanded(CONTINUOUS, 0.5)
    v, w = (np.array([float(text) for text in found[name]]) for name in ("cmd_v", "cmd_w"))
    np.testing.assert_allclose(v - 0.5 * w, [0.75, 2.25])
    np.testing.assert_allclose(v + 0.5 * w, [WEAKENED * 1.25, WEAKENED * 1.75])


def test_exchanged_encoders_are_in_each_others_columns():
    found = encoders_exchanged(STEPS)
    assert (found["enc_left"], found["enc_right"]) == (STEPS["enc_right"], STEPS["enc_left"])


def test_the_picture_shows_every_case(tmp_path):
    cases = [case("nothing", ["none"]), case("gyro_scaled", ["payload"]), case("imu_tilted", ["unknown"], False)]
    draw([*cases, {"drive": "open/warthog_grass", "change": "imu_tilted", "truth": "imu_tilt", "refused": "short"}],
         tmp_path / "figure.png")  # fmt: skip
    assert (tmp_path / "figure.png").stat().st_size > 5000
