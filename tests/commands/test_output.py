"""Files and folders are whole or untouched; tables line up."""

from __future__ import annotations

import os
import stat
from dataclasses import dataclass
from pathlib import Path

import pytest

from ddagr_gym.commands.output import (
    FOLDER_MARK,
    atomic_path,
    format_fields,
    format_table,
    output_folder,
    write_bytes,
    write_text,
)
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Drivetrain, TorusWheel


@pytest.fixture
def umask():
    before = os.umask(0o027)
    yield 0o027
    os.umask(before)


def content(folder: Path) -> dict[str, str]:
    return {str(p.relative_to(folder)): p.read_text() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_text_and_bytes_are_written_as_they_are(tmp_path):
    write_text(tmp_path / "new" / "a.txt", "µ\r\n")
    write_bytes(tmp_path / "b.bin", b"\x00\xff")
    assert (tmp_path / "new" / "a.txt").read_bytes() == "µ\r\n".encode()
    assert (tmp_path / "b.bin").read_bytes() == b"\x00\xff"
    assert {p.name for p in tmp_path.iterdir()} == {"new", "b.bin"}


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    file = tmp_path / "run.csv"
    file.write_text("old")
    with pytest.raises(RuntimeError), atomic_path(file) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert content(tmp_path) == {"run.csv": "old"}


def test_the_file_appears_at_the_end_only_and_the_suffix_is_kept(tmp_path):
    file = tmp_path / "run.parquet"
    with atomic_path(file) as temporary:
        assert (temporary.suffix, temporary.parent) == (".parquet", tmp_path)
        temporary.write_text("whole")
        assert not file.exists()
    assert content(tmp_path) == {"run.parquet": "whole"}


def test_content_is_on_the_disk_before_the_file_appears(tmp_path, monkeypatch):
    done = []

    def fsync(handle):
        done.append((os.fstat(handle).st_ino, os.fstat(handle).st_size, (tmp_path / "a").read_text()))

    (tmp_path / "a").write_text("old")
    monkeypatch.setattr(os, "fsync", fsync)
    write_text(tmp_path / "a", "newer")
    assert done == [((tmp_path / "a").stat().st_ino, 5, "old")]
    assert (tmp_path / "a").read_text() == "newer"


def test_permissions_follow_the_umask_or_the_old_file(tmp_path, umask):
    file = tmp_path / "a"
    write_text(file, "")
    assert stat.S_IMODE(file.stat().st_mode) == 0o666 & ~umask
    file.chmod(0o604)
    write_text(file, "b")
    assert stat.S_IMODE(file.stat().st_mode) == 0o604


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to("real")
    write_text(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "new"


def test_folders_devices_and_files_in_the_way_are_refused(tmp_path):
    (tmp_path / "file").write_text("")
    for path, words in (
        (tmp_path, "is a folder"),
        (Path("/dev/null"), "not a regular file"),
        (tmp_path / "file" / "x", "a file is in the way"),
    ):
        with pytest.raises(InputError, match=words):
            write_text(path, "x")
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)


def fill(path: Path, text: str, **options) -> None:
    with output_folder(path, **options) as folder:
        (folder / "report.html").write_text(text)


def test_output_folder_is_made_with_its_parents(tmp_path, umask):
    fill(tmp_path / "a" / "b", "one")
    assert content(tmp_path) == {f"a/b/{FOLDER_MARK}": "report.html\n", "a/b/report.html": "one"}
    assert stat.S_IMODE((tmp_path / "a" / "b").stat().st_mode) == 0o777 & ~umask


def test_a_failed_output_leaves_no_folder(tmp_path):
    with pytest.raises(RuntimeError), output_folder(tmp_path / "a") as folder:
        (folder / "half").write_text("x")
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []


def test_an_earlier_output_is_replaced_only_on_request(tmp_path):
    fill(tmp_path / "a", "one")
    with pytest.raises(InputError, match="--overwrite"):
        fill(tmp_path / "a", "two")
    assert (tmp_path / "a" / "report.html").read_text() == "one"
    fill(tmp_path / "a", "two", overwrite=True)
    assert content(tmp_path) == {f"a/{FOLDER_MARK}": "report.html\n", "a/report.html": "two"}


def test_what_was_put_into_an_output_later_is_never_deleted(tmp_path):
    fill(tmp_path / "a", "one")
    (tmp_path / "a" / "notes").mkdir()
    (tmp_path / "a" / "notes" / "mine.txt").write_text("kept")
    with pytest.raises(InputError, match=r"also holds notes/mine\.txt, which no ddagr command wrote"):
        fill(tmp_path / "a", "two", overwrite=True)
    assert (tmp_path / "a" / "notes" / "mine.txt").read_text() == "kept"
    assert (tmp_path / "a" / "report.html").read_text() == "one"


def test_foreign_files_are_never_replaced(tmp_path):
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "thesis.tex").write_text("years")
    with pytest.raises(InputError, match="no ddagr command wrote"):
        fill(tmp_path / "home", "x", overwrite=True)
    with pytest.raises(InputError, match="is a file"):
        fill(tmp_path / "home" / "thesis.tex", "x", overwrite=True)
    assert content(tmp_path) == {"home/thesis.tex": "years"}


def test_an_empty_folder_is_used_but_not_the_current_one(tmp_path, monkeypatch):
    (tmp_path / "empty").mkdir()
    fill(tmp_path / "empty", "x")
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    with pytest.raises(InputError, match="current folder"):
        fill(Path("."), "x")


def test_table_lines_up():
    table = format_table(("name", "mass [kg]", "wheels"), [("ddagr", 168.0, 4), ("a", 0.123456789, 10)])
    assert table.splitlines() == [
        "name   mass [kg]  wheels",
        "-----  ---------  ------",
        "ddagr        168       4",
        "a       0.123457      10",
    ]
    assert format_table(("a", "b"), []).splitlines() == ["a  b", "-  -"]


@dataclass(frozen=True)
class Cart:
    """Two wheels."""

    name: str
    wheels: tuple[TorusWheel, ...]
    position: tuple[float, float] = (0.1, 0.0)


def test_fields_show_units_and_equal_parts_once():
    wheel = TorusWheel(0.05, 0.1, 0.2)
    assert format_fields(Cart("cart", (wheel, wheel))).splitlines() == [
        "name      cart",
        "wheels",
        "  minor_radius  0.05 m",
        "  half_width    0.1 m",
        "  major_radius  0.2 m",
        "position  0.1, 0",
    ]
    different = format_fields(Cart("cart", (wheel, TorusWheel(0.04, 0.1, 0.2)))).splitlines()
    assert [line for line in different if line.startswith("wheels")] == ["wheels 1", "wheels 2"]


def test_a_limit_that_nothing_reaches_is_called_so():
    lines = format_fields(Drivetrain(turning_limit=4.0)).splitlines()
    assert "turning_limit       4 rad/s" in lines
    assert "power_limit         no limit" in lines
    assert "viscous_rate        0 1/s" in lines
