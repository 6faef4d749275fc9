"""What is left of channels, against ordinary drives: Student's t of the logarithm, to one side."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from ddagr_gym.diagnosis.answer.change import ChannelShift
from ddagr_gym.diagnosis.change import model
from ddagr_gym.diagnosis.change.channel_rises import channel_rises
from ddagr_gym.diagnosis.change.expected_scatter import RISE, ExpectedScatter
from ddagr_gym.diagnosis.change.measured_scatter import measured_scatter
from ddagr_gym.diagnosis.change.model import Model
from ddagr_gym.diagnosis.change.shifts import single_level
from ddagr_gym.diagnosis.result.sentences import rougher_in_words
from ddagr_gym.identification.windows import CHANNELS

EXPECTED = ExpectedScatter(degrees=8.0, rises={"yaw_rate": 0.2})
BEFORE = [{"yaw_rate": 1.0}, {"yaw_rate": float(np.e**0.3)}, {"yaw_rate": float(np.e**-0.3)}]


def test_the_distance_is_that_of_equation_1():
    (found,) = channel_rises({"yaw_rate": 2.0}, BEFORE, EXPECTED)
    deviation = np.sqrt((8.0 * 0.2**2 + 2.0 * 0.3**2) / 10.0 * (1.0 + 1.0 / 3.0))
    assert found.usual == pytest.approx(1.0)
    assert found.degrees == 10.0
    assert found.distance == pytest.approx(np.log(2.0) / deviation)
    assert found.probability == pytest.approx(stats.t.sf(found.distance, 10.0))


def test_less_than_usual_is_no_change():
    (found,) = channel_rises({"yaw_rate": 0.1}, BEFORE, EXPECTED)
    assert found.distance < 0.0
    assert found.probability > 0.99


def test_the_limit_has_the_probability_of_one_of_several_tests():
    (found,) = channel_rises({"yaw_rate": 1.0}, BEFORE, EXPECTED)
    (at_limit,) = channel_rises({"yaw_rate": found.most(50)}, BEFORE, EXPECTED)
    assert at_limit.probability == pytest.approx(single_level(50), rel=1e-6)


def test_false_alarms_keep_their_level():
    rng = np.random.default_rng(3)
    expected = ExpectedScatter(degrees=1e6, rises={"yaw_rate": 0.2})
    probabilities = []
    for _ in range(2000):
        values = np.exp(0.2 * rng.normal(size=4))
        (found,) = channel_rises({"yaw_rate": values[0]}, [{"yaw_rate": v} for v in values[1:]], expected)
        probabilities.append(found.probability)
    assert np.mean(np.array(probabilities) < 0.05) == pytest.approx(0.05, abs=0.015)


def test_ordinary_drives_whose_windows_differ_say_less_of_their_mean():
    errors = [{"yaw_rate": 0.5}, {"yaw_rate": 0.4}, {"pose_x": 9.0}]
    (plain,) = channel_rises({"yaw_rate": 2.0}, BEFORE, EXPECTED)
    (wide,) = channel_rises({"yaw_rate": 2.0}, BEFORE, EXPECTED, errors)
    assert wide.deviation == pytest.approx(np.sqrt((0.5**2 + 0.4**2) / 2.0 * (1.0 + 1.0 / 3.0)))
    (same,) = channel_rises({"yaw_rate": 2.0}, BEFORE, EXPECTED, [{"yaw_rate": 0.01}])
    assert same == plain


def test_a_channel_that_ordinary_drives_lack_says_nothing():
    assert channel_rises({"yaw_rate": 2.0, "pose_x": 1.0}, [{"encoder_left": 1.0}], EXPECTED) == ()
    assert channel_rises({"yaw_rate": 2.0}, [], EXPECTED) == ()


def test_a_channel_of_which_nothing_was_measured_scatters_by_the_usual():
    assert ExpectedScatter().rise("pose_x") == RISE
    assert EXPECTED.rise("yaw_rate") == 0.2


class _Changed:
    def __init__(self, *channels: ChannelShift) -> None:
        self.channels = channels


def test_a_sentence_lists_the_roughest_channels_first():
    gyro = ChannelShift("yaw_rate", 1.0, 9.0, 4.0, 2.0)
    encoder = ChannelShift("encoder_left", 1.0, 9.0, 9.0, 2.0)
    quiet = ChannelShift("pose_x", 1.0, 9.0, 1.5, 2.0)
    words = rougher_in_words(_Changed(gyro, encoder, quiet))
    assert words == ": the model's error is larger than before in left encoder (3.0 times) and yaw rate (2.0 times)"
    assert rougher_in_words(_Changed(quiet)) == ""


def test_excess_is_what_rough_channels_cost_beyond_what_they_usually_do(monkeypatch):
    monkeypatch.setattr(model, "projected_residual", lambda problem, fitted: None)
    problem = SimpleNamespace(losses_by_channel=lambda residual: {"yaw_rate": 300.0, "encoder_left": 100.0})
    before = [{"yaw_rate": 1.0, "encoder_left": 1.0}] * 3
    quiet = channel_rises({"yaw_rate": 1.1, "encoder_left": 1.0}, before, EXPECTED)
    rough = channel_rises({"yaw_rate": 4.0, "encoder_left": 1.0}, before, EXPECTED)
    assert Model(problem, None, None, (), (), (), quiet).excess == 0.0
    assert Model(problem, None, None, (), (), (), rough).excess == pytest.approx(300.0 * (1.0 - 1.0 / 4.0))


def test_the_package_ships_what_was_measured_of_one_ground():
    measured = measured_scatter()
    assert set(measured.same_ground.rises) == set(CHANNELS)
    assert measured.same_ground.move("shear_modulus") > 1.0
    assert measured.other_ground.rises == {}
    assert measured.other_ground.move("shear_modulus") == 1.0
