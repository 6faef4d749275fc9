"""What moves the place about which a robot turns: where the side slip counts, ruts, the centre of mass."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ddagr_gym.control.manoeuvres import Manoeuvre
from ddagr_gym.diagnosis.gates.threshold_files import default_thresholds
from ddagr_gym.diagnosis.planning.next_drive import next_drive
from ddagr_gym.diagnosis.search import equivalents
from ddagr_gym.diagnosis.search.equivalents import with_turning_centre
from ddagr_gym.diagnosis.search.gains import gains
from ddagr_gym.diagnosis.search.scan import scan
from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.identification.gauss_newton import fit
from ddagr_gym.identification.nuisances import LEAD
from ddagr_gym.identification.problem import Point
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors, WheelEncoder
from ddagr_gym.physics.effects.registry import effect_kinds, parse_effect
from ddagr_gym.physics.soil_laws import CrustAndResidual
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate

RATE = 25.0
ROBOT, SOIL = get_robot("ddagr"), get_soil("thesis_a1")
MOVERS = {name: effect_kinds()[name] for name in ("multipass", "centre_of_mass_offset")}
ARCS = ((1.5, 0.3), (0.3, 1.5), (1.3, 0.5), (0.5, 1.3), (1.1, 0.7), (0.7, 1.1))


def problem_of(lead: float = 0.0, effects: tuple[Any, ...] = ()):
    """Arcs of a robot whose side slip counts ahead of its wheels' hubs, against the robot as it is known."""
    commands = np.concatenate([np.tile(pair, (int(6.0 * RATE), 1)) for pair in ARCS])
    robot = replace(ROBOT, side_slip_lead=lead)
    sensors = Sensors(Imu(sample_rate=RATE), WheelEncoder(), PoseReceiver(5.0))
    columns = simulate(robot, SOIL, commands, sensors=sensors, effects=effects, seed=4)
    return make_problem(ROBOT, SOIL, [Recording.from_columns(columns, ROBOT)], Setting().with_windows(6.0))


def largest_gain(problem) -> float:
    return max(item.gain for item in gains(scan(problem, fit(problem), MOVERS)))


@pytest.mark.slow
def test_another_place_of_the_side_slip_is_no_missing_physics() -> None:
    lead = 0.02
    problem = problem_of(lead)
    fitted = fit(problem)
    names = [parameter.name for parameter in problem.nuisances.parameters]
    # drawn towards none by its prior
    assert 0.5 * lead < fitted.point.values[names.index(LEAD)] < 1.1 * lead
    assert max(item.gain for item in gains(scan(problem, fitted, MOVERS))) < 6.0


@pytest.mark.slow
def test_nor_is_a_soil_that_resists_the_displacement() -> None:
    problem = problem_of(effects=(CrustAndResidual(),))
    gates = default_thresholds("ddagr").for_length(problem.covered)
    assert largest_gain(problem) < gates.of("multipass").gain


def test_reversing_shows_a_centre_of_mass_better_than_driving_on() -> None:
    """Backwards the side slip counts on the other side of the hubs, and the centre of mass stays."""
    forth = Manoeuvre("forth", ((5.0, 1.2, 0.6), (5.0, 0.6, 1.2)), "arcs forwards")
    back = Manoeuvre("back", ((5.0, 1.2, 0.6), (5.0, -0.6, -1.2)), "an arc forwards, the other backwards")
    offset = [parse_effect("centre_of_mass_offset=0.04")]
    power = {item.name: next_drive(ROBOT, SOIL, offset, bank=(item,)).power for item in (forth, back)}
    assert power["back"] > 1.2 * power["forth"]


def tried_at(monkeypatch: pytest.MonkeyPatch, lead: float, *effects: Any) -> list[str]:
    """Effects that are tried beside a refitted model whose lead of the side slip stands at a value."""
    fitted: list[Any] = []

    def fit_nothing(problem, point, **options):
        fitted.append(point.effects[-1])
        return SimpleNamespace(point=point, cost=90.0)

    monkeypatch.setattr(equivalents, "fit", fit_nothing)
    held = [] if abs(lead) >= 0.05 else [0]
    problem: Any = SimpleNamespace(
        nuisances=SimpleNamespace(parameters=(SimpleNamespace(name=LEAD),)), open_at=lambda point: held
    )
    point = Point(np.array([lead]), np.zeros((1, 8)), tuple(effects))
    model: Any = SimpleNamespace(fitted=SimpleNamespace(point=point, cost=100.0), dispersion=1.0)
    raw: Any = SimpleNamespace(point=Point(np.zeros(1), np.zeros((1, 8))))
    rivals = with_turning_centre(problem, model, raw, [])
    assert [rival.name for rival in rivals] == [effect.name for effect in fitted]
    return [f"{effect.name} {'+' if getattr(effect, effect.size_names()[0]) > 0.0 else '-'}" for effect in fitted]


def test_a_lead_at_its_bound_has_what_else_moves_the_turning_centre_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    assert tried_at(monkeypatch, 0.02) == []
    assert tried_at(monkeypatch, 0.05) == ["centre_of_mass_offset +", "multipass +"]
    assert tried_at(monkeypatch, -0.05) == ["centre_of_mass_offset -", "multipass -"]
    assert tried_at(monkeypatch, 0.05, parse_effect("multipass=0.4")) == ["centre_of_mass_offset +"]
