"""Intervals are as wide as resampling and the forms of simulators say, and stay within what exists."""

import math
from collections.abc import Mapping
from dataclasses import fields, replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.gates.thresholds import UNMISTAKABLE, Gate, Thresholds
from ddagr_gym.diagnosis.result.detectable import least_detectable
from ddagr_gym.diagnosis.result.uncertainty import (
    FORM,
    STRUCTURE,
    STRUCTURE_OF_LIMIT,
    STRUCTURE_OF_LOAD,
    resampled_parameters,
    with_structure,
)
from ddagr_gym.diagnosis.search.candidates import Candidate, candidates_of, moved_field
from ddagr_gym.diagnosis.search.inner_products import Terms
from ddagr_gym.identification.gauss_newton import fit
from ddagr_gym.identification.nuisances import NuisancePriors, absorbed_sizes, nuisances
from ddagr_gym.identification.size_prior import size_scale
from ddagr_gym.physics.effects import Effect, effect_kind, parse_effect
from ddagr_gym.physics.effects.base import DriveExtent
from ddagr_gym.presets import get_robot

EXTENT = DriveExtent(60.0, (0.0, 8.0), (0.0, 6.0), 1.2, 3.0)
GATE, DISPERSION = 2.0, 4.0


@pytest.mark.parametrize(
    ("text", "field", "value", "away", "least"),
    [
        ("command_delay=0.2", "delay", 0.2, 0.2, 0.02),
        ("gyro_scale=1.001", "scale", 1.001, 0.001, 0.01),
        ("gyro_scale=1.08", "scale", 1.08, 0.08, 0.01),
    ],
)
def test_intervals_have_a_width_however_many_windows_there_are(
    text: str, field: str, value: float, away: float, least: float
) -> None:
    """A share of the least meaningful size and one of the distance from neutral, which is not always zero."""
    low, high = with_structure((value, value), parse_effect(text), field)
    assert (high - low) / 2.0 == pytest.approx(math.hypot(STRUCTURE * least, FORM * away))
    assert (low + high) / 2.0 == pytest.approx(value)


def test_what_resampling_says_adds_in_quadrature() -> None:
    low, high = with_structure((0.1, 0.3), parse_effect("command_delay=0.2"), "delay")
    alone = with_structure((0.2, 0.2), parse_effect("command_delay=0.2"), "delay")
    assert (high - low) / 2.0 == pytest.approx(math.hypot(0.1, (alone[1] - alone[0]) / 2.0))


def test_a_limit_is_uncertain_by_a_share_of_itself() -> None:
    low, high = with_structure((0.8, 0.8), parse_effect("motor_saturation=0.8"), "speed_limit")
    assert (high - low) / 2.0 == pytest.approx(STRUCTURE_OF_LIMIT * 0.8)


@pytest.mark.parametrize("field", ["torque_limit", "power_limit"])
def test_a_limit_that_only_the_grounds_resistance_shows_is_as_uncertain_as_that(field: str) -> None:
    low, high = with_structure((40.0, 40.0), parse_effect(f"motor_saturation=1000,{field}=40"), field)
    assert (low, high) == pytest.approx((40.0 * (1.0 - STRUCTURE_OF_LOAD), 40.0 * (1.0 + STRUCTURE_OF_LOAD)))


def test_shapes_keep_their_intervals_and_bounds_hold() -> None:
    delay = parse_effect("command_delay=0.2,imbalance=0.3")
    assert with_structure((0.2, 0.4), delay, "imbalance") == pytest.approx((0.2, 0.4))
    assert with_structure((0.0, 0.001), parse_effect("command_delay=0.0005"), "delay")[0] == 0.0


def least_of(
    candidates: list[Candidate],
    information: Mapping[int, float],
    explained: Mapping[int, float] | None = None,
    absorbed: Mapping[str, float] | None = None,
) -> dict[str, float]:
    """Least detectable sizes of one effect, whose probes have this information, one nuisance explaining some of it."""
    count = sum(len(candidate.columns) for candidate in candidates)
    normals = np.zeros((1, 2 + count, 2 + count))
    normals[0, 1, 1] = 1.0
    for column, value in information.items():
        normals[0, 2 + column, 2 + column] = value
    for column, value in (explained or {}).items():
        normals[0, 1, 2 + column] = normals[0, 2 + column, 1] = math.sqrt(value)
    none = np.zeros(1, dtype=np.int64)
    terms = Terms(normals, np.zeros(1), np.zeros(1), tuple(candidates), none, np.zeros(1), absorbed=absorbed or {})
    name = candidates[0].name
    return least_detectable(terms, Thresholds({name: Gate(GATE, 0.0)}, {}, 20, "a test"), DISPERSION)[name]


def reaching(step: float, information: float, gate: float = GATE) -> float:
    """Size whose score over the root of the dispersion stands 1.28 above what passes the gate."""
    return step * math.sqrt(DISPERSION / information) * (math.sqrt(2.0 * gate) + 1.2816)


def named(kind: type[Effect], field: str, information: float) -> float:
    """Size that is named: at the gate, and meaningful or unmistakable."""
    data = kind.parameter(field).metadata
    unmistakable = reaching(data["step"], information, UNMISTAKABLE * GATE)
    return max(reaching(data["step"], information), min(data["least"], unmistakable))


def test_a_size_below_its_least_meaningful_one_has_to_be_unmistakable() -> None:
    """0.05 m/s^2 is a bias that matters: shown from 0.01 or 0.04 on, it is named from three times the gate or 0.05."""
    kind = effect_kind("accelerometer_bias")
    data = kind.parameter("x").metadata
    for shown in (0.01, 0.04, 0.2):
        information = (reaching(data["step"], 1.0) / shown) ** 2
        tripled = shown * (math.sqrt(6.0 * GATE) + 1.2816) / (math.sqrt(2.0 * GATE) + 1.2816)
        expected = {0.01: tripled, 0.04: data["least"], 0.2: 0.2}[shown]
        assert least_of(candidates_of(kind, EXTENT, 0), {0: information})["x"] == pytest.approx(expected)


def test_a_change_that_may_begin_at_any_time_counts_from_the_beginning_on() -> None:
    kind = effect_kind("soil_change")
    candidates = candidates_of(kind, EXTENT, 0)
    onsets = [candidate.probes[0].as_mapping()["parameters"]["onset"] for candidate in candidates]
    whole = onsets.index(kind.parameter("onset").default)
    assert len(onsets) > 1
    information = {column: 1e4 for candidate in candidates for column in candidate.columns}
    strength, stiffness = candidates[whole].columns
    least = least_of(candidates, information | {strength: 400.0, stiffness: 100.0})
    assert least == pytest.approx(
        {"strength": named(kind, "strength", 400.0), "stiffness": named(kind, "stiffness", 100.0)}
    )


def test_of_places_the_median_counts_of_those_that_were_driven_over() -> None:
    kind = effect_kind("soil_patch")
    candidates = candidates_of(kind, EXTENT, 0)
    driven = candidates[2:5]
    information = {c.columns[0]: value for c, value in zip(driven, (100.0, 400.0, 1e6), strict=True)}
    least = least_of(candidates, information)
    assert least["strength"] == pytest.approx(named(kind, "strength", 400.0))
    assert least["stiffness"] == np.inf


def test_of_two_directions_the_one_that_shows_worst_counts() -> None:
    kind = effect_kind("slope")
    for information in ({0: 100.0, 1: 900.0}, {0: 900.0, 1: 100.0}):
        least = least_of(candidates_of(kind, EXTENT, 0), information)
        assert least == {"angle": pytest.approx(named(kind, "angle", 100.0))}


def test_of_two_ways_to_act_the_usual_one_counts() -> None:
    kind = effect_kind("motor_droop")
    least = least_of(candidates_of(kind, EXTENT, 0), {0: 900.0, 1: 400.0, 2: 100.0})
    expected = {"droop": named(kind, "droop", 900.0), "recovery": named(kind, "recovery", 400.0)}
    assert least == pytest.approx(expected)


def test_a_size_that_cannot_exist_is_not_detectable() -> None:
    """A pose that is up to 1 s late: what would take 1.1 s shows at no size."""
    kind = effect_kind("pose_latency")
    data = kind.parameter("latency").metadata
    candidates = candidates_of(kind, EXTENT, 0)
    for size in (0.9, 1.1):
        information = (reaching(data["step"], 1.0) / (size * data["high"])) ** 2
        expected = size * data["high"] if size < 1.0 else np.inf
        assert least_of(candidates, {0: information}) == {"latency": pytest.approx(expected)}


def test_what_a_nuisance_explains_detects_nothing() -> None:
    kind = effect_kind("payload")
    step = kind.parameter("mass").metadata["step"]
    least = least_of(candidates_of(kind, EXTENT, 0), {0: 100.0}, {0: 75.0})
    assert least == {"mass": pytest.approx(reaching(step, 25.0))}


def test_of_limits_the_mildest_that_shows_stands_as_it_is() -> None:
    kind = effect_kind("motor_saturation")
    candidates = candidates_of(kind, EXTENT, 0)
    enough = 2.0 * DISPERSION * (math.sqrt(2.0 * GATE) + 1.2816) ** 2 / 2.0
    names = [moved_field(candidate.probes[0])[0] for candidate in candidates]
    speeds = [k for k, name in enumerate(names) if name == "speed_limit"]
    values = sorted(candidates[k].probes[0].speed_limit for k in speeds)
    all_of_them = {candidate.columns[0]: 1.01 * enough for candidate in candidates}
    assert least_of(candidates, all_of_them)["speed_limit"] == pytest.approx(values[-1])
    mildest = next(k for k in speeds if candidates[k].probes[0].as_mapping()["parameters"]["speed_limit"] == values[-1])
    assert least_of(candidates, all_of_them | {mildest: 0.99 * enough})["speed_limit"] == pytest.approx(values[-2])
    nothing = least_of(candidates, dict.fromkeys(all_of_them, 0.99 * enough))
    assert set(nothing) == {item.name for item in fields(kind)}
    assert set(nothing.values()) == {np.inf}


def test_what_a_nuisance_would_take_over_comes_on_top() -> None:
    late = nuisances(get_robot("ddagr"), 1, 0.02).parameters
    values = np.array([0.015 if parameter.name == "command_shift" else 0.0 for parameter in late])
    assert absorbed_sizes(late, values) == {"command_delay": pytest.approx(0.025)}
    candidates = candidates_of(effect_kind("command_delay"), EXTENT, 0)
    every = {column: 1e4 for candidate in candidates for column in candidate.columns}
    bare = reaching(effect_kind("command_delay").parameter("delay").metadata["step"], 1e4)
    # all of it together is more than the least meaningful delay of 0.02 s
    assert least_of(candidates, every, absorbed={"command_delay": 0.025})["delay"] == pytest.approx(bare + 0.025)


def test_a_reversed_sign_shows_or_does_not() -> None:
    candidates = candidates_of(effect_kind("gyro_sign"), EXTENT, 0)
    whole = candidates[0].whole
    assert whole is not None
    enough = DISPERSION * (math.sqrt(2.0 * GATE) + 1.2816) ** 2 / whole**2
    assert least_of(candidates, {0: 1.01 * enough}) == {"flip": pytest.approx(1.0)}
    assert least_of(candidates, {0: 0.99 * enough}) == {"flip": np.inf}


def test_a_size_is_as_uncertain_as_what_the_data_cannot_tell_it_from(drive, problem_of) -> None:
    """A biased accelerometer and the recording's own bias are one sum; of a scale the data say it all."""
    problem = problem_of(drive(("accelerometer_bias=0.1",), seconds=10.0))
    effects = (parse_effect("accelerometer_bias=0.1"), parse_effect("gyro_scale=1.0"))
    fitted = fit(problem, replace(problem.start(), effects=effects), iterations=2)
    draws = resampled_parameters(problem, fitted, np.random.default_rng(3))
    deviations = dict(zip([p.field for p in draws.parameters], draws.effects.std(axis=0).tolist(), strict=True))
    assert deviations["x"] == pytest.approx(NuisancePriors().accelerometer_bias, rel=0.2)
    assert deviations["scale"] < 0.5 * size_scale(effects[1], "scale")


def test_an_interval_holds_its_value() -> None:
    """One window of many may carry a fit: most resamplings leave it out."""
    low, high = with_structure((0.1, 0.15), parse_effect("command_delay=0.3"), "delay")
    assert low < 0.1
    assert high == 0.3


def test_sizes_of_a_soil_are_widened_as_factors() -> None:
    """Half as strong and twice as strong are as uncertain as each other."""
    weak, strong = (with_structure((size, size), parse_effect(f"soil_split={size}"), "strength") for size in (0.5, 2.0))
    assert weak[0] * strong[1] == pytest.approx(1.0)
    assert weak[1] * strong[0] == pytest.approx(1.0)
    assert math.log(strong[1] / 2.0) == pytest.approx(math.hypot(STRUCTURE * math.log(1.2), FORM * math.log(2.0)))
    low, high = with_structure((9.9, 10.0), parse_effect("soil_split=9.95"), "strength")
    assert low < 9.0
    assert high == pytest.approx(10.0)
