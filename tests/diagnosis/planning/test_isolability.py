"""Before any data: detectable sizes and confused pairs of planned drives."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.control.manoeuvres import Manoeuvre
from ddagr_gym.diagnosis.gates.thresholds import Gate, Thresholds
from ddagr_gym.diagnosis.planning.isolability import SCHEMA, chance_gates, isolability
from ddagr_gym.diagnosis.planning.planned_drive import plan
from ddagr_gym.diagnosis.result.equivalence import APART, FORM
from ddagr_gym.diagnosis.search.inner_products import InnerProducts
from ddagr_gym.diagnosis.search.scan import scan
from ddagr_gym.errors import InputError
from ddagr_gym.physics.effects.registry import effect_kinds
from ddagr_gym.presets import get_robot, get_soil

STRAIGHT = Manoeuvre("short_straight", ((6.0, 0.8, 0.8),))
TURN = Manoeuvre("short_turn", ((4.0, 0.8, 0.8), (7.0, 0.8, -0.8), (4.0, 0.8, 0.8)))
FEW = ("slope", "accelerometer_bias", "gyro_scale", "gyro_sign", "motor_saturation")


def table(manoeuvres, sensors=("imu", "encoders", "pose"), names=FEW, **options):
    kinds = {name: effect_kinds()[name] for name in names}
    return isolability(get_robot("ddagr"), get_soil("thesis_a1"), manoeuvres, sensors, kinds=kinds, **options)


def entry(found, row, column):
    return found.share[found.effects.index(row)][found.effects.index(column)]


@pytest.fixture(scope="module")
def straight():
    return table([STRAIGHT])


@pytest.fixture(scope="module")
def turn():
    return table([TURN])


def test_slope_and_bias_need_a_change_of_heading(straight, turn) -> None:
    assert entry(straight, "slope", "accelerometer_bias") < 0.05
    assert "accelerometer_bias" in straight.confused("slope")
    assert entry(turn, "slope", "accelerometer_bias") > 0.3
    assert "slope" not in turn.confused("accelerometer_bias")


def test_a_gyro_scale_does_not_show_in_a_straight_drive(straight, turn) -> None:
    hidden, shown = straight.of("gyro_scale"), turn.of("gyro_scale")
    assert hidden.multiples > 20.0 * shown.multiples
    # 5 % of the yaw rate of a quarter turn stands far above the noise of a gyro of 0.7 mrad/s
    assert shown.size < 0.05
    # the sign is a scale of -1, far outside of what scales are: the scale cannot pass for a flip
    assert entry(turn, "gyro_sign", "gyro_scale") < 0.2
    assert entry(turn, "gyro_scale", "gyro_sign") > 0.9


def test_a_delay_shows_beyond_what_the_meaning_of_rows_may_take() -> None:
    """Two samples, here of 20 ms: loggers differ by as much."""
    found = table([TURN], names=("command_delay", "motor_lag")).of("command_delay")
    assert 0.04 < found.size < 0.1
    assert found.multiples * found.least_meaningful == pytest.approx(found.size)


def test_limits_are_given_as_values_that_would_show(turn) -> None:
    limits = [item for item in turn.detectable if item.effect == "motor_saturation"]
    speed = next(item for item in limits if item.field == "speed_limit")
    # probes are 0.9 and 0.6 of the fastest command; 0.9 of it is plain to see
    assert speed.size == pytest.approx(0.9 * 0.8, rel=0.05)
    assert speed.multiples < 1.0


def test_sizes_scale_with_the_score_that_passes_the_gate(straight) -> None:
    gates = {name: Gate(40.0, 0.0) for name in FEW}
    wide = table([STRAIGHT], thresholds=Thresholds(gates, {}, 0, "by hand"))
    chance = chance_gate(straight)
    assert wide.of("accelerometer_bias").size == pytest.approx(
        straight.of("accelerometer_bias").size * (math.sqrt(80.0) + 1.2816) / (math.sqrt(2.0 * chance) + 1.2816),
        rel=1e-6,
    )
    assert wide.gates == "by hand"


def chance_gate(found) -> float:
    from scipy.stats import chi2

    return 0.5 * float(chi2.ppf(0.95 ** (1.0 / len(found.effects)), 2))


def test_chance_gates_hold_their_level_for_normal_errors() -> None:
    prepared = plan(get_robot("ddagr"), get_soil("thesis_a1"), [STRAIGHT])
    kinds = {name: effect_kinds()[name] for name in ("slope", "accelerometer_bias")}
    terms = scan(prepared.problem, prepared.fitted, kinds)
    gates = chance_gates(terms)
    draws = np.random.default_rng(1).standard_normal((4000, 2, 2))
    largest = 0.5 * (draws**2).sum(axis=2)
    passed = (largest > [gates.of("slope").gain, gates.of("accelerometer_bias").gain]).any(axis=1)
    assert passed.mean() == pytest.approx(0.05, abs=0.012)


def test_told_apart_never_below_detected(turn) -> None:
    for i, name in enumerate(turn.effects):
        others = [v for j, v in enumerate(turn.apart[i]) if j != i]
        assert min(others) >= turn.of(name).multiples * (1.0 - 1e-9)
    assert math.isclose(APART, math.log(0.95 / 0.05))


def test_what_differs_by_less_than_a_form_errs_is_told_apart_at_no_size(straight, turn) -> None:
    for found in (straight, turn):
        share, apart = np.array(found.share), np.array(found.apart)
        within = share < APART * FORM
        assert within.any()
        assert np.isinf(apart[within]).all()
    assert np.isfinite(np.array(turn.apart)[np.array(turn.share) > APART * FORM]).any()


def test_nuisances_with_priors_take_their_share() -> None:
    # one nuisance equal to the column: with precision q against information 1 it leaves q / (1 + q)
    inner = InnerProducts(np.ones((1, 3, 3)), np.array([0.25]), np.zeros(1))
    assert inner.reduced().information[0, 0] == pytest.approx(0.2)


def test_json_form(turn) -> None:
    mapping = json.loads(json.dumps(turn.as_mapping(), allow_nan=False))
    assert mapping["schema"] == SCHEMA == "ddagr-isolability/1"
    assert set(mapping["effects"]) == set(FEW)
    assert mapping["isolability"]["slope"]["gyro_scale"] == pytest.approx(entry(turn, "slope", "gyro_scale"))
    assert "slope" not in mapping["isolability"]["slope"]
    assert mapping["duration"] == 15.0


@pytest.mark.parametrize(
    ("manoeuvres", "sensors", "words"),
    [
        ([], ("imu",), "no manoeuvre"),
        ([replace(STRAIGHT, segments=((1.0, 0.8, 0.8),))], ("imu",), "longer than a window"),
        ([STRAIGHT], (), "no sensor"),
        ([STRAIGHT], ("imus",), "imu"),
    ],
)
def test_bad_plans_are_one_sentence(manoeuvres, sensors, words) -> None:
    with pytest.raises(InputError, match=words):
        table(manoeuvres, sensors)


def test_without_a_pose_there_is_no_latency_to_see() -> None:
    found = table([STRAIGHT], ("imu", "encoders"), ("pose_latency", "accelerometer_bias"))
    assert found.of("pose_latency").multiples == math.inf
    assert found.as_mapping()["effects"]["pose_latency"]["detectable"][0]["size"] is None
    assert found.of("accelerometer_bias").multiples < 5.0
