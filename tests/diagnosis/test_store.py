"""Finished steps come back as they were, and nothing of another diagnosis does."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ddagr_gym.diagnosis.search.gains import gains
from ddagr_gym.diagnosis.search.scan import scan
from ddagr_gym.diagnosis.search.scanned_model import ScannedModel, SearchResult
from ddagr_gym.diagnosis.store import StepStore
from ddagr_gym.errors import InputError
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.physics.effects.registry import effect_kind
from tests.diagnosis.conftest import Sloping


def never() -> None:
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


def test_without_a_folder_nothing_is_kept() -> None:
    store = StepStore(None, "")
    assert [store.step("one", lambda: 1), store.step("one", lambda: 2)] == [1, 2]


def test_cleared(tmp_path: Path) -> None:
    store: StepStore = StepStore(tmp_path / "part", "key")
    work: Callable[[], int] = lambda: 1  # noqa: E731
    store.step("one", work)
    store.clear()
    assert not (tmp_path / "part").exists()
