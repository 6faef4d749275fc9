"""What a policy sees and how its outputs act: mirror symmetry, memory, dead reckoning, limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ddagr_gym.control.observation import EKF_FEATURES, OBSERVATION
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import FilterModel
from ddagr_gym.estimation.force_balance import arc_bank_speed_rows, arc_bank_speeds
from ddagr_gym.estimation.sideslip import CENTRE_AHEAD
from ddagr_gym.parameters import Sensors
from ddagr_gym.policies.design import PolicyDesign
from ddagr_gym.policies.view import PolicyView
from ddagr_gym.presets import ddagr

NAMES = [name for name, _, _ in (*OBSERVATION, *EKF_FEATURES)]
SCALE = dict(zip(NAMES, [scale for _, _, scale in (*OBSERVATION, *EKF_FEATURES)], strict=True))
START = {"side": 1.0, "target_radius": 0.8, "target_speed": 0.2, "heading_to_go": math.pi, "run_in_to_go": 0.5}


DESIGN = PolicyDesign()


def observation(design=DESIGN, **values):
    """One observation (1, entries) of SI values."""
    given = START | values
    full = np.array([given.get(name, 0.0) / SCALE[name] for name in NAMES], dtype=np.float32)
    return full[None, : design.observation_size]


def view_of(design=DESIGN, count=1):
    return PolicyView(design, ddagr(), Sensors(), count)


def named(design, inputs):
    return dict(zip(design.inputs, inputs[0], strict=True))


def mirrored(values):
    """The same instant of a turn to the other side."""
    swapped = dict(values)
    for right, left in (
        ("encoder_right", "encoder_left"),
        ("last_action_right", "last_action_left"),
        ("estimated_slip_right", "estimated_slip_left"),
    ):
        swapped[right], swapped[left] = values[left], values[right]
    for name in ("side", "specific_force_y", "yaw_rate", "estimated_yaw_rate"):
        swapped[name] = -values[name]
    return swapped


@pytest.mark.parametrize("design", [PolicyDesign(), PolicyDesign(features="raw"), PolicyDesign(action="absolute")])
def test_left_and_right_turns_look_and_act_alike(design):
    rng = np.random.default_rng(0)
    left, right = view_of(design), view_of(design)
    for step in range(6):
        values = {name: float(rng.uniform(0.1, 0.4)) for name in NAMES}
        values |= {"side": 1.0, "target_radius": 0.8, "target_speed": 0.2}
        values["heading_to_go"] = math.pi - 0.2 * step
        values["run_in_to_go"] = max(0.2 - 0.1 * step, 0.0)
        seen, twin = observation(design, **values), observation(design, **mirrored(values))
        np.testing.assert_allclose(left.observe(seen), right.observe(twin), atol=1e-6)
        outputs = rng.uniform(-1, 1, (1, 2))
        np.testing.assert_allclose(left.act(outputs, seen), right.act(outputs, twin)[:, ::-1], atol=1e-6)


def test_inputs_are_dimensionless_in_a_steady_turn():
    design = PolicyDesign()
    inputs = view_of(design).observe(
        observation(run_in_to_go=0.0, heading_to_go=2.0, yaw_rate=0.25, estimated_v_x=0.2, estimated_yaw_rate=0.25)
    )
    seen = named(design, inputs)
    assert seen["yaw_rate"] == pytest.approx(1.0)
    assert seen["estimated_speed"] == pytest.approx(1.0)
    assert seen["curvature_error"] == pytest.approx(0.0, abs=1e-6)
    assert (seen["turning"], seen["leaving"]) == (1.0, 0.0)


def test_dead_reckoning_follows_the_commanded_path():
    design, turn = PolicyDesign(), RowTurn(run_in=0.5, run_out=0.5)
    view = view_of(design)
    view.observe(observation())
    steps = int(turn.duration / 0.08)
    worst = {"cross_track_error": 0.0, "heading_error": 0.0}
    for step in range(1, steps + 1):
        distance = turn.speed * 0.08 * step
        # the yaw rate at the interval's end, as the filter gives it
        rate = float(turn.yaw_rate(distance))
        seen = named(
            design,
            view.observe(
                observation(
                    estimated_v_x=turn.speed,
                    estimated_yaw_rate=rate,
                    heading_to_go=float(turn.heading_to_go(turn.heading(distance))),
                    run_in_to_go=max(turn.run_in - distance, 0.0),
                )
            ),
        )
        worst = {name: max(value, abs(seen[name]) / 10.0) for name, value in worst.items()}
    # trapezoids cut the corners of the yaw rate by half a step of 16 mm at entry and exit
    assert worst["cross_track_error"] * turn.radius < 0.005
    assert worst["heading_error"] < 0.5 * 0.25 * 0.08 + 1e-6
    assert seen["estimated_heading_to_go"] == pytest.approx(0.0, abs=0.01)
    assert seen["leaving"] == 1.0


def test_sideslip_moves_the_course_and_not_the_heading():
    design = PolicyDesign()
    view = view_of(design)
    view.observe(observation())
    for _ in range(20):
        view.observe(observation(estimated_v_x=0.2))
    steady = {"run_in_to_go": 0.0, "estimated_v_x": 0.2, "estimated_yaw_rate": 0.25}
    for _ in range(40):
        without = named(design, view.observe(observation(heading_to_go=2.0, specific_force_y=0.05, **steady)))
    # the body turns about a point ahead of its origin, which therefore slides outwards
    assert without["sideslip"] == pytest.approx(-10.0 * CENTRE_AHEAD * 0.25 / 0.2, abs=0.3)
    assert without["course_error"] < without["heading_error"]
    for _ in range(20):  # pushed to the left at 5 mm/s^2
        pushed = named(design, view.observe(observation(heading_to_go=2.0, specific_force_y=0.055, **steady)))
    assert pushed["sideslip"] > without["sideslip"] + 0.05
    assert pushed["sideslip_deviation"] > 0.0
    assert pushed["course_cross_track_error"] < pushed["cross_track_error"]


def test_cross_track_error_is_positive_to_the_left():
    design = PolicyDesign()
    view = view_of(design)
    view.observe(observation(side=-1.0))
    for _ in range(10):  # veers to the left in the run-in of a right turn: to the right once mirrored
        inputs = view.observe(observation(side=-1.0, estimated_v_x=0.2, estimated_yaw_rate=0.2))
    assert named(design, inputs)["cross_track_error"] < -0.01
    assert named(design, inputs)["heading_error"] < -0.1


def test_without_correction_the_feed_forward_is_the_force_balance():
    robot = ddagr()
    model = FilterModel.of(robot, Sensors())
    prior = model.soil_prior.logs(model.wheel_load)[0]
    seen = observation(run_in_to_go=0.0, heading_to_go=2.0, log_traction_limit=0.3, log_motion_resistance=-0.2)
    expected = arc_bank_speeds(model, np.exp(prior + np.array([0.3, 0.0, 0.0, -0.2])), 0.2, 1.25)
    view = view_of()
    view.observe(seen)
    np.testing.assert_allclose(view.act(np.zeros((1, 2)), seen)[0] * robot.maximum_wheel_speed, expected, rtol=1e-5)
    raw = PolicyDesign(features="raw")
    nominal = arc_bank_speeds(model, np.exp(prior), 0.2, 1.25)
    np.testing.assert_allclose(view_of(raw).act(np.zeros((1, 2)), seen[:, :12])[0] * 2.0, nominal, rtol=1e-5)


def test_corrections_change_curvature_and_speed():
    robot, view = ddagr(), view_of(PolicyDesign(rate_limit=2.0))
    model = FilterModel.of(robot, Sensors())
    seen = observation(run_in_to_go=0.0, heading_to_go=2.0)
    prior = np.exp(model.soil_prior.logs(model.wheel_load)[0])
    expected = arc_bank_speeds(model, prior, 0.2 * (1 - 0.25 * 0.4), 1.25 * (1 + 0.5 * 0.6))
    np.testing.assert_allclose(view.act(np.array([[0.6, -0.4]]), seen)[0] * 2.0, expected, rtol=1e-5)


def test_outputs_are_rate_limited_and_clipped():
    design = PolicyDesign(action="absolute", rate_limit=0.25)
    view = view_of(design)
    seen = observation()
    view.observe(seen)
    actions = [view.act(np.array([[5.0, -5.0]]), seen)[0] for _ in range(6)]
    np.testing.assert_allclose([a[0] for a in actions], [0.25, 0.5, 0.75, 1.0, 1.0, 1.0])
    np.testing.assert_allclose([a[1] for a in actions], [-0.25, -0.5, -0.75, -1.0, -1.0, -1.0])


@pytest.mark.parametrize("delay_steps", [0, 2])
def test_the_response_time_is_that_of_the_motors(delay_steps):
    """A first-order lag of 0.3 s and a dead time, seen from the start from rest to the end of the run-in."""
    design = PolicyDesign(features="raw")
    view, speed, rate, sent = view_of(design), 0.0, 1.0 / 0.3, []
    view.observe(observation(design))
    for step in range(40):
        command = 0.36
        sent.append(2.0 * command)
        target = sent[-1 - delay_steps] if len(sent) > delay_steps else 0.0
        kept = math.exp(-rate * 0.08)
        mean = target + (speed - target) * (1.0 - kept) / (rate * 0.08)
        speed = target + (speed - target) * kept
        values = {"encoder_right": mean, "encoder_left": mean, "last_action_right": command}
        run_in = 0.5 if step < 35 else 0.0
        inputs = view.observe(observation(design, **values, last_action_left=command, run_in_to_go=run_in))
    expected = 0.3 + 0.08 * delay_steps
    assert named(design, inputs)["response_time"] == pytest.approx(expected, abs=2e-3)
    view.reset()
    assert named(design, view.observe(observation(design)))["response_time"] == 0.0


def test_slow_motors_are_commanded_earlier():
    design = PolicyDesign(features="raw")
    turning = {}
    for name, encoder in (("fast", 0.7), ("slow", 0.1)):
        view = view_of(design)
        view.observe(observation(design))
        values = {"encoder_right": encoder, "encoder_left": encoder, "last_action_right": 0.36}
        for _ in range(5):
            inputs = view.observe(observation(design, **values, last_action_left=0.36, run_in_to_go=0.06))
        turning[name] = named(design, inputs)["turning"]
    assert turning == {"fast": 0.0, "slow": 1.0}


def test_history_holds_past_instants_and_starts_with_the_first():
    design = PolicyDesign(features="raw", frames=3, frame_interval=2)
    view, width = view_of(design), len(PolicyDesign(features="raw").inputs)
    force = design.inputs.index("specific_force_x")
    for step in range(6):
        inputs = view.observe(observation(design, specific_force_x=0.1 * (step + 1)))
        assert inputs.shape == (1, 3 * width)
        past = [max(step - back, 0) for back in (0, 2, 4)]
        np.testing.assert_allclose(inputs[0, force::width], [0.1 * (p + 1) for p in past], atol=1e-6)


def test_rows_are_independent_and_forget_at_reset():
    rng = np.random.default_rng(3)
    episodes = [
        [observation(**{name: float(v) for name, v in zip(NAMES[:6], rng.uniform(0, 0.3, 6), strict=True)})
         for _ in range(5)] for _ in range(3)
    ]  # fmt: skip
    together, outputs = view_of(count=3), rng.uniform(-1, 1, (5, 3, 2))
    alone = [view_of() for _ in range(3)]
    for step in range(5):
        stacked = np.concatenate([episode[step] for episode in episodes])
        joint = together.observe(stacked)
        acted = together.act(outputs[step], stacked)
        for n, view in enumerate(alone):
            np.testing.assert_array_equal(joint[n], view.observe(episodes[n][step])[0])
            np.testing.assert_array_equal(acted[n], view.act(outputs[step, n : n + 1], episodes[n][step])[0])
    together.reset(np.array([1]))
    first = together.observe(episodes[1][0], np.array([1]))
    np.testing.assert_array_equal(first, view_of().observe(episodes[1][0]))


def test_memory_goes_back():
    view, seen = view_of(), observation(estimated_v_x=0.2)
    view.observe(seen)
    saved = view.memory()
    first = [view.observe(seen), view.act(np.ones((1, 2)), seen), view.observe(seen)]
    view.restore(saved)
    for one, two in zip(first, [view.observe(seen), view.act(np.ones((1, 2)), seen), view.observe(seen)], strict=True):
        np.testing.assert_array_equal(one, two)


def test_rows_of_the_force_balance_are_single_solutions_and_kinematic_without_one():
    robot = ddagr()
    model = FilterModel.of(robot, Sensors())
    prior = model.soil_prior.logs(model.wheel_load)[0]
    logs = prior + np.array([[0, 0, 0, 0], [0.5, -0.3, 0.2, 0.4], [-4.0, -3.0, -7.0, 3.0]])
    banks = arc_bank_speed_rows(model, np.exp(logs), np.full(3, 0.2), np.array([1.25, -0.8, 1.25]), fallback=1.5)
    for n, curvature in ((0, 1.25), (1, -0.8)):
        # exp of a row and of a matrix may differ in the last bit
        np.testing.assert_allclose(banks[n], arc_bank_speeds(model, np.exp(logs[n]), 0.2, curvature), rtol=1e-12)
    assert arc_bank_speeds(model, np.exp(logs[2]), 0.2, 1.25) is None
    spread = 1.5 * robot.half_track * 1.25
    np.testing.assert_allclose(banks[2] * model.outer_radius, [0.2 * (1 + spread), 0.2 * (1 - spread)])


@pytest.mark.parametrize(
    "change", [{"frames": 0}, {"frames": 2.5}, {"frame_interval": True}, {"features": "all"}, {"rate_limit": 0.0}]
)
def test_designs_are_checked(change):
    with pytest.raises(InputError):
        PolicyDesign(**change)
