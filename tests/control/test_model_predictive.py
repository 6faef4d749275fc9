"""B5: its model against the filter's, its plans, and its turns."""

import math
import subprocess
import sys
import time

import numpy as np
import pytest

from ddagr_gym.control.model_predictive import DeadReckoning, ModelPredictive, PredictiveSettings
from ddagr_gym.control.observation import EKF_FEATURES, FEATURE_SCALES, OBSERVATION, SCALES, decode
from ddagr_gym.control.predictive_model import PredictiveModel, body_acceleration, transition, wheel_forces
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.envs.options import make_settings
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import STATE, FilterModel, roll_out
from ddagr_gym.estimation.force_laws import LawParameters, coupled_law
from ddagr_gym.evaluation.controllers import find_controller
from ddagr_gym.evaluation.metrics import turn_metrics
from ddagr_gym.evaluation.runs import drive_turn
from ddagr_gym.parameters import Sensors
from ddagr_gym.presets import get_robot

casadi = pytest.importorskip("casadi")

ROBOT = get_robot("ddagr")
FILTER = FilterModel.of(ROBOT, Sensors())
PRIOR = FILTER.soil_prior.logs(FILTER.wheel_load)[0]
MODEL = PredictiveModel(ROBOT, FILTER.outer_radius, FILTER.rest_speed, FILTER.reversal_speed, period=0.08)


def observation(features=None, **values):
    """Scaled observation with the filter's features of a robot in the middle of a left turn."""
    entries = {"side": 1.0, "target_radius": 0.8, "target_speed": 0.2, "heading_to_go": 1.5} | values
    seen = np.array([entries.get(name, 0.0) for name, _, _ in OBSERVATION]) / SCALES
    told = {"estimated_v_x": 0.2, "estimated_yaw_rate": 0.25} | (features or {})
    return np.concatenate([seen, np.array([told.get(name, 0.0) for name, _, _ in EKF_FEATURES]) / FEATURE_SCALES])


@pytest.mark.parametrize("seed", range(20))
def test_force_law_is_the_filters(seed):
    rng = np.random.default_rng(seed)
    v_x, v_y, rim = rng.uniform(-0.3, 0.5, 3)
    soil = np.exp(PRIOR + 0.5 * rng.standard_normal(4))
    expected = coupled_law(v_x, v_y, rim, LawParameters(*soil, FILTER.rest_speed, FILTER.reversal_speed))
    found = wheel_forces(casadi, MODEL, v_x, v_y, rim, list(soil))
    assert float(found[0]) == pytest.approx(expected[0], rel=1e-9, abs=1e-9)
    assert float(found[1]) == pytest.approx(expected[8], rel=1e-9, abs=1e-9)


def test_motion_is_the_filters():
    state = np.zeros(len(STATE))
    state[:5] = [0.2, 0.01, 0.2, 1.2, 0.3]
    state[5:9] = PRIOR
    commands = np.array([1.4, 0.1])
    expected = roll_out(FILTER, state, np.tile(commands, (10, 1)))[-1]
    step = transition(casadi, MODEL)
    found = np.array(step([*state[:5], 0.0, 0.0], commands, [*np.exp(PRIOR), 0.0, 0.0, 0.0])).ravel()
    np.testing.assert_allclose(found[3:5], expected[3:5], rtol=1e-9)  # banks follow their commands exactly
    np.testing.assert_allclose(found[[0, 2]], expected[[0, 2]], rtol=0.05)  # 2 implicit steps against 10


def test_a_steady_arc_stays_on_its_path():
    from ddagr_gym.estimation.force_balance import arc_bank_speeds

    soil = np.exp(PRIOR)
    banks = arc_bank_speeds(FILTER, soil, 0.2, 1.0 / 0.8)
    state = np.array([0.2, 0.0, 0.25, *banks, 0.0, 0.0])
    step = transition(casadi, MODEL)
    parameters = [*soil, 1.0 / 0.8, 0.0, 0.0]
    for _ in range(30):
        state = np.array(step(state, banks, parameters)).ravel()
    assert state[0] == pytest.approx(0.2, rel=0.01)
    assert abs(state[5]) < 0.01  # 2.4 s at 0.2 m/s: half a metre along the arc
    assert abs(state[6]) < 0.02


def test_acceleration_vanishes_at_rest():
    found = body_acceleration(casadi, MODEL, [0.0, 0.0, 0.0], [0.0, 0.0], list(np.exp(PRIOR)))
    np.testing.assert_allclose(np.array(casadi.DM(found)).ravel(), 0.0, atol=1e-9)


def test_dead_reckoning_of_the_commanded_turn_has_no_error():
    turn = RowTurn(radius=0.9, side="right", run_in=0.5, speed=0.2)
    place = DeadReckoning(decode(observation(side=-1.0, target_radius=0.9, run_in_to_go=0.5)))
    distance = 0.0
    for _ in range(240):
        distance += 0.2 * 0.08
        place.advance(0.2, float(turn.heading(distance)), 0.08)
    found, lateral, heading = place.errors()
    assert found == pytest.approx(distance, abs=0.02)
    assert abs(lateral) < 0.01
    assert abs(heading) < 1e-9


def test_plan_converges_and_respects_the_limits():
    controller = ModelPredictive(MODEL, PRIOR, PredictiveSettings(change=0.01))
    start = observation(run_in_to_go=0.0, heading_to_go=math.pi, target_speed=0.5)  # too fast: banks would pass 2 rad/s
    controller(start)
    assert np.abs(controller._commands).max() <= ROBOT.maximum_wheel_speed + 1e-6
    assert np.abs(controller._commands).max() == pytest.approx(ROBOT.maximum_wheel_speed, abs=1e-3)
    controller = ModelPredictive(MODEL, PRIOR, PredictiveSettings(change=0.05))
    straight = {"run_in_to_go": 0.0, "heading_to_go": math.pi, "encoder_right": 0.74, "encoder_left": 0.74}
    slow = observation({"estimated_yaw_rate": 0.0}, **straight)
    controller(slow)
    seen, features = decode(slow), slow[len(OBSERVATION) :] * FEATURE_SCALES
    state = controller._states[:, 0].copy()
    stages = controller._stages(seen, features, 0.0)
    changes = []
    for _ in range(6):
        before = controller._commands.copy()
        controller._improve(state, stages, np.zeros(2), 0.2)
        changes.append(np.abs(controller._commands - before).max())
    assert changes[-1] < 1e-3
    # a converged plan is a drive of the model: every node follows from the one before
    after = np.array(controller._linearise(controller._states[:, :-1], controller._commands, stages)[0])
    np.testing.assert_allclose(after, controller._states[:, 1:], atol=1e-3)
    assert controller.failed_solves == 0


def test_it_turns_harder_when_outside():
    actions = []
    for outside in (0.0, 0.05):
        controller = ModelPredictive(MODEL, PRIOR)
        controller(observation(heading_to_go=math.pi / 2))
        controller._place.x, controller._place.y = 0.8 + outside, 0.8
        actions.append(controller(observation(heading_to_go=math.pi / 2)))
    assert actions[1][0] - actions[1][1] > actions[0][0] - actions[0][1] + 0.02


def test_left_and_right_are_mirror_images():
    left = ModelPredictive(MODEL, PRIOR)(observation(encoder_right=1.2, encoder_left=0.3))
    right = ModelPredictive(MODEL, PRIOR)(
        observation({"estimated_yaw_rate": -0.25}, side=-1.0, encoder_right=0.3, encoder_left=1.2)
    )
    np.testing.assert_allclose(left, right[::-1], atol=2e-3)


def test_an_offset_of_the_model_is_learned():
    controller = ModelPredictive(MODEL, PRIOR, PredictiveSettings(offset_rate=0.5))
    for _ in range(3):
        controller(observation())
    expected = controller._expected.copy()
    controller._offset[:] = 0.0
    controller(observation({"estimated_v_x": expected[0] + 0.02, "estimated_yaw_rate": expected[2] - 0.03}))
    assert controller._offset[0] > 0.005
    assert controller._offset[1] < -0.005
    controller.reset()
    assert not controller._offset.any()


def test_needs_the_filters_features():
    with pytest.raises(InputError, match="EKF"):
        ModelPredictive(MODEL, PRIOR)(np.zeros(len(OBSERVATION)))


def test_without_casadi_it_is_one_sentence(monkeypatch):
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(InputError, match=r"-e '\.\[mpc\]'"):
        ModelPredictive(MODEL, PRIOR)


def test_casadi_is_imported_only_when_it_is_used():
    code = (
        "import sys, ddagr_gym.control.model_predictive, ddagr_gym.evaluation.controllers;"
        "sys.exit('casadi' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.slow
def test_a_plan_takes_little_time():
    """Slow, since a time says little on a busy machine."""
    controller, used = ModelPredictive(MODEL, PRIOR), []
    for _ in range(40):
        start = time.process_time()
        controller(observation(encoder_right=1.2, encoder_left=0.3))
        used.append(time.process_time() - start)
    assert np.median(used) < 0.024  # [s] the aim; a third of the control period
    assert len(controller.solve_times) == 40
    assert min(controller.solve_times) > 0.0


def test_beats_constants():
    errors = {}
    for name in ("B1", "B5"):
        settings, errors[name] = make_settings(ekf_features=name == "B5"), []
        for seed in range(50, 54):
            controller = find_controller(name, RowTurn())
            run = drive_turn(controller, settings, seed)
            errors[name].append(abs(turn_metrics(run.columns, run.episode.turn, run.episode.robot).turn.error))
            assert run.success or name == "B1"
    assert np.median(errors["B5"]) < np.median(errors["B1"])
    assert controller.failed_solves == 0
