"""Limits that nothing reaches are left out of tables."""

from ddagr_gym.diagnosis.answer.verdict import Estimate, Finding
from ddagr_gym.reporting.shown_parameters import shown_parameters


def finding(name: str, **values: float) -> Finding:
    return Finding(name, {key: Estimate(value, "-") for key, value in values.items()}, 30.0, 20.0, 3.0, 25.0, {}, {})


def test_only_the_limits_that_bind_are_shown() -> None:
    given = finding("motor_saturation", speed_limit=1e3, acceleration_limit=1e6, torque_limit=40.0)
    assert list(shown_parameters(given)) == ["torque_limit"]
    idle = finding("motor_saturation", speed_limit=1e3, acceleration_limit=1e6)
    assert list(shown_parameters(idle)) == ["speed_limit", "acceleration_limit"]


def test_other_findings_keep_all_their_parameters() -> None:
    for name, values in (("soil_split", {"strength": 1.0, "stiffness": 2.0}), ("encoders_exchanged", {"flip": 1.0})):
        assert list(shown_parameters(finding(name, **values))) == list(values)
