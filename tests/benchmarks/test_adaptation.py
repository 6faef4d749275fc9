"""The demonstration of adaptations: truths, the loop in the other simulator, what counts as won back, its files."""

import json
import math

import numpy as np
import pytest

from benchmarks.adaptation import __main__ as command
from benchmarks.adaptation.plant import SAMPLES, TruePlant
from benchmarks.adaptation.study import ARMS, TrueTurns, nominal
from benchmarks.adaptation.truths import TRUTHS
from benchmarks.adaptation.won_back import SCORES, gains, result_of, table
from benchmarks.concealed.drive import SAMPLE_PERIOD, SUBSTEPS, drive
from ddagr_gym.adaptation.turns import DrivenTurn, judged
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.diagnosis.gates.threshold_files import default_thresholds
from ddagr_gym.diagnosis.search.gains import gains as gains_of
from ddagr_gym.diagnosis.search.scan import scan
from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.identification.gauss_newton import fit
from ddagr_gym.identification.nuisances import NuisancePriors
from ddagr_gym.physics.effects.registry import effect_kinds
from ddagr_gym.presets import ddagr, get_soil
from ddagr_gym.recordings.load import load_recording


def turns(errors):
    return [DrivenTurn(k, "left", error, True, error, 0.0, None) for k, error in enumerate(errors)]


def test_truths_are_told_in_the_librarys_terms():
    named = {name: truth.named_effects() for name, truth in TRUTHS.items()}
    for nameless in ("nothing", "weak_sideways", "strong_sideways"):
        assert named.pop(nameless) == ()
    assert all(len(effects) == 1 and effects[0].name == TRUTHS[name].effect for name, effects in named.items())
    assert {TRUTHS[name].effect for name in named} <= set(effect_kinds())
    (slope,) = named["slope"]
    assert math.degrees(slope.angle) == pytest.approx(3.0)
    (split,) = named["split"]
    assert split.strength == pytest.approx(math.exp(-0.4))  # left over right, the generator's is right over left


@pytest.mark.slow
def test_recordings_are_read_as_any_others(tmp_path, monkeypatch):
    monkeypatch.setattr("benchmarks.adaptation.plant.RECORDED", ("straight",))
    (path,) = TruePlant(TRUTHS["gyro"]).record(tmp_path)
    recording = load_recording(path, "concealed", "ddagr")
    assert recording.has("yaw_rate", "pose_x", "command_right")


@pytest.mark.slow
def test_another_simulators_shear_is_not_called_ruts(tmp_path):
    """Where the soil resists the displacement, it turns the robot 2 cm further ahead than ours."""
    drives = [load_recording(path, "concealed", "ddagr") for path in TruePlant(TRUTHS["nothing"]).record(tmp_path)]
    kinds = {name: effect_kinds()[name] for name in ("multipass", "centre_of_mass_offset")}
    thresholds = default_thresholds("ddagr")

    def largest(priors):
        setting = Setting(priors=priors).with_windows(thresholds.duration)
        problem = make_problem(ddagr(), get_soil("thesis_a1"), drives, setting)
        gate = thresholds.for_length(problem.covered).of("multipass").gain
        return max(item.gain for item in gains_of(scan(problem, fit(problem), kinds))) / gate

    assert largest(NuisancePriors()) < 0.3
    # a simulator that is sure where along the contact the side slip counts is wrong for sure
    assert largest(NuisancePriors(side_slip_lead=1e-4)) > 1.0


class _Straight:
    """Both banks at one speed; keeps the samples that it is given."""

    def __init__(self):
        self.samples = []

    def reset(self):
        self.samples.clear()

    def __call__(self, observation, info=None):
        self.samples.append(info["samples"])
        return np.array([0.4, 0.4])


@pytest.mark.slow
def test_the_loop_is_that_of_the_other_simulator(monkeypatch):
    """A drive in pieces goes where the whole one goes, up to the load that settles beforehand."""
    monkeypatch.setattr("benchmarks.adaptation.plant.LONGEST", 4.0)
    controller, plant = _Straight(), TruePlant(TRUTHS["nothing"])
    columns = plant.turn(controller, RowTurn(run_in=0.5), 3)
    steps = len(columns["t"])
    rng = np.random.default_rng([20_261_124, 2, 3])
    made = plant.plant(rng)
    start = np.array([-0.5, 0.01 * rng.standard_normal(), 0.01 * rng.standard_normal()])
    whole = drive(made, np.full(((steps + 1) * SUBSTEPS, 2), 0.8), start)
    assert columns["true_x"][-1] == pytest.approx(whole["x"][-1], abs=2e-4)
    assert columns["t"][-1] == pytest.approx(steps * SAMPLE_PERIOD)
    assert all(item.shape == (SAMPLES, 5) for item in controller.samples)
    assert np.mean([item[:, 3] for item in controller.samples[-5:]]) == pytest.approx(0.8, abs=0.02)


@pytest.mark.slow
def test_a_late_command_comes_late(monkeypatch):
    monkeypatch.setattr("benchmarks.adaptation.plant.LONGEST", 2.0)
    ways = [
        TruePlant(TRUTHS[name]).turn(_Straight(), RowTurn(run_in=0.5), 3)["true_x"] for name in ("nothing", "delay")
    ]
    assert (ways[0][-1] - ways[1][-1]) / 0.2 == pytest.approx(0.16, abs=0.04)


@pytest.mark.slow
def test_lateral_forces_are_scaled_and_nothing_else():
    """The wheels' lateral forces in a turn follow the factor, so that the robot drifts further on weaker ground."""
    ways = {}
    for name in ("weak_sideways", "nothing", "strong_sideways"):
        plant = TruePlant(TRUTHS[name]).plant(np.random.default_rng(0))
        commands = np.tile([1.4, 0.2], (6 * round(1.0 / SAMPLE_PERIOD) * SUBSTEPS, 1))
        ways[name] = drive(plant, commands, np.zeros(3))
    turned = {name: abs(way["yaw"][-1]) for name, way in ways.items()}
    assert turned["weak_sideways"] > 1.03 * turned["nothing"]
    assert turned["strong_sideways"] < 0.98 * turned["nothing"]


@pytest.mark.slow
def test_a_turn_in_a_truth_is_judged_as_others_are():
    own = TrueTurns(TRUTHS["nothing"])
    columns = own.drive(nominal("B4").controller(own.turn(0)), 0)
    found = judged(columns, own.turn(0), own.robot, 0)
    assert found.success
    assert abs(found.error) < 0.1


def test_what_is_won_back_by_hand():
    before, best = np.full(12, 0.10), np.full(12, 0.02)
    spread = 0.002 * np.arange(12)
    score = SCORES["radius_error"]
    found = gains(
        {"nominal": turns(before + spread), "adapted": turns(best + spread + 0.02), "told": turns(best + spread)}, score
    )
    assert found["share"]["value"] == pytest.approx(0.75)
    assert not found["loses"]
    nothing = gains({arm: turns(before + spread) for arm in ARMS}, score)
    assert nothing["share"] is None
    worse = gains({"nominal": turns(best), "adapted": turns(before), "told": turns(best)}, score)
    assert worse["loses"]


def test_fields_differ_in_soil_places_and_noise():
    first, second = (TruePlant(TRUTHS["nothing"], number) for number in (1, 2))
    assert first.noise != second.noise
    one, other = (plant.turn(_Straight(), RowTurn(run_in=0.5), 3)["true_x"] for plant in (first, second))
    assert not np.array_equal(one[:50], other[:50])


def test_what_no_published_file_is_of_wants_a_name(capsys):
    with pytest.raises(SystemExit) as ended:
        command.main(["--controller", "B4", "--field", "2"])
    assert ended.value.code == 2
    assert "B4 on field 2" in capsys.readouterr().err


@pytest.mark.parametrize("published", command.RESULTS.values(), ids=lambda path: path.stem)
def test_published_figures_are_of_their_turns(published):
    result = json.loads(published.read_text())
    assert len(result["truths"]) >= 8
    found = {name: {**item, "turns": result["turns"][name]} for name, item in result["truths"].items()}
    again = json.loads(json.dumps(result_of(found)))
    assert again["won_back"] == result["won_back"]
    assert again["truths"] == result["truths"]
    assert table(again) == table(result)


def test_unknown_truths_are_one_sentence(capsys):
    with pytest.raises(SystemExit) as ended:
        command.main(["--truths", "slop"])
    assert ended.value.code == 2
    assert "'slope'" in capsys.readouterr().err
