"""Altered real drives: each change alters its own columns by what it says; scoring; resuming; the picture."""

from __future__ import annotations

import json
import math
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from benchmarks import altered_drives
from benchmarks.altered_changes import (
    CHANGES,
    CONTINUOUS,
    CONTROL,
    DRIVES,
    IN_STEPS,
    LATE_POSES,
    LATE_SENSORS,
    SCALE,
    TILTED,
    TURNED,
    Change,
    Layout,
    Table,
    layout_of,
    numbers,
    packed,
    read_table,
    rows_before,
)
from benchmarks.altered_drives import RESULT, covered, detectable, figures, main, scored, with_own
from benchmarks.altered_figure import draw, outcome
from benchmarks.answers import run_diagnoses
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects.registry import effect_kind
from ddagr_gym.recordings.load import load_recording
from ddagr_gym.reporting import palette

BY_NAME = {change.name: change for change in CHANGES}
LIMITS = {"pose_latency": {"latency": 0.6}, "encoder_scale": {"right": 0.5, "left": None}}


def in_steps() -> Table:
    """Two steps of three windows of two seconds; the readings are random."""
    rng = np.random.default_rng(3)
    count = 240
    place = np.arange(count) % 120
    table = {name: [f"{value:.9g}" for value in rng.normal(size=count)] for name in _columns(IN_STEPS)}
    table |= {
        "seq": [str(row // 120) for row in range(count)],
        "calib_step": ["0"] * count,
        "window": [str(row // 40) for row in place],
        "t": [f"{0.05 * row:.9g}" for row in place],
        "phase": ["steady"] * count,
    }
    return table


def continuous() -> Table:
    """Twenty seconds with a jitter of five per cent of the period."""
    rng = np.random.default_rng(4)
    count = 400
    table = {name: [f"{value:.9g}" for value in rng.normal(size=count)] for name in _columns(CONTINUOUS)}
    stamps = 0.05 * np.arange(count) + rng.uniform(-0.0025, 0.0025, count)
    table |= {
        "t": [f"{value:.9g}" for value in stamps],
        "calib_state": ["idle"] * 100 + ["calib"] * 300,
        "calib_step": ["1"] * count,
        "icp_new": [str(int(row % 3 == 0)) for row in range(count)],
    }
    return table


def _columns(form: Layout) -> list[str]:
    names = (*form.commands, *form.encoders, *form.pose, *form.accelerometer, *form.gyro)
    return [name for name in names if name]


TABLES = {"in steps": in_steps(), "continuous": continuous()}


def altered(table: Table, name: str) -> tuple[Table, set[str]]:
    """Altered columns, and the names of those that differ."""
    found = BY_NAME[name].write(table)
    assert list(found) == list(table)
    return found, {column for column in table if list(found[column]) != list(table[column])}


@pytest.fixture(params=TABLES)
def table(request: pytest.FixtureRequest) -> Table:
    """A drive of each form."""
    return TABLES[request.param]


def test_the_control_is_the_drive_itself(table: Table) -> None:
    assert altered(table, "nothing")[1] == set()


def test_every_change_is_an_effect_of_the_library_in_its_range() -> None:
    for change in CHANGES[1:]:
        kind = effect_kind(change.effect)
        assert bool(change.truth) != kind.categorical
        for name, value in change.truth.items():
            about = kind.parameter(name).metadata
            assert about["low"] <= value <= about["high"]
            assert abs(value - about["neutral"]) >= about["least"]


def test_poses_are_those_of_half_a_second_ago_and_nothing_else_changes(table: Table) -> None:
    found, changed = altered(table, "late_poses")
    assert changed == set(layout_of(table).pose)
    last = len(table["t"]) - 1
    before = last - round(LATE_POSES / 0.05)
    for name in layout_of(table).pose:
        assert found[name][last] == table[name][before]
        # before the first late sample the log repeats the first one
        assert found[name][:10] == [table[name][0]] * 10


def test_sensors_lag_and_commands_do_not(table: Table) -> None:
    found, changed = altered(table, "late_sensors")
    columns = layout_of(table)
    assert changed == set(table) - set(columns.commands)
    rows, gyro = round(LATE_SENSORS / 0.05), columns.gyro[2]
    assert found[gyro][-1] == table[gyro][-1 - rows]
    assert found[gyro][:rows] == [""] * rows
    encoder = columns.encoders[0]
    assert found[encoder][:rows] == [table[encoder][0]] * rows


def test_a_clock_shift_stays_inside_its_step_and_counts_the_joins() -> None:
    table = TABLES["in steps"]
    before = rows_before(table, 0.5)
    assert set(before[:10]) == set(before[120:130]) == {-1}
    assert before[10] == 0
    assert before[130] == 120
    # 50 ms are missing between the windows: the row at 2.2 s was written 2.25 s after the start, 0.5 s after row 35
    assert before[44] == 35
    assert before[55] == 45


def test_jitter_moves_no_row() -> None:
    before = rows_before(TABLES["continuous"], 0.5)
    assert np.array_equal(before[10:], np.arange(390))


@pytest.mark.parametrize("name", ["encoders_scaled", "encoders_doubled"])
def test_both_encoders_are_scaled(table: Table, name: str) -> None:
    found, changed = altered(table, name)
    assert changed == set(layout_of(table).encoders)
    for side, column in zip(("left", "right"), layout_of(table).encoders, strict=True):
        ratio = numbers(found, column) / numbers(table, column)
        np.testing.assert_allclose(ratio, BY_NAME[name].truth[side], rtol=1e-8)


@pytest.mark.parametrize(("name", "factor"), [("gyro_scaled", SCALE), ("gyro_reversed", -1.0)])
def test_the_yaw_rate_alone_is_scaled(table: Table, name: str, factor: float) -> None:
    found, changed = altered(table, name)
    column = layout_of(table).gyro[2]
    assert changed == {column}
    np.testing.assert_allclose(numbers(found, column), factor * numbers(table, column), rtol=1e-8)


@pytest.mark.parametrize("name", ["imu_turned", "imu_quarter_turn"])
def test_a_turned_imu_reads_the_same_vector_in_its_own_axes(table: Table, name: str) -> None:
    found, changed = altered(table, name)
    x, y, z = layout_of(table).accelerometer
    assert {x, y} <= changed <= {x, y, *layout_of(table).gyro[:2]}
    before, after = (numbers(each, x) + 1j * numbers(each, y) for each in (table, found))
    # axes turned counter-clockwise see the vector turned clockwise
    np.testing.assert_allclose(after, before * np.exp(-1j * BY_NAME[name].truth["yaw"]), atol=1e-7)
    assert found[z] == table[z]


def test_gravity_leaks_backwards_into_an_imu_that_hangs_forward() -> None:
    table = dict(TABLES["continuous"])
    count = len(table["t"])
    table |= {"acc_x": ["0"] * count, "acc_y": ["0"] * count, "acc_z": ["9.81"] * count, "gyro_x": ["0"] * count}
    found, _ = altered(table, "imu_tilted")
    np.testing.assert_allclose(numbers(found, "acc_x"), -9.81 * math.sin(TILTED), rtol=1e-7)
    np.testing.assert_allclose(numbers(found, "acc_z"), 9.81 * math.cos(TILTED), rtol=1e-7)
    np.testing.assert_allclose(numbers(found, "gyro_z"), math.cos(TILTED) * numbers(table, "gyro_z"), rtol=1e-7)
    assert found["acc_y"] == table["acc_y"]


@pytest.mark.parametrize("name", ["imu_turned", "imu_tilted", "encoders_scaled", "gyro_scaled", "gyro_reversed"])
def test_a_change_of_readings_has_the_sign_of_the_effect_in_the_library(name: str) -> None:
    change = BY_NAME[name]
    table = {column: ["0"] for column in _columns(CONTINUOUS)}
    table |= {"acc_x": ["0.7"], "acc_y": ["-0.4"], "acc_z": ["9.81"], "gyro_z": ["0.9"], "t": ["0"]}
    table |= {"enc_right": ["3"], "enc_left": ["2"]}
    found = change.write(table)
    read = [float(found[column][0]) for column in ("acc_x", "acc_y", "gyro_z", "enc_right", "enc_left")]
    np.testing.assert_allclose(read, _by_library(change, [0.7, -0.4, 0.9, 3.0, 2.0]), atol=1e-7)


def _by_library(change: Change, readings: list[float]) -> list[float]:
    """Readings as the effect of the library alters them."""
    values = {"roll": 0.0, **change.truth} if change.effect == "imu_tilt" else change.truth
    effect = effect_kind(change.effect)(**values)
    row = np.zeros(layout.SIZE)
    row[layout.READING : layout.READING + 5] = readings
    row[layout.GRAVITY + 2] = -9.81
    for point, action in effect.acting:
        assert point == layout.POINT_READINGS
        action(row, effect.vector(), np.zeros(layout.EFFECT_MEMORY))
    return [float(value) for value in row[layout.READING : layout.READING + 5]]


def test_the_first_steps_of_a_drive_are_read_and_written_as_they_were(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv.gz"
    path.write_bytes(packed(TABLES["in steps"]))
    assert read_table(path) == dict(TABLES["in steps"])
    assert set(read_table(path, steps=1)["seq"]) == {"0"}
    assert packed(read_table(path)) == path.read_bytes()


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: change.name)
def test_altered_files_are_recordings(change: Change, table: Table, tmp_path: Path) -> None:
    path = tmp_path / "drive.csv.gz"
    path.write_bytes(packed(change.write(table)))
    recording = load_recording(path, None, "warthog")
    assert len(recording) == len(table["t"])
    assert recording.has("encoder_right", "yaw_rate", "specific_force_x", "pose_x")


@pytest.mark.parametrize("drive", DRIVES)
def test_the_open_drives_have_the_columns_that_are_altered(drive: str, shared_dir: Path) -> None:
    path = shared_dir / "recordings" / "open" / f"{drive}.csv.gz"
    if not path.is_file():
        pytest.skip(f"{path.name} is not at hand")
    table = read_table(path)
    for change in CHANGES[1:]:
        assert altered(table, change.name)[1]


def an_answer(verdict: list[str], found: dict[str, tuple[float, list[float]]] | None = None) -> dict[str, Any]:
    """Answer that names effects with one size and its interval each."""
    findings = [
        {
            "name": name,
            "parameters": {"latency": {"value": value, "interval": interval, "unit": "s"}},
            "equivalence_set": {name: 0.6, "sensor_hold": 0.4},
        }
        for name, (value, interval) in (found or {}).items()
    ]
    return {
        "verdict": verdict,
        "complete": verdict != ["unknown"],
        "findings": findings,
        "detectable": LIMITS,
        "seconds": 60.0,
        "commit": "c",
        "options": ["--names-only"],
        "suspects": [],
    }


NONE = an_answer(["none"])


def test_a_right_name_with_its_size() -> None:
    case = scored("d", BY_NAME["late_poses"], an_answer(["pose_latency"], {"pose_latency": (0.55, [0.4, 0.6])}), NONE)
    assert case["right"]
    assert case["named"]
    assert case["in_set"]
    assert case["covered"] == {"latency": True}
    assert case["found"]["pose_latency"]["latency"]["value"] == 0.55
    assert outcome(case) == (palette.GREEN, "pose latency\n0.55")


def test_a_name_among_others_is_not_right_and_one_in_the_set_not_named() -> None:
    both = {"pose_latency": (0.5, [0.4, 0.6]), "slope": (0.1, [0.0, 0.2])}
    among = scored("d", BY_NAME["late_poses"], an_answer(list(both), both), NONE)
    assert (among["right"], among["named"], among["in_set"]) == (False, True, True)
    change = Change("held", "held", "sensor_hold", {"duration": 0.5})
    inside = scored("d", change, an_answer(["pose_latency"], {"pose_latency": (0.5, [0.4, 0.6])}), NONE)
    assert (inside["named"], inside["in_set"], inside["covered"]) == (False, True, {})
    assert outcome(inside)[0] == outcome(among)[0] == palette.SKY_BLUE


def test_misses_are_told_apart() -> None:
    change = BY_NAME["gyro_reversed"]
    wrong = scored("d", change, an_answer(["pose_latency"], {"pose_latency": (0.5, [0.4, 0.6])}), NONE)
    failed = scored("d", change, an_answer([]) | {"failure": {"exit_code": 2, "message": "m"}}, NONE)
    cases = [wrong, failed, *(scored("d", change, an_answer([name]), NONE) for name in ("unknown", "none"))]
    assert not any(case["right"] or case["in_set"] for case in cases)
    colours = [outcome(case)[0] for case in cases]
    assert colours == [palette.ORANGE, palette.VERMILLION, palette.PALE_ORANGE, palette.PALE]


def test_the_drives_own_size_counts_where_the_control_names_it() -> None:
    control = an_answer(["pose_latency"], {"pose_latency": (0.12, [0.1, 0.2])})
    assert with_own(BY_NAME["late_poses"], control) == {"latency": pytest.approx(LATE_POSES + 0.12)}
    assert with_own(BY_NAME["late_poses"], NONE) == {"latency": LATE_POSES}
    assert with_own(BY_NAME["imu_turned"], control) == {"yaw": TURNED}
    answer = an_answer(["pose_latency"], {"pose_latency": (0.5, [0.4, 0.55])})
    assert covered("pose_latency", with_own(BY_NAME["late_poses"], control), answer) == {"latency": False}


def test_what_can_be_shown_is_what_the_control_states() -> None:
    assert detectable(CONTROL, NONE) is None
    assert detectable(BY_NAME["gyro_reversed"], NONE) is True
    assert detectable(BY_NAME["late_poses"], NONE) is False
    # distance from one, not from zero
    assert detectable(BY_NAME["encoders_scaled"], NONE) is False
    assert detectable(BY_NAME["encoders_doubled"], NONE) is True


def test_figures_count_controls_and_changes_apart() -> None:
    named = an_answer(["pose_latency"], {"pose_latency": (0.5, [0.4, 0.45])})
    cases = [
        scored("a", CONTROL, NONE, NONE),
        scored("b", CONTROL, named, NONE),
        scored("a", BY_NAME["late_poses"], named, NONE),
        scored("a", BY_NAME["gyro_reversed"], NONE | {"suspects": ["gyro_sign"]}, NONE),
    ]
    found = figures(cases)
    assert (found["controls_not_none"]["value"], found["controls_not_none"]["count"]) == (0.5, 2)
    assert (found["right_all"]["value"], found["right_all"]["count"]) == (0.5, 2)
    assert (found["right_detectable"]["value"], found["right_detectable"]["count"]) == (0.0, 1)
    assert found["suspected_by_checks_all"]["value"] == 0.5
    assert found["coverage"] == figures(cases[2:3])["coverage"]
    assert found["coverage"]["value"] == 0.0
    assert [case["change"] for case in found["failures"]] == ["nothing", "gyro_reversed"]


@pytest.fixture
def drives(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Folder of drives, and the commands that would have been run; each finds nothing."""
    folder = tmp_path / "recordings" / "open"
    folder.mkdir(parents=True)
    for name in DRIVES:
        (folder / f"{name}.csv.gz").write_bytes(packed(TABLES["continuous" if "grass" in name else "in steps"]))
    monkeypatch.setenv("DDAGR_RECORDINGS", str(tmp_path / "recordings"))
    commands: list[list[str]] = []

    def run(command: list[str], limit: float) -> subprocess.CompletedProcess[str]:
        commands.append(command)
        output = Path(command[command.index("--output") + 1])
        output.mkdir()
        (output / "diagnosis.json").write_text(json.dumps(NONE))
        return subprocess.CompletedProcess(command, 0, "", "")

    suspicion = SimpleNamespace(suspects=("gyro_sign",))
    monkeypatch.setattr(run_diagnoses, "_run", run)
    monkeypatch.setattr(altered_drives, "check_recording", lambda *_: SimpleNamespace(suspicious=(suspicion,)))
    return commands


def test_cases_are_run_once_written_and_drawn(drives: list[list[str]], tmp_path: Path) -> None:
    words = ["--output", str(tmp_path / "altered.json"), "--parts", str(tmp_path / "parts"), "--limit", "4"]
    assert main(words) == 0
    result = json.loads((tmp_path / "altered.json").read_text())
    assert [(case["drive"], case["change"]) for case in result["cases"]] == [
        *((drive, "nothing") for drive in DRIVES),
        (DRIVES[0], "late_poses"),
    ]
    assert result["controls_not_none"]["value"] == 0.0
    assert result["right_all"]["count"] == len(result["failures"]) == 1
    assert all(case["suspects_of_checks"] == ["gyro_sign"] for case in result["cases"])
    assert (tmp_path / "altered.png").stat().st_size > 10_000
    assert all("--names-only" in command and "--stride" in command for command in drives)
    assert main(words) == 0
    assert len(drives) == 4


def test_finished_cases_are_run_again_with_another_bank(
    drives: list[list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ["--output", str(tmp_path / "altered.json"), "--limit", "1"]
    results = []
    for content in ("{}", "{ }", "{ }"):
        (tmp_path / "bank.json").write_text(content)
        monkeypatch.setattr(altered_drives, "REAL_BANK", tmp_path / "bank.json")
        assert main(words) == 0
        results.append(json.loads((tmp_path / "altered.json").read_text())["bank_sha256"])
    assert len(drives) == len(set(results)) == 2


def test_an_interrupted_run_writes_no_result(
    drives: list[list[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(run_diagnoses, "_run", lambda command, limit: subprocess.CompletedProcess(command, 130, "", ""))
    assert main(["--output", str(tmp_path / "altered.json")]) == 130
    assert not (tmp_path / "altered.json").exists()
    assert "goes on from" in capsys.readouterr().err


def test_without_the_drives_nothing_is_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DDAGR_RECORDINGS", str(tmp_path))
    assert main(["--output", str(tmp_path / "altered.json")]) == 2
    assert list(tmp_path.iterdir()) == []


def test_the_committed_result_is_of_these_changes(tmp_path: Path) -> None:
    if not RESULT.is_file():
        pytest.skip("no result is committed: run python -m benchmarks.altered_drives")
    result = json.loads(RESULT.read_text())
    cases = result["cases"]
    assert {(case["drive"], case["change"]) for case in cases} == {(d, c.name) for d in DRIVES for c in CHANGES}
    assert all(case["written"] == dict(BY_NAME[case["change"]].truth) for case in cases)
    assert {name: result[name] for name in figures(cases)} == figures(cases)
    draw(cases, tmp_path / "again.png")
