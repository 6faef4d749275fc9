"""Finished steps of a long command: removed after its work, kept where it was stopped or failed."""

from pathlib import Path

import pytest

from ddagr_gym.commands.resumed import resumable
from ddagr_gym.errors import InputError


@pytest.fixture
def parts(tmp_path: Path) -> Path:
    folder = tmp_path / "output.part"
    folder.mkdir()
    (folder / "step").write_text("done")
    return folder


def test_steps_are_removed_after_the_work(parts):
    with resumable(parts):
        assert (parts / "step").is_file()
    assert not parts.exists()


def test_a_stop_keeps_them_and_says_where_they_are(parts):
    with pytest.raises(KeyboardInterrupt, match=f"the same command goes on from {parts}$"), resumable(parts):
        raise KeyboardInterrupt
    assert (parts / "step").is_file()


@pytest.mark.parametrize("kept", [True, False])
def test_a_stop_promises_nothing_where_nothing_is_kept(kept, tmp_path):
    with pytest.raises(KeyboardInterrupt) as stop, resumable(tmp_path / "absent.part" if kept else None):
        raise KeyboardInterrupt
    assert not stop.value.args


def test_a_fault_keeps_them(parts):
    with pytest.raises(InputError, match="wrong"), resumable(parts):
        raise InputError("wrong")
    assert (parts / "step").is_file()
