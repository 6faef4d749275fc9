"""Finished steps come back as they were, and nothing of another diagnosis does."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ddagr_gym.diagnosis import store as module
from ddagr_gym.diagnosis.search.gains import gains
from ddagr_gym.diagnosis.search.scan import scan
from ddagr_gym.diagnosis.search.scanned_model import ScannedModel, SearchResult
from ddagr_gym.diagnosis.store import StepStore
from ddagr_gym.errors import InputError
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.physics.effects.registry import effect_kind
from tests.diagnosis.conftest import Sloping


def never() -> Any:
    raise AssertionError("a finished step was done again")


def test_a_search_comes_back_whole(sloping: Sloping, tmp_path: Path) -> None:
    fitted, name = sloping.nominal, "slope"
    terms = scan(sloping.problem, fitted, {name: effect_kind(name)})
    model = ScannedModel(fitted, terms, tuple(gains(terms)), {name: 1.0}, {name: 2.0}, 1.0, {})
    found = SearchResult((model, replace(model, fitted=sloping.chosen)), ())
    assert StepStore(tmp_path / "part", "key").step("search", lambda: found) is found
    again = StepStore(tmp_path / "part", "key").step("search", never)
    chosen = again.chosen
    assert chosen.fitted.point.effects == sloping.chosen.point.effects
    assert chosen.gains == found.chosen.gains
    assert chosen.terms.candidates[0].probes == found.chosen.terms.candidates[0].probes
    assert np.array_equal(chosen.terms.normals, found.chosen.terms.normals)
    assert np.array_equal(again.nominal.fitted.elimination.basis, fitted.elimination.basis)


@pytest.mark.parametrize(
    "value",
    [
        None,
        {"a": (1, 2.5, float("inf"), "x", True), "b": [None, {"array": "no array"}]},
        ({"list": [1]}, load_effects("slope=0.05")[0]),
    ],
)
def test_plain_values_come_back_with_their_types(value: object, tmp_path: Path) -> None:
    store = StepStore(tmp_path / "part", "key")
    store.step("one", lambda: value)
    assert store.step("one", never) == value


def test_another_key_starts_anew(tmp_path: Path) -> None:
    StepStore(tmp_path / "part", "key").step("one", lambda: 1)
    assert StepStore(tmp_path / "part", "other").step("one", lambda: 2) == 2


def test_a_step_that_failed_is_done_again(tmp_path: Path) -> None:
    store = StepStore(tmp_path / "part", "key")
    with pytest.raises(KeyboardInterrupt):
        store.step("one", _interrupted)
    assert not store.has("one")
    assert store.step("one", lambda: 3) == 3


def _interrupted() -> None:
    raise KeyboardInterrupt


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="something else"):
        StepStore(tmp_path, "key")
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_a_folder_in_the_home_folder_is_found_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    StepStore(Path("~/steps"), "key").step("one", lambda: 1)
    assert StepStore(Path("~/steps"), "key").step("one", never) == 1
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="something else"):
        StepStore(Path("~/notes"), "key")


def test_without_a_folder_nothing_is_kept() -> None:
    store = StepStore(None, "")
    assert [store.step("one", lambda: 1), store.step("one", lambda: 2)] == [1, 2]


def _truncated(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:40])


def _emptied(path: Path) -> None:
    path.write_bytes(b"")


def _garbled(path: Path) -> None:
    path.write_bytes(b"\xff\x00 no text")


def _nested(path: Path) -> None:
    path.write_text("[" * 100_000)


def _of_other_keys(path: Path) -> None:
    path.write_text('{"tuple": []}')


def _of_another_kind(path: Path) -> None:
    path.write_text("[]")


def _with_another_number(path: Path) -> None:
    path.write_text(path.read_text().replace("2.5", "2.6"))


@pytest.mark.parametrize(
    ("suffix", "damage", "reason"),
    [
        ("npz", _truncated, "its hash is another one"),
        ("npz", _emptied, "its hash is another one"),
        ("npz", Path.unlink, "No such file"),
        ("json", _truncated, "Unterminated string"),
        ("json", _emptied, "Expecting value"),
        ("json", _garbled, "can't decode"),
        ("json", _nested, "nested too deeply"),
        ("json", _of_other_keys, "no result with a hash"),
        ("json", _of_another_kind, "no result with a hash"),
        ("json", _with_another_number, "its hash is another one"),
    ],
)
def test_a_damaged_step_is_done_again_and_says_so_once(
    suffix: str, damage: Callable[[Path], None], reason: str, tmp_path: Path
) -> None:
    value, lines = ({"size": 2.5}, np.arange(3.0)), list[str]()
    StepStore(tmp_path / "part", "key").put("one", value)
    damage(tmp_path / "part" / f"one.{suffix}")
    store = StepStore(tmp_path / "part", "key", lines.append)
    assert not store.has("one")
    assert store.step("one", lambda: value) is value
    (line,) = lines
    assert line.startswith(f"{tmp_path / 'part' / 'one.json'}, a finished step, is damaged (")
    assert reason in line
    assert line.endswith("): it is done again")
    sizes, array = store.step("one", never)
    assert (sizes, array.tolist()) == ({"size": 2.5}, [0.0, 1.0, 2.0])


def test_a_step_is_read_once_for_its_question_and_its_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    StepStore(tmp_path / "part", "key").put("one", None)
    store, reads = StepStore(tmp_path / "part", "key"), list[str]()
    load = module._load

    def counted(folder: Path, name: str) -> Any:
        reads.append(name)
        return load(folder, name)

    monkeypatch.setattr(module, "_load", counted)
    assert store.has("one")
    assert store.step("one", never) is None
    assert reads == ["one"]
    store.has("one")
    store.put("one", 3)
    assert store.step("one", never) == 3


def test_a_garbled_key_is_that_of_something_else(tmp_path: Path) -> None:
    StepStore(tmp_path / "part", "key").put("one", 1)
    (tmp_path / "part" / "key.txt").write_bytes(b"\xff\xfe")
    assert not StepStore(tmp_path / "part", "key").has("one")


def test_cleared(tmp_path: Path) -> None:
    store: StepStore = StepStore(tmp_path / "part", "key")
    work: Callable[[], int] = lambda: 1  # noqa: E731
    store.step("one", work)
    store.clear()
    assert not (tmp_path / "part").exists()
