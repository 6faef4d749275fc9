"""Thresholds let the stated share of null runs pass, over the whole library."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ddagr_gym.diagnosis.gates.threshold_files import (
    default_thresholds,
    load_thresholds,
    save_thresholds,
    shipped_thresholds,
    usual_thresholds,
)
from ddagr_gym.diagnosis.gates.thresholds import (
    GROUND_MARGIN,
    MARGIN,
    MISFIT_MARGIN,
    NOISE_GAIN,
    UNMISTAKABLE,
    Gate,
    NullRun,
    Origin,
    Thresholds,
    false_alarms,
    thresholds_from,
)
from ddagr_gym.errors import InputError
from ddagr_gym.identification.nuisances import LOCAL
from ddagr_gym.physics.effects.registry import absolute_effect_kinds

NAMES = ("slope", "payload", "motor_lag", "gyro_bias")


def null_runs(count: int, seed: int) -> list[NullRun]:
    rng = np.random.default_rng(seed)
    runs = []
    for _ in range(count):
        gains = dict(zip(NAMES, rng.chisquare(2, len(NAMES)) * np.array([4.0, 12.0, 4.0, 4.0]), strict=True))
        same = dict.fromkeys(NAMES, 10.0)
        runs.append(NullRun("plain", gains, same, same, {"yaw_rate": float(rng.uniform(0.8, 1.2))}))
    return runs


def test_false_alarms_over_the_library_are_at_the_level() -> None:
    thresholds = thresholds_from(null_runs(2000, 1), "x", level=0.05)
    fresh = null_runs(2000, 2)
    margins = dict(zip(NAMES, (GROUND_MARGIN, GROUND_MARGIN, MARGIN, MARGIN), strict=True))
    alarms = np.mean([any(run.gains[n] * margins[n] > thresholds.of(n).gain for n in NAMES) for run in fresh])
    assert alarms == pytest.approx(0.05, abs=0.02)
    assert thresholds.of("slope").gain >= GROUND_MARGIN * NOISE_GAIN
    assert thresholds.of("gyro_bias").gain == pytest.approx(
        thresholds.of("slope").gain * MARGIN / GROUND_MARGIN, rel=0.2
    )
    assert thresholds.of("payload").gain > 1.5 * thresholds.of("slope").gain
    assert 1.15 < thresholds.misfit["yaw_rate"] / MISFIT_MARGIN < 1.25


def test_false_alarms_of_other_thresholds_are_counted() -> None:
    runs = null_runs(400, 3)
    own = thresholds_from(runs, "x", level=0.05)
    assert false_alarms(runs, own) <= 20
    lower = replace(own, gates={name: Gate(0.2 * gate.gain, 0.0) for name, gate in own.gates.items()})
    assert 40 < false_alarms(runs, lower) < 300
    unseen = [replace(run, held_out=dict.fromkeys(NAMES, -1.0)) for run in runs]
    assert 0 < false_alarms(unseen, lower) < 0.8 * false_alarms(runs, lower)


def test_a_robot_without_a_bank_has_that_of_the_ddagr() -> None:
    assert usual_thresholds("husky") == default_thresholds("ddagr")
    assert usual_thresholds("warthog") == shipped_thresholds("warthog")


def test_gains_of_sizes_that_do_not_matter_count_less() -> None:
    runs = [replace(run, gains=run.gains | {"payload": 100.0}) for run in null_runs(40, 1)]
    strict = thresholds_from(runs, "x")
    small = thresholds_from([replace(run, meaningless=("payload",)) for run in runs], "x")
    assert strict.of("payload").gain == pytest.approx(UNMISTAKABLE * small.of("payload").gain, rel=1e-6)


def test_further_effects_have_raised_gates() -> None:
    thresholds = thresholds_from(null_runs(40, 1), "x")
    raised = thresholds.raised({"slope": 12.0})
    assert raised.of("slope").gain == pytest.approx(12.0 + thresholds.of("slope").gain)
    assert raised.of("slope").held_out == thresholds.of("slope").held_out
    assert raised.of("payload") == thresholds.of("payload")


def test_p_value_counts_null_runs_that_stand_as_high() -> None:
    thresholds = thresholds_from(null_runs(99, 1), "x")
    assert thresholds.p_value("slope", 1e9) == pytest.approx(0.01)
    assert thresholds.p_value("slope", 0.0) == pytest.approx(1.0)
    middle = thresholds.p_value("slope", float(np.median(thresholds.maxima)) * thresholds.of("slope").gain)
    assert middle == pytest.approx(0.5, abs=0.03)


def test_what_structure_adds_to_the_gates_goes_with_the_length() -> None:
    runs = [replace(run, windows=30, duration=4.0) for run in null_runs(40, 1)]
    thresholds = thresholds_from(runs, "x")
    assert thresholds.for_length(120.0).gates == thresholds.gates
    for seconds in (40.0, 360.0):
        other = thresholds.for_length(seconds)
        beyond = thresholds.of("slope").gain - NOISE_GAIN
        assert other.of("slope").gain == pytest.approx(NOISE_GAIN + seconds / 120.0 * beyond)
        assert other.misfit == thresholds.misfit


def test_windows_of_unequal_length_cover_their_median_time() -> None:
    long, short = ([replace(run, windows=w, duration=d) for run in null_runs(n, n)] for w, d, n in
                   ((8, 6.0, 22), (12, 2.5, 18)))  # fmt: skip
    thresholds = thresholds_from([*long, *short], "x")
    assert thresholds.duration == 6.0
    assert thresholds.for_length(48.0).gates == thresholds.gates


def test_long_null_runs_count_by_what_they_reach_for_their_length() -> None:
    runs = [replace(run, windows=10, duration=6.0) for run in null_runs(40, 1)]
    raised = dict.fromkeys(runs[0].gains, NOISE_GAIN + 50.0)
    short = thresholds_from([*runs, *(replace(run, gains=raised) for run in runs[:10])], "x")
    twice = dict.fromkeys(raised, NOISE_GAIN + 100.0)
    longer = [replace(run, gains=twice, windows=20, held_out={}) for run in runs[:10]]
    long = thresholds_from([*runs, *longer], "x")
    assert long.duration * long.windows == short.duration * short.windows == 60.0
    assert long.of("slope").gain == pytest.approx(short.of("slope").gain)


def test_runs_that_share_their_time_with_others_are_no_further_evidence() -> None:
    runs = null_runs(40, 1)
    thresholds = thresholds_from([*runs, *(replace(run, own=False) for run in runs)], "x")
    assert (thresholds.nulls, len(thresholds.maxima)) == (40, 40)
    with pytest.raises(InputError, match="at least 20"):
        thresholds_from([*runs[:19], *(replace(run, own=False) for run in runs[19:])], "x")


def test_runs_of_unknown_length_say_nothing_about_lengths() -> None:
    known = [replace(run, windows=30, duration=4.0) for run in null_runs(40, 1)]
    thresholds = thresholds_from([*known, *null_runs(41, 1)], "x")
    assert thresholds.windows * thresholds.duration == pytest.approx(120.0)
    assert thresholds.of("slope").gain == pytest.approx(thresholds_from(known, "x").of("slope").gain, rel=0.3)


def test_what_few_windows_carry_must_be_clear() -> None:
    thresholds = Thresholds({"slope": Gate(10.0, 0.0)}, {}, 20, "x")
    few, many = SimpleNamespace(held_out={"slope": -5.0}), SimpleNamespace(held_out={"slope": 5.0})
    assert [thresholds.passes("slope", gain, few) for gain in (9.0, 11.0, 21.0)] == [False, False, True]
    assert [thresholds.passes("slope", gain, many) for gain in (9.0, 11.0, 21.0)] == [False, True, True]


def test_a_bank_ships_for_the_thesis_robot() -> None:
    thresholds = default_thresholds("ddagr")
    assert thresholds.nulls >= 60
    assert set(absolute_effect_kinds()) - {"sensor_hold"} <= set(thresholds.gates)
    assert set(LOCAL) <= set(thresholds.misfit)
    with pytest.raises(InputError, match="null-bank"):
        default_thresholds("nobody")


def test_too_few_runs_are_refused() -> None:
    with pytest.raises(InputError, match="at least 20"):
        thresholds_from(null_runs(19, 1), "x")


def test_file_returns_what_was_saved(tmp_path: Path) -> None:
    thresholds = thresholds_from(null_runs(40, 1), "abc")
    save_thresholds(thresholds, tmp_path / "t.json")
    assert load_thresholds(tmp_path / "t.json") == thresholds
    (tmp_path / "bad.json").write_text("{}")
    with pytest.raises(InputError, match="null-bank"):
        load_thresholds(tmp_path / "bad.json")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b'{"version": 1}', "has no entry 'gates'"),
        (b'{"version": 1, "gates": []}', "has an entry of another form"),
        (b'{"version": 1, "gates": {"slope": {"gain": 1.0}}}', "has an entry of another form"),
        (b"\x89PNG\r\n\xff\xfe", "cannot be read as thresholds"),
        (b"[1]", "is not a thresholds file"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, content: bytes, said: str) -> None:
    (tmp_path / "bad.json").write_bytes(content)
    with pytest.raises(InputError, match=rf"bad\.json {said}.*null-bank"):
        load_thresholds(tmp_path / "bad.json")


def test_saving_takes_no_other_file_for_its_own(tmp_path: Path) -> None:
    (tmp_path / ".t.json.part").write_text("of another process")
    save_thresholds(thresholds_from(null_runs(40, 1), "abc"), tmp_path / "t.json")
    assert sorted(path.name for path in tmp_path.iterdir()) == [".t.json.part", "t.json"]


ORIGIN = Origin("warthog", "firm_ground", 4.0, 3, "ordinary")


def test_file_returns_the_origin(tmp_path: Path) -> None:
    thresholds = thresholds_from(null_runs(40, 1), "abc", origin=ORIGIN)
    save_thresholds(thresholds, tmp_path / "t.json")
    assert load_thresholds(tmp_path / "t.json").origin == ORIGIN
    assert thresholds.raised({}).for_length(60.0).origin == ORIGIN


def with_origin(path: Path, entry: object) -> Path:
    """File of thresholds with an entry in place of its origin."""
    save_thresholds(thresholds_from(null_runs(40, 1), "abc", origin=ORIGIN), path)
    path.write_text(json.dumps(json.loads(path.read_text()) | {"origin": entry}))
    return path


def test_file_without_an_origin_loads(tmp_path: Path) -> None:
    path = with_origin(tmp_path / "t.json", None)
    assert load_thresholds(path).origin is None
    body = json.loads(path.read_text())
    del body["origin"]
    path.write_text(json.dumps(body))
    assert load_thresholds(path).origin is None


GOOD = {"robot": "warthog", "soil": "firm_ground", "soil_uncertainty": 4, "seed": 3, "kind": "ordinary"}


@pytest.mark.parametrize(
    "entry",
    [
        "warthog",
        [],
        {},
        {"robot": "warthog"},
        GOOD | {"more": 1},
        GOOD | {"robot": None},
        GOOD | {"seed": "3"},
        GOOD | {"soil_uncertainty": "4"},
        GOOD | {"kind": "drawn"},
    ],
)
def test_malformed_origin_is_refused(tmp_path: Path, entry: object) -> None:
    assert load_thresholds(with_origin(tmp_path / "good.json", GOOD)).origin == ORIGIN
    with pytest.raises(InputError, match=r"origin in .*bad\.json .*null-bank"):
        load_thresholds(with_origin(tmp_path / "bad.json", entry))


@pytest.mark.parametrize(
    ("run", "said"),
    [
        (("husky", "firm_ground", 4.0), "robot warthog instead of husky"),
        (("warthog", "thesis_a1", 4.0), "soil firm_ground instead of thesis_a1"),
        (("warthog", "firm_ground", 1.0), "soil uncertainty 4 instead of 1"),
        (("husky", "firm_ground", 1.5), "robot warthog instead of husky, soil uncertainty 4 instead of 1.5"),
    ],
)
def test_mismatch_says_both_values_and_the_remedy(run: tuple[str, str, float], said: str) -> None:
    warning = ORIGIN.mismatch(*run)
    assert f" made for {said}: " in warning
    robot, soil, soil_uncertainty = run
    options = f"--robot {robot} --soil {soil} --soil-uncertainty {soil_uncertainty:g}"
    remedy = f"ddagr null-bank RUN... {options} --output BANK.json`"
    assert remedy in warning


def test_match_says_nothing() -> None:
    assert ORIGIN.mismatch("warthog", "firm_ground", 4) == ""


def test_shipped_banks_say_what_they_were_made_for() -> None:
    found = [thresholds.origin for robot in ("ddagr", "warthog") if (thresholds := shipped_thresholds(robot))]
    assert found == [
        Origin("ddagr", "thesis_a1", 1.0, 0, "simulated"),
        Origin("warthog", "firm_ground", 4.0, 0, "simulated"),
    ]
