"""Altered real drives: each change alters its own columns by what it says."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from benchmarks.altered_changes import (
    BOTH_SIDES,
    CHANGES,
    CONTINUOUS,
    DRIVES,
    IN_STEPS,
    LATE_POSES,
    LATE_SENSORS,
    SCALE,
    TILTED,
    WEAKENED,
    Change,
    Layout,
    Table,
    layout_of,
    numbers,
    packed,
    read_table,
    rows_before,
)
from ddagr_gym.physics import layout
from ddagr_gym.physics.effects.registry import effect_kind
from ddagr_gym.recordings.load import load_recording

BY_NAME = {change.name: change for change in (*CHANGES, *BOTH_SIDES)}


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
    for change in (*CHANGES[1:], *BOTH_SIDES):
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


def test_commands_of_both_sides_are_scaled(table: Table) -> None:
    found, changed = altered(table, "both_commanded")
    assert changed == set(layout_of(table).commands[-2:])
    for column in changed:
        np.testing.assert_allclose(numbers(found, column), WEAKENED * numbers(table, column), rtol=1e-8)


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


@pytest.mark.parametrize("name", ["encoders_scaled", "encoders_doubled", "encoders_short"])
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
    for change in (*CHANGES[1:], *BOTH_SIDES):
        assert altered(table, change.name)[1]
