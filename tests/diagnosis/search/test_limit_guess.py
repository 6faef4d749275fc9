"""Where the refit of a limit starts: kinds and sizes of limits compared by what they leave."""

from dataclasses import replace

import pytest

from ddagr_gym.diagnosis.search.limit_guess import limit_guesses
from ddagr_gym.diagnosis.search.scan import scan
from ddagr_gym.identification.gauss_newton import cost_of, fit
from ddagr_gym.physics.effects.registry import effect_kind

NAME = "motor_saturation"


@pytest.mark.parametrize(("field", "limit"), [("torque_limit", 35.0), ("power_limit", 15.0), ("turning_limit", 0.35)])
def test_the_kind_of_limit_and_about_its_size_are_found(drive, problem_of, field, limit):
    problem = problem_of(drive((f"{NAME}=1000,{field}={limit}",)))
    raw = fit(problem, iterations=0)
    terms = scan(problem, raw, {NAME: effect_kind(NAME)})
    found, second = limit_guesses(problem, raw, (), terms.candidates)
    assert getattr(found, field) == pytest.approx(limit, rel=0.4)
    assert getattr(second, field) == effect_kind(NAME).parameter(field).metadata["neutral"]
    point = replace(raw.point, effects=(found,))
    assert cost_of(problem, point, problem.predict(point), raw.elimination)[0] < 0.2 * raw.cost


def test_only_what_has_no_derivative_and_no_sign_is_a_limit(drive, problem_of):
    problem = problem_of(drive(seconds=8.0))
    nominal = fit(problem, iterations=0)
    kinds = {name: effect_kind(name) for name in (NAME, "gyro_sign", "motor_lag")}
    assert {item.name for item in scan(problem, nominal, kinds).candidates if item.is_limit} == {NAME}
