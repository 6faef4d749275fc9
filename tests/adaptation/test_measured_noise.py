"""Sensors with the noise that recordings show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ddagr_gym
from ddagr_gym.adaptation.measured_noise import measured_sensors
from ddagr_gym.api.inputs import recordings_from
from ddagr_gym.identification.noise import INSTRUMENT_NOISE
from ddagr_gym.identification.signals import travel_speed
from ddagr_gym.parameters import Imu
from ddagr_gym.presets import ddagr


@pytest.fixture(scope="module")
def recording():
    return recordings_from([ddagr_gym.simulate("arcs", seed=3)], None, None)[0]


def shaken(recording, deviation, correlation):
    """The recording with more noise in its accelerometer, of successive samples that hang together."""
    rng = np.random.default_rng(0)
    columns = {name: recording[name].copy() for name in ("specific_force_x", "specific_force_y")}
    for values in columns.values():
        noise = rng.standard_normal(len(values)) * deviation * np.sqrt(1.0 - correlation**2)
        for k in range(1, len(noise)):
            noise[k] += correlation * noise[k - 1]
        values += noise
    return replace(recording, channels={**recording.channels, **columns})


def standing_first(recording, time):
    """The recording after so much standing [s], with the data sheet's noise."""
    count = round(time / recording.period)
    rng = np.random.default_rng(2)
    noise = {"specific_force_x": 0.031, "specific_force_y": 0.031, "yaw_rate": 1e-3}
    channels = {
        name: np.concatenate([noise.get(name, 0.0) * rng.standard_normal(count), values])
        for name, values in recording.channels.items()
    }
    t = np.concatenate([recording.t[0] - recording.period * np.arange(count, 0, -1), recording.t])
    valid = np.concatenate([np.repeat(recording.command_valid[:1], count), recording.command_valid])
    return replace(recording, t=t, channels=channels, extras={}, command_valid=valid)


def test_a_data_sheets_noise_is_kept(recording):
    found = measured_sensors([recording], ddagr()).imu
    assert found.accelerometer_noise == pytest.approx(Imu().accelerometer_noise, rel=0.25)
    # no recording is taken to be better than a good instrument
    assert found.gyro_noise == pytest.approx(INSTRUMENT_NOISE["yaw_rate"], rel=0.2)


@pytest.mark.parametrize("correlation", [0.0, 0.5])
def test_noise_that_hangs_together_is_worse(recording, correlation):
    found = measured_sensors([shaken(recording, 0.2, correlation)], ddagr()).imu
    expected = 0.2 * np.sqrt((1.0 + correlation) / (1.0 - correlation))
    speed = travel_speed(recording, ddagr().outer_radius)
    driving = found.accelerometer_noise + found.accelerometer_vibration * speed[speed > 0.02].mean()
    assert driving == pytest.approx(expected, rel=0.25)


def test_noise_of_the_way_is_vibration(recording):
    """With the noise of the data sheet at rest, whose standing the recording has."""
    still = standing_first(recording, 2.0)
    speed = travel_speed(still, ddagr().outer_radius)
    rng = np.random.default_rng(1)
    names = ("specific_force_x", "specific_force_y")
    columns = {name: still[name] + 0.6 * speed * rng.standard_normal(len(speed)) for name in names}
    found = measured_sensors([replace(still, channels={**still.channels, **columns})], ddagr()).imu
    assert found.accelerometer_noise == pytest.approx(Imu().accelerometer_noise, rel=0.2)
    assert found.accelerometer_vibration == pytest.approx(0.6, rel=0.25)


@pytest.mark.parametrize("every", [1, 2, 4])
def test_noise_of_an_imu_that_is_slower_than_the_rows(recording, every):
    """Of white noise, fewer readings a second mean more noise of a sample at the nominal rate."""
    noisy = shaken(recording, 0.2, 0.0)
    rows = np.arange(len(noisy)) % every == 0
    channels = {name: np.where(rows, noisy[name], np.nan) for name in ("specific_force_x", "specific_force_y")}
    found = measured_sensors([replace(noisy, channels={**noisy.channels, **channels})], ddagr()).imu
    speed = travel_speed(recording, ddagr().outer_radius)
    driving = found.accelerometer_noise + found.accelerometer_vibration * speed[speed > 0.02].mean()
    assert driving == pytest.approx(0.2 * np.sqrt(every), rel=0.25)
