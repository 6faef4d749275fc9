"""Which answers are asked once more with an effect in a part of the drive."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ddagr_gym.diagnosis.change import mid_drive
from ddagr_gym.diagnosis.change.naming import Named
from ddagr_gym.identification.spells import Spell

SPELL = Spell(0, 42.0)


def model(cost: float, names=(), conspicuous=(), pulled=(), rougher=()):
    """A model with a cost, and what is out of the ordinary beside it."""
    effects = tuple(SimpleNamespace(name=name) for name in names)
    fitted = SimpleNamespace(cost=cost, point=SimpleNamespace(effects=effects))
    problem = SimpleNamespace(blocked=SimpleNamespace(windows=None))
    return SimpleNamespace(
        fitted=fitted, conspicuous=conspicuous, pulled=pulled, rougher=rougher, scan=None, tests=1, shifts=(),
        problem=problem,
    )  # fmt: skip


@pytest.fixture
def later(monkeypatch):
    """A drive of which an effect from 42 s on explains 100 of the cost."""
    found = Named((model(900.0), model(800.0, names=("motor_droop",))), (SimpleNamespace(),))
    monkeypatch.setattr(mid_drive, "spells_of", lambda *_: {})
    monkeypatch.setattr(mid_drive, "begun_in_drive", lambda *_: {})
    monkeypatch.setattr(mid_drive, "_compared_all_along", lambda again, first: again)
    monkeypatch.setattr(mid_drive, "_of_scan", lambda *_: {"motor_droop": SPELL})
    monkeypatch.setattr(mid_drive, "name_changes", lambda *_: found)
    monkeypatch.setattr(mid_drive, "dispersion_of", lambda *_: 1.0)
    return found


def asked_again(first: Named) -> tuple[str, Named]:
    """The problem and names that stand after the question."""
    problem = SimpleNamespace(during=lambda spells: " and ".join(spells))
    ordinary = SimpleNamespace(unnamed={})
    return mid_drive.name_in_parts(problem, None, first, ordinary, np.random.default_rng(0))


@pytest.mark.parametrize("left", [{"rougher": ("encoder_left",)}, {"pulled": ("soil_strength",)}])
def test_what_is_left_open_is_asked_in_parts_of_the_drive_by_channels_alone_too(later, left):
    assert asked_again(Named((model(900.0, **left),), ())) == ("motor_droop", later)


def test_an_answer_that_leaves_nothing_open_is_not_asked_again(later):
    first = Named((model(900.0),), ())
    assert asked_again(first)[1] is first
    limit = SimpleNamespace(compared=SimpleNamespace(name="motor_saturation"))
    absent = Named((model(900.0, conspicuous=(limit,)),), (), frozenset({"motor_saturation"}))
    assert asked_again(absent)[1] is absent


def test_what_changes_within_a_drive_is_asked_though_nothing_is_left_open(later, monkeypatch):
    monkeypatch.setattr(mid_drive, "begun_in_drive", lambda *_: {"motor_droop": SPELL})
    assert asked_again(Named((model(900.0),), ())) == ("motor_droop", later)


def test_a_change_within_a_drive_counts_where_it_explains_more(later, monkeypatch):
    monkeypatch.setattr(mid_drive, "begun_in_drive", lambda *_: {"motor_droop": SPELL})
    first = Named((model(900.0), model(805.0, names=("encoder_scale",))), (SimpleNamespace(),))
    assert asked_again(first)[1] is first
