"""What a null run keeps, and what tells one bank from another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ddagr_gym.diagnosis.null_bank import bank as null_bank
from ddagr_gym.diagnosis.null_bank.bank import NullBank
from ddagr_gym.diagnosis.null_bank.drives import Template
from ddagr_gym.diagnosis.null_bank.ordinary_drives import pieces_of
from ddagr_gym.diagnosis.search import rivals
from ddagr_gym.diagnosis.search.starting_models import FAR_OFF
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording

ROBOT, SOIL = get_robot("ddagr"), get_soil("thesis_a1")


def drive(seconds: float, yaw_rate: float = 0.1) -> Recording:
    t = 0.02 * np.arange(int(seconds / 0.02))
    values = {"command_right": 0.5, "command_left": 0.4, "yaw_rate": yaw_rate, "encoder_right": 0.5}
    return Recording.from_columns({"t": t, **{name: np.full(len(t), v) for name, v in values.items()}}, ROBOT)


def hash_of(template: Template | None = None, pieces: Sequence[Recording] = ()) -> str:
    return NullBank(ROBOT, SOIL, Setting(), tuple(pieces) or (template,) * 20).key()


def test_ordinary_pieces_are_hashed_with_their_readings_and_segments() -> None:
    pieces, others = (pieces_of(drive(60.0, yaw_rate), 20.0) for yaw_rate in (0.1, -0.1))
    cut = [replace(piece, meta=replace(piece.meta, segments=((0, 500), (500, 1000)))) for piece in pieces]
    assert hash_of(pieces=pieces) == hash_of(pieces=pieces_of(drive(60.0), 20.0))
    assert len({hash_of(pieces=given) for given in ((), pieces, others, pieces[:2], cut)}) == 5


@pytest.mark.parametrize(
    "change", [{"present": (np.zeros((50, 8), dtype=bool),)}, {"starts": ((1.0, 0.0, 0.0),)}, {"period": 0.05}]
)
def test_templates_are_hashed_with_what_is_read_and_where_they_start(change: dict[str, Any]) -> None:
    present = np.ones((50, 8), dtype=bool)
    template = Template((np.ones((50, 2)),), 0.02, (present,), (None,) * 8, ((0.0, 0.0, 0.0),))
    assert hash_of(template) == hash_of(replace(template))
    assert hash_of(template) != hash_of(replace(template, **change))


def model_of(gain: float, meaningful: bool = True, dispersion: float = 1.0) -> Any:
    """A scan that says only something about a slope."""
    effect = SimpleNamespace(is_meaningful=lambda extent: meaningful)
    terms = SimpleNamespace(candidates=[SimpleNamespace(effect=effect)])
    gains = (SimpleNamespace(name="slope", gain=gain, candidate=0, multiples=(1.0,)),)
    words = {"slope": 0.1 * gain}
    fitted = SimpleNamespace(prediction=None)
    return SimpleNamespace(
        gains=gains,
        terms=terms,
        scores=words,
        held_out=words,
        misfit={},
        names=(),
        dispersion=dispersion,
        fitted=fitted,
    )


@pytest.fixture
def quick_scan(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(null_bank, "first_guess", lambda candidate, multiples: candidate.effect)
    monkeypatch.setattr(null_bank, "drive_extent", lambda problem, prediction: None)


def nominal_is(monkeypatch: pytest.MonkeyPatch, model: Any) -> None:
    """Refit and scan of the nominal model are not computed."""
    monkeypatch.setattr(null_bank, "refit_nominal", lambda problem: (None, None))
    monkeypatch.setattr(null_bank, "scan_model", lambda problem, fitted: model)


def test_a_null_run_keeps_the_length_of_the_windows_that_were_cut(
    quick_scan: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    nominal_is(monkeypatch, model_of(1.0))
    run = NullBank(ROBOT, SOIL, Setting().with_windows(6.0), (drive(40.0),)).run(0)
    assert run.duration == pytest.approx(5.0)
    assert run.windows * run.duration == pytest.approx(40.0, rel=0.15)


def test_a_null_run_that_bends_the_nominal_model_counts_the_raw_one_too(
    quick_scan: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a search ranks; what is said of an effect beside its gain comes from the same scan."""
    bent = model_of(3.0, meaningful=False, dispersion=2.0 * FAR_OFF)
    nominal_is(monkeypatch, bent)
    monkeypatch.setattr(rivals, "scan_model", lambda problem, raw: model_of(70.0))
    run = NullBank(ROBOT, SOIL, Setting(), (drive(40.0),)).run(0)
    assert (run.gains, run.held_out, run.meaningless) == ({"slope": 70.0}, {"slope": 7.0}, ())
    monkeypatch.setattr(rivals, "scan_model", lambda problem, raw: model_of(2.0))
    run = NullBank(ROBOT, SOIL, Setting(), (drive(40.0),)).run(0)
    assert (run.gains, run.meaningless) == ({"slope": 3.0}, ("slope",))
