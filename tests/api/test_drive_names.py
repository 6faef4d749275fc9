"""Names of several drives are told apart, whatever they are called."""

from __future__ import annotations

from pathlib import Path

from ddagr_gym.api.drive_names import names_apart

RECORDING = object()


def test_names_of_their_own_stay():
    assert names_apart(["a.csv", "b.csv"], [Path("x/one.parquet"), Path("y/one.parquet")]) == ["a.csv", "b.csv"]


def test_names_that_are_alike_get_folders_or_else_a_number():
    assert names_apart(["run.csv"] * 2, [Path("monday/run.csv"), Path("tuesday/run.csv")]) == [
        "monday/run.csv", "tuesday/run.csv",
    ]  # fmt: skip
    assert names_apart(["run.csv"] * 3, [RECORDING] * 3) == ["run.csv", "run.csv (2)", "run.csv (3)"]


def test_files_that_were_imported_from_one_name_have_their_own():
    assert names_apart(["run.bag"] * 2, [Path("x/a.parquet"), Path("x/b.parquet")]) == ["a.parquet", "b.parquet"]
