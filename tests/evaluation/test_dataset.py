"""Episodes as a Parquet dataset: what is written is read, by other tools too, and parts are whole or absent."""

from __future__ import annotations

import json
import math
import os

import pytest

pytest.importorskip("pyarrow", reason="needs the extra io")

from pyarrow import dataset as arrow_dataset
from pyarrow import parquet

from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.dataset import COLUMNS, MANIFEST, EpisodeDataset

VALUES = {"string": "x", "int64": 3, "double": 0.1 + 0.2, "bool": True}


def row(number, controller="B1", set_name="V", **changed):
    made = {name: VALUES[kind] for name, kind in COLUMNS.items()}
    return {"controller": controller, "set": set_name} | made | {"number": number} | changed


def test_rows_come_back_to_the_bit(tmp_path):
    rows = [row(0), row(1, radius_error=None, success=None), row(2, radius_error=math.nextafter(0.1, 1.0))]
    store = EpisodeDataset(tmp_path / "episodes")
    store.append(rows)
    assert store.read() == rows
    assert store.read(["number"]) == [{"controller": "B1", "set": "V", "number": n} for n in range(3)]


def test_names_of_controllers_may_be_paths(tmp_path):
    names = ["/home/me/my policy.zip", "ppo_ekf@true", "a=b%20c", "007"]
    store = EpisodeDataset(tmp_path / "episodes")
    store.append([row(0, name) for name in names])
    assert sorted(item["controller"] for item in store.read()) == sorted(names)
    # the reader of another project, with the paths as Hive has them
    table = arrow_dataset.dataset(tmp_path / "episodes", partitioning="hive").to_table()
    assert sorted(map(str, table["controller"].to_pylist())) == sorted(names)


def test_a_column_keeps_its_type_where_nothing_is_defined(tmp_path):
    store = EpisodeDataset(tmp_path / "episodes")
    store.append([row(0, radius_error=None)])
    store.append([row(1, radius_error=0.5)])
    assert {str(parquet.read_schema(part).field("radius_error").type) for part in store.parts()} == {"double"}


def test_the_same_rows_are_the_same_part(tmp_path):
    store = EpisodeDataset(tmp_path / "episodes")
    store.append([row(1), row(0)])
    store.append([row(0), row(1)])
    assert len(store.parts()) == 1


def test_rows_that_are_dropped_leave_the_others(tmp_path):
    store = EpisodeDataset(tmp_path / "episodes")
    store.append([row(0), row(1)])
    store.append([row(1, made_of="y"), row(2, made_of="y")])
    store.append([row(0, "B4", made_of="z")])
    other = [part for part in store.parts() if "B4" in str(part)]
    stamp = other[0].stat().st_mtime_ns
    store.keep(lambda item: item["made_of"] != "x")
    assert [(item["controller"], item["number"]) for item in store.read()] == [("B1", 1), ("B1", 2), ("B4", 0)]
    store.append([row(2, made_of="w")])
    store.keep(lambda item: True)
    assert sorted(item["number"] for item in store.read() if item["controller"] == "B1") == [1, 2]
    assert other[0].stat().st_mtime_ns == stamp


def test_the_manifest_says_what_is_there(tmp_path):
    store = EpisodeDataset(tmp_path / "episodes")
    store.append([row(0), row(1), row(0, set_name="S1")])
    store.append([row(2, made_of="y")])
    store.write_manifest()
    manifest = json.loads((tmp_path / "episodes" / MANIFEST).read_text())
    assert manifest["columns"] == COLUMNS
    assert manifest["partitions"] == [
        {"controller": "B1", "set": "S1", "rows": 1, "parts": 1, "made_of": ["x"]},
        {"controller": "B1", "set": "V", "rows": 3, "parts": 2, "made_of": ["x", "y"]},
    ]


def test_what_cannot_be_read_is_a_sentence(tmp_path):
    folder = tmp_path / "episodes"
    store = EpisodeDataset(folder)
    store.append([row(0)])
    with pytest.raises(ValueError, match="differ in wheel"):
        store.append([row(1, wheel=3)])
    store.parts()[0].write_bytes(b"PAR1 cut off")
    with pytest.raises(InputError, match=r"cannot be read .*: delete it to drive its episodes again"):
        store.read()
    store.parts()[0].unlink()
    for text, reason in (("{", "Expecting property name"), ("[]", "no mapping"), ("[" * 100_000, "nested too deeply")):
        (folder / MANIFEST).write_text(text)
        with pytest.raises(InputError, match=f"is no manifest of episodes .*{reason}.*: delete it"):
            EpisodeDataset(folder)
    (folder / MANIFEST).unlink()
    os.mkfifo(folder / MANIFEST)
    with pytest.raises(InputError, match=r"is no manifest of episodes \(it is not a regular file\): delete it"):
        EpisodeDataset(folder)
    (folder / MANIFEST).unlink()
    (folder / MANIFEST).write_text('{"format": 2}')
    with pytest.raises(InputError, match="written in format 2 and this version reads 1"):
        EpisodeDataset(folder)


def test_lines_of_another_version_are_not_guessed(tmp_path):
    (tmp_path / "episodes.jsonl").write_text(json.dumps({"controller": "B1", "set": "V", "number": 0}) + "\n")
    with pytest.raises(InputError, match="rows of another version: move it away"):
        EpisodeDataset(tmp_path / "episodes", tmp_path / "episodes.jsonl")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("3\n", r"has no rows of episodes \(line 1 holds no mapping\): move it away"),
        ("[" * 100_000, r"has no rows of episodes \(line 1 holds no mapping\): move it away"),
        (json.dumps(row(0) | {"controller": 3}), "rows of another version: move it away"),
        (json.dumps(row(0) | {"radius": "wide"}), "rows of another version: move it away"),
    ],
)
def test_lines_that_are_no_rows_are_one_sentence(text, said, tmp_path):
    (tmp_path / "episodes.jsonl").write_text(text)
    with pytest.raises(InputError, match=said):
        EpisodeDataset(tmp_path / "episodes", tmp_path / "episodes.jsonl")


def test_a_pipe_of_lines_is_never_opened(tmp_path):
    os.mkfifo(tmp_path / "episodes.jsonl")
    with pytest.raises(InputError, match="it is not a regular file"):
        EpisodeDataset(tmp_path / "episodes", tmp_path / "episodes.jsonl")
