"""The filter's knowledge: noise from instruments, prior of the soil, packing, refusals."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from ddagr_gym.config import dump_config, parse_config
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import FilterModel, FilterNoise, ForceLaw, SoilPrior, layout
from ddagr_gym.parameters import Imu, Sensors, WheelEncoder
from ddagr_gym.presets import get_robot


def test_noise_of_the_thesis_instruments():
    # US Digital E3, 20000 counts a turn at 125 Hz: one count is 0.0393 rad/s; rounding two of them, over sqrt(6)
    noise = FilterNoise.from_sensors(Sensors())
    assert noise.encoder == pytest.approx(2 * math.pi / 20000 * 125 / math.sqrt(6))
    assert noise.accelerometer == pytest.approx(0.031, rel=1e-3)
    ideal = Sensors(
        imu=replace(Imu(), gyro_resolution=0.0), encoder=WheelEncoder(counts_per_revolution=0, speed_noise=0.02)
    )
    assert FilterNoise.from_sensors(ideal).gyro == Imu().gyro_noise
    assert FilterNoise.from_sensors(ideal, soil=0.2).encoder == 0.02
    assert FilterNoise.from_sensors(ideal, soil=0.2).soil == 0.2


def test_quantisation_noise_is_what_a_turning_encoder_has(rng):
    angle = np.cumsum(0.008 * (0.7 + 0.1 * rng.standard_normal(200000)))
    counts = np.floor(angle * 20000 / (2 * math.pi))
    error = (np.diff(counts) * 2 * math.pi / 20000 - np.diff(angle)) / 0.008
    assert error.std() == pytest.approx(FilterNoise.from_sensors(Sensors()).encoder, rel=0.01)


def test_prior_scales_with_the_load_and_correlates_b_with_a1_a2():
    prior = SoilPrior()
    mean, covariance = prior.logs(400.0)
    heavier, same = prior.logs(800.0)
    np.testing.assert_allclose(heavier - mean, [math.log(2), 0.0, math.log(2), math.log(2)])
    np.testing.assert_array_equal(covariance, same)
    assert math.exp(mean[2] - mean[0] - mean[1]) == pytest.approx(prior.coupling)
    coupling = np.array([-1.0, -1.0, 1.0, 0.0])
    assert math.sqrt(coupling @ covariance @ coupling) == pytest.approx(prior.coupling_deviation)
    assert np.linalg.eigvalsh(covariance).min() > 0


def test_model_of_a_robot_with_its_sensors(robot):
    sensors = Sensors(imu=replace(Imu(), sample_rate=50.0, position=(0.1, -0.2)))
    model = FilterModel.of(robot, sensors, gate=4.0)
    assert model.sample_period == 0.02
    assert model.imu_position == (0.1, -0.2)
    assert model.noise == FilterNoise.from_sensors(sensors)
    assert model.gate == 4.0
    assert FilterModel.of(robot, sensors, noise=FilterNoise()).noise == FilterNoise()


def test_each_law_has_its_own_default_prior(robot):
    coupled, thesis = FilterModel(robot), FilterModel(robot, law=ForceLaw.thesis)
    assert coupled.soil_prior == SoilPrior()
    assert thesis.soil_prior.coupling < 0.5
    given = SoilPrior(traction_rate=9.0)
    assert FilterModel(robot, law=ForceLaw.thesis, prior=given).soil_prior is given


def test_initial_state_stands_at_rest(robot):
    state, covariance = FilterModel(robot, gyro_bias_deviation=2e-3).initial()
    np.testing.assert_array_equal(state[:5], 0.0)
    assert covariance[9, 9] == pytest.approx(4e-6)
    assert np.linalg.eigvalsh(covariance).min() > 0


@pytest.mark.parametrize("name", ["ddagr", "warthog", "husky"])
def test_packed_model_is_complete(name):
    model = FilterModel(get_robot(name))
    packed = model.pack()
    assert np.isfinite(packed).all()
    state, covariance = model.initial()
    low, high = packed[layout.LOW : layout.LOW + 12], packed[layout.HIGH : layout.HIGH + 12]
    assert ((low < state) & (state < high)).all()
    variances = np.diag(covariance)
    assert (variances <= packed[layout.CEILING : layout.CEILING + 12]).all()
    assert (variances >= packed[layout.FLOOR : layout.FLOOR + 12]).all()
    assert packed[layout.MASS] == model.robot.mass


def test_settings_survive_yaml():
    for settings in (FilterNoise(soil=0.2), SoilPrior(coupling=0.9)):
        assert parse_config(dump_config(settings), type(settings)) == settings


@pytest.mark.parametrize("kind", [FilterNoise, SoilPrior])
def test_every_number_is_checked(kind):
    for item in fields(kind):
        with pytest.raises(InputError, match=item.name):
            kind(**{item.name: -1.0})


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"accelerometer_interval": 0}, "give 1 or more"),
        ({"imu_position": (0.0, math.nan)}, "give .x, y. in m"),
        ({"gate": 0.5}, "gate is 0.5"),
        ({"sample_period": 0.0}, "sample_period is 0"),
    ],
)
def test_errors_name_the_remedy(robot, values, message):
    with pytest.raises(InputError, match=message):
        FilterModel(robot, **values)
