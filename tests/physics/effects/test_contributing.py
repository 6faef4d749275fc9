"""The effect that CONTRIBUTING shows works as it stands there, in a package of somebody's own."""

import re
import textwrap
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest

from ddagr_gym.diagnosis.search.candidates import candidates_of
from ddagr_gym.diagnosis.search.initial_guess import first_guess
from ddagr_gym.physics.effects import effect_kind, registry
from ddagr_gym.physics.effects.base import DriveExtent
from ddagr_gym.simulator import simulate

TEXT = Path(__file__).resolve().parents[3] / "CONTRIBUTING.md"


@pytest.fixture
def wind(tmp_path, monkeypatch):
    """The effect from the file, installed by an entry point."""
    section = TEXT.read_text().partition("## Add an effect")[2].partition("\n## ")[0]
    code = re.search(r"```python\n(.*?)```", section, re.DOTALL).group(1)
    (tmp_path / "wind_of_contributing.py").write_text(textwrap.dedent(code))
    monkeypatch.syspath_prepend(tmp_path)
    points = (EntryPoint("wind", "wind_of_contributing:Wind", registry.ENTRY_POINT_GROUP),)
    monkeypatch.setattr(registry, "entry_points", lambda group: points)
    registry.effect_kinds.cache_clear()
    yield effect_kind("wind")
    registry.effect_kinds.cache_clear()


def test_wind_pushes_towards_its_direction_in_the_world(wind, robot, soil, ideal_sensors):
    def path(effects, yaw):
        columns = simulate(
            robot, soil, np.full((150, 2), 0.5), sensors=ideal_sensors, effects=effects, initial_state={"yaw": yaw}
        )
        return np.array([columns["true_x"][-1], columns["true_y"][-1]])

    for yaw in (0.0, 1.2):
        drift = path([wind(150.0, 2.0)], yaw) - path((), yaw)
        assert drift @ [np.cos(2.0), np.sin(2.0)] > 5.0 * abs(drift @ [-np.sin(2.0), np.cos(2.0)])
        np.testing.assert_array_equal(path([wind.neutral()], yaw), path((), yaw))


def test_two_probes_along_the_axes_become_one_direction(wind):
    (candidate,) = candidates_of(wind, DriveExtent(), 0)
    guess = first_guess(candidate, (3.0, -4.0))
    assert guess.force == pytest.approx(50.0)
    assert guess.direction == pytest.approx(np.arctan2(-4.0, 3.0))
