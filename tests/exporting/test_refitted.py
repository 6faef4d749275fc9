"""Robot and soil drawn as an answer says how sure they are."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.answer.nuisance_spread import NuisanceSpread
from ddagr_gym.diagnosis.answer.verdict import Diagnosis, Estimate, Finding, GatesUsed
from ddagr_gym.diagnosis.result.files import as_mapping, save
from ddagr_gym.errors import InputError
from ddagr_gym.exporting.refitted import read_answer, refitted_draws
from ddagr_gym.presets import get_robot, get_soil

SPREAD = NuisanceSpread(
    {"soil_strength": (-0.2, 0.2), "friction": (-0.1, 0.3), "mass": (0.0, 0.1), "gyro_bias_1": (-1e-3, 1e-3)},
    ("soil_strength", "friction", "mass"),
    ((1.0, -1.0, 0.0), (-1.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
)
LOOP = Finding(
    "integral",
    {"integral_rate": Estimate(0.5, "1/s", (0.4, 0.6)), "note": Estimate(1.0, "-", (0.0, 2.0))},
    1.0, 0.0, 1.0, 1.0,
)  # fmt: skip
SPEED = Finding("speed_loop", {"motor_rate": Estimate(4.5, "1/s", (4.0, 5.0))}, 1.0, 0.0, 1.0, 1.0)
ANSWER = Diagnosis(
    ("speed_loop", "integral"), True, (SPEED, LOOP), "Missing.", {}, {}, {}, ("a.csv",),
    GatesUsed(nulls=60, bank="f", level=0.05), 1.0, "0", nuisance_spread=SPREAD,
)  # fmt: skip
ROBOT, SOIL = get_robot("ddagr"), get_soil("thesis_a1")


def draws(answer: Diagnosis, count: int = 2000, most: float = 3.0) -> list:
    made = refitted_draws(answer, ROBOT, SOIL, most)
    rng = np.random.default_rng(0)
    return [made.draw(rng) for _ in range(count)]


def test_refitted_values_are_drawn_from_their_intervals():
    mass = np.log([robot.mass / ROBOT.mass for robot, _ in draws(ANSWER)])
    assert np.percentile(mass, [5, 95]) == pytest.approx([-0.05, 0.05], abs=0.004)
    cohesion = np.log([soil.cohesion / SOIL.cohesion for _, soil in draws(ANSWER)])
    assert np.percentile(cohesion, [5, 95]) == pytest.approx([-0.2, 0.2], abs=0.015)


def test_what_goes_together_is_drawn_together():
    tangent = [math.log(math.tan(soil.friction_angle) / math.tan(SOIL.friction_angle)) for _, soil in draws(ANSWER)]
    assert np.abs(tangent).max() < 1e-9  # strength and friction take each other back
    apart = replace(SPREAD, correlation=tuple(map(tuple, np.eye(3).tolist())))
    made = draws(replace(ANSWER, nuisance_spread=apart), 200)
    tangent = [math.log(math.tan(soil.friction_angle) / math.tan(SOIL.friction_angle)) for _, soil in made]
    assert np.std(tangent) > 0.1


def test_draws_are_cut_off():
    mass = np.log([robot.mass / ROBOT.mass for robot, _ in draws(ANSWER, most=1.0)])
    assert np.abs(mass).max() == pytest.approx(0.1 / 3.29)


def test_parts_of_the_drivetrain_are_drawn_and_what_the_refit_moved_is_drawn_once():
    made = draws(replace(ANSWER, findings=(SPEED, LOOP)))
    rates = [robot.motor_rate for robot, _ in made]
    assert np.percentile(rates, [5, 95]) == pytest.approx([4.03, 5.03], abs=0.04)
    integral = np.array([robot.drivetrain.integral_rate for robot, _ in made])
    assert integral.min() == 0.0  # below it there is no robot
    refitted = replace(
        SPREAD,
        intervals={**SPREAD.intervals, "motor_rate": (0.0, 0.0)},
        shared=(*SPREAD.shared, "motor_rate"),
        correlation=tuple(map(tuple, np.eye(4).tolist())),
    )
    assert {robot.motor_rate for robot, _ in draws(replace(ANSWER, nuisance_spread=refitted), 20)} == {4.5}


def test_hardly_a_valid_draw_is_one_sentence():
    wide = replace(SPREAD, intervals={**SPREAD.intervals, "mass": (-9e5, 9e5)}, shared=("mass",), correlation=((1.0,),))
    made = refitted_draws(
        replace(ANSWER, nuisance_spread=wide, findings=()), replace(ROBOT, standard_deviations={}), SOIL, 3.0
    )
    with pytest.raises(InputError, match=r"100 draws .* are all invalid \(.+\): diagnose anew"):
        made.draw(np.random.default_rng(0))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"shared": ("soil_strength", "friction", "height")}, "no interval of 'height'"),
        ({"correlation": ((1.0,),)}, "needs 3 rows of 3 correlations"),
        ({"correlation": ((1.0, math.nan, 0.0),) * 3}, "needs 3 rows of 3 correlations"),
        ({"intervals": {**SPREAD.intervals, "mass": (0.2, 0.1)}}, "an interval without low and high"),
        ({"intervals": {**SPREAD.intervals, "mass": (math.nan, 0.1)}}, "an interval without low and high"),
    ],
)
def test_a_spread_that_does_not_fit_is_one_sentence(change, said):
    with pytest.raises(InputError, match=f"{said}: diagnose anew"):
        refitted_draws(replace(ANSWER, nuisance_spread=replace(SPREAD, **change)), ROBOT, SOIL, 3.0)


def test_answers_are_read_and_those_of_before_have_no_draws(tmp_path):
    path = tmp_path / "diagnosis.json"
    save(ANSWER, path)
    assert read_answer(path) == ANSWER
    save(replace(ANSWER, nuisance_spread=None), path)
    assert "nuisance_spread" not in json.loads(path.read_text())
    assert refitted_draws(read_answer(path), ROBOT, SOIL, 3.0) is None
    path.write_text(json.dumps({**as_mapping(ANSWER), "schema": "ddagr-diagnosis/3"}))
    assert read_answer(path) is None
    path.write_text("[]")
    with pytest.raises(InputError, match=r"cannot be read as a diagnosis \(it holds no mapping\)"):
        read_answer(path)
    path.write_text(json.dumps({**as_mapping(ANSWER), "nuisance_spread": {"shared": []}}))
    with pytest.raises(InputError, match=r"diagnosis\.json is wrong at nuisance_spread: .*: make it again"):
        read_answer(path)
