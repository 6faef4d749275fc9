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


def test_only_a_band_has_a_line() -> None:
    sizes = {"strength": 0.8, "radius": 0.9}
    assert list(shown_parameters(finding("soil_patch", **sizes, half_length=0.0, bearing=0.3))) == list(sizes)
    band = {**sizes, "half_length": 7.0, "bearing": 0.3}
    assert list(shown_parameters(finding("soil_patch", **band))) == list(band)


def test_a_late_turning_has_no_loops_and_loops_no_turning() -> None:
    loops = {"lag": 0.2, "second_pole": 0.3, "slowing": 1.0}
    assert list(shown_parameters(finding("motor_lag", **loops, turning=0.0))) == list(loops)
    assert list(shown_parameters(finding("motor_lag", **loops, turning=1.0))) == ["lag", "turning"]
    wall = {"scale": 2.0, "density": 1500.0}
    assert list(shown_parameters(finding("lateral_bulldozing", **wall, angle=0.05, way=0.0))) == list(wall)


def test_other_findings_keep_all_their_parameters() -> None:
    for name, values in (("soil_split", {"strength": 1.0, "stiffness": 2.0}), ("encoders_exchanged", {"flip": 1.0})):
        assert list(shown_parameters(finding(name, **values))) == list(values)
