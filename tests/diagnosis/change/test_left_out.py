"""What forecasts of left-out windows say of an answer."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ddagr_gym.diagnosis.answer.change import ChangeCertificate
from ddagr_gym.diagnosis.change.conclusion import forecast_badly
from ddagr_gym.diagnosis.change.left_out import USUAL, certificate, probability_of_ordinary
from ddagr_gym.physics.effects import load_effects

WINDOWS, ORDINARY = 14, 42
"""Of a drive of a minute, and of three."""


def made(as_well: int) -> ChangeCertificate:
    losses = np.where(np.arange(WINDOWS) < as_well, 0.5, 2.0)
    found = certificate(losses, losses, np.linspace(0.1, 1.0, ORDINARY))
    assert found is not None
    assert found.as_well == as_well
    return found


def named(*effects: str) -> Any:
    point = SimpleNamespace(effects=load_effects(effects))
    model = SimpleNamespace(fitted=SimpleNamespace(point=point), tests=48)
    return SimpleNamespace(models=[model, model], steps=(None,) * len(effects))


@pytest.mark.parametrize("as_well", [8, 10, 12])
def test_ordinary_windows_are_as_few_as_often_as_it_says(as_well: int) -> None:
    """Drawn from one distribution, whatever it is; the quantile lies between two of the windows."""
    draws = np.random.default_rng(4).exponential(size=(40000, WINDOWS + ORDINARY))
    limit = np.quantile(draws[:, WINDOWS:], USUAL, axis=1, keepdims=True)
    share = float(((draws[:, :WINDOWS] <= limit).sum(axis=1) <= as_well).mean())
    assert probability_of_ordinary(made(as_well)) == pytest.approx(share, rel=0.25, abs=5e-4)


def test_a_name_beside_which_forecasts_stay_bad_is_not_all_that_changed() -> None:
    assert forecast_badly(named("lateral_bulldozing=1.4"), made(5))
    # ordinary drives of another simulator have as few
    assert not forecast_badly(named("lateral_bulldozing=1.4"), made(9))


@pytest.mark.parametrize("effects", [(), ("encoder_scale=1.08",), ("gyro_bias=0.01", "lateral_bulldozing=1.4")])
def test_bad_forecasts_say_nothing_without_a_name_or_where_sensors_start_them_wrong(effects: tuple[str, ...]) -> None:
    assert not forecast_badly(named(*effects), made(2))


def test_without_ordinary_forecasts_nothing_is_said() -> None:
    assert not forecast_badly(named("lateral_bulldozing=1.4"), None)
