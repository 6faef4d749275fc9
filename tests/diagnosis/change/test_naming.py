"""Which refits stand for a name, by what they explain and what they leave."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from ddagr_gym.diagnosis.change.naming import (
    LEAST_EVIDENCE,
    Named,
    _absent,
    _dead_time_first,
    _everywhere_first,
    _explaining,
    _first,
    _is_share,
    _soil_alone,
    _standing_out,
)  # fmt: skip


def tried(name: str, gain: float, left: float, probability: float, problem: str = "same"):
    """A model with a refit, as far as these rules look at it."""
    after = SimpleNamespace(left=left, named=(SimpleNamespace(probability=probability),), problem=problem)
    return after, SimpleNamespace(name=name, gain=gain)


MODEL = SimpleNamespace(problem="same", probability=lambda shift: min(1.0, 40.0 * shift.probability))


def names(found) -> list[str]:
    return [rival.name for _, rival in found]


def test_of_one_change_those_that_leave_nothing_stand_whatever_others_explain():
    alarming = [tried("motor_lag", 300.0, 2.0, 1e-6), tried("command_delay", 280.0, 0.9, 1e-6)]
    assert names(_explaining(alarming, MODEL)) == ["command_delay"]


def test_of_two_changes_those_that_explain_most_stand_beside_those_that_leave_least():
    alarming = [
        tried("motor_lag", 2800.0, 3.6, 1e-6),
        tried("command_delay", 2700.0, 3.6, 1e-9),
        tried("towed_drag", 1500.0, 3.1, 0.2),
        tried("wheel_radius_mismatch", 1000.0, 3.5, 1e-4),
        tried("payload", 20.0, 3.7, 1e-4),
    ]
    assert names(_explaining(alarming, MODEL)) == ["motor_lag", "command_delay", "towed_drag"]


def test_what_only_takes_a_parameter_back_does_not_stand_by_what_it_explains():
    alarming = [tried("towed_drag", 3000.0, 4.0, 0.2), tried("gyro_bias", 900.0, 1.5, 1e-6)]
    assert names(_explaining(alarming, MODEL)) == ["gyro_bias"]


@pytest.mark.parametrize(("probability", "alone"), [(0.01, ["soil_change"]), (1e-6, [])])
def test_another_soil_comes_first_where_no_effect_is_out_of_the_ordinary_by_itself(probability, alone):
    alarming = [tried("gyro_scale", 54.0, 0.9, probability), tried("soil_change", 40.0, 1.4, 0.1, "any soil")]
    assert names(_soil_alone(alarming, MODEL)) == alone


def test_a_name_that_comes_first_weighs_as_much_as_the_heaviest():
    found = _first("soil_change", {"gyro_scale": 0.9, "slope": 0.1})
    assert list(found) == ["soil_change", "gyro_scale", "slope"]
    assert found["soil_change"] == found["gyro_scale"]
    assert sum(found.values()) == pytest.approx(1.0)


@pytest.mark.parametrize(("further", "first"), [(0.9, "soil_change"), (1.1, "soil_patch")])
def test_a_patch_that_explains_hardly_more_than_a_changed_soil_comes_after_it(further, first):
    patch = tried("soil_patch", 100.0 + further * LEAST_EVIDENCE, 0.9, 1e-6)
    found = _everywhere_first([patch, tried("soil_change", 100.0, 0.9, 1e-6)], {"soil_patch": 0.7, "soil_change": 0.3})
    assert max(found, key=found.__getitem__) == first
    assert set(found) == {"soil_patch", "soil_change"}


def test_a_changed_soil_that_is_no_rival_of_a_patch_does_not_come_back():
    weights = {"soil_patch": 0.8, "slope": 0.2}
    assert _everywhere_first([tried("soil_patch", 9.0, 0.9, 1e-6)], weights) == weights


LAG = {"motor_lag": 0.93, "gyro_bias": 0.07}


@pytest.mark.parametrize(("left", "first"), [(0.6, "command_delay"), (0.7, "command_delay"), (0.8, "motor_lag")])
def test_a_dead_time_comes_before_a_lag_that_leaves_no_less_out_of_the_ordinary(left, first):
    found = _dead_time_first([tried("motor_lag", 62.0, 0.7, 1e-5), tried("command_delay", 35.0, left, 1e-6)], LAG)
    assert max(found, key=found.__getitem__) == first
    assert set(found) == ({"command_delay", *LAG} if first == "command_delay" else set(LAG))
    assert sum(found.values()) == pytest.approx(1.0)


def test_a_dead_time_comes_before_no_other_name():
    delay = tried("command_delay", 35.0, 0.1, 1e-6)
    weights = {"gyro_bias": 0.6, "motor_lag": 0.4}
    assert _dead_time_first([delay, tried("motor_lag", 62.0, 0.7, 1e-5)], weights) == weights
    assert _dead_time_first([tried("motor_lag", 62.0, 0.7, 1e-5)], LAG) == LAG


def by_itself(name: str, probability: float):
    shift = SimpleNamespace(probability=probability)
    return SimpleNamespace(named=(shift,)), SimpleNamespace(name=name)


def test_a_name_that_is_out_of_the_ordinary_by_itself_comes_before_one_that_takes_parameters_back():
    model = SimpleNamespace(probability=lambda shift: shift.probability)
    weights = {"soil_change": 0.6, "lateral_bulldozing": 0.3, "towed_drag": 0.1}
    alarming = [by_itself("soil_change", 0.3), by_itself("lateral_bulldozing", 1e-5), by_itself("towed_drag", 0.01)]
    assert _standing_out(alarming, model, weights) == ["lateral_bulldozing"]
    assert _standing_out(alarming[:1], model, weights) == []
    # a heavier name that no alarm needs, and one that is out of the ordinary itself, stay first
    assert _standing_out(alarming[1:], model, weights) == []
    assert _standing_out([by_itself("soil_change", 1e-5), *alarming[1:]], model, weights) == []


def standing_out(*candidates: tuple[str, bool], pulled=(), rougher=()):
    """A model beside which effects stand out, each with whether it has sizes."""
    found = [
        SimpleNamespace(compared=SimpleNamespace(name=n, candidate=SimpleNamespace(has_sizes=h))) for n, h in candidates
    ]
    return SimpleNamespace(conspicuous=tuple(found), pulled=pulled, rougher=rougher)


def test_a_limit_that_stands_out_and_that_no_refit_finds_is_no_alarm_and_a_size_is_one():
    limit, size = standing_out(("motor_saturation", False)), standing_out(("gyro_bias", True))
    assert Named((limit,), (), _absent(limit)).complete
    assert not Named((limit,), ()).complete
    assert not Named((size,), (), _absent(size)).complete
    pulled = standing_out(("motor_saturation", False), pulled=("soil_strength",))
    assert not Named((pulled,), (), _absent(pulled)).complete


def test_a_channel_that_is_rougher_than_usual_leaves_an_answer_open():
    assert Named((standing_out(),), ()).complete
    assert not Named((standing_out(rougher=("yaw_rate",)),), ()).complete


def test_of_more_than_were_refitted_none_is_known_to_be_absent():
    many = standing_out(*((f"limit_{k}", False) for k in range(5)))
    assert _absent(many) == frozenset()


def costing(cost: float, excess: float = 0.0):
    return SimpleNamespace(fitted=SimpleNamespace(cost=cost), excess=excess)


def test_a_name_explains_a_share_of_what_the_names_before_it_did_and_of_what_rough_channels_leave():
    first, second = costing(1000.0), costing(600.0)
    assert _is_share((costing(580.0), None), (first, second))
    assert not _is_share((costing(590.0), None), (first, second))
    assert not _is_share((costing(960.0), None), (costing(1000.0, 2000.0),))
    assert _is_share((costing(999.0), None), (first,))
