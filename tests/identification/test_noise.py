"""Noise estimates against noise of known level, colour and rounding."""

import numpy as np
import pytest

from ddagr_gym.identification.noise import ChannelNoise
from ddagr_gym.identification.noise import channel_noise_from_differences as channel_noise
from ddagr_gym.identification.signals import interpolated
from ddagr_gym.recordings.schema import Recording


def coloured(rng: np.random.Generator, count: int, sigma: float, correlation: float) -> np.ndarray:
    from scipy.signal import lfilter

    white = rng.standard_normal(count + 200)
    return sigma * np.sqrt(1 - correlation**2) * lfilter([1.0], [1.0, -correlation], white)[200:]


@pytest.mark.parametrize("correlation", [0.0, 0.3, 0.7])
def test_level_and_correlation_of_coloured_noise_beside_a_drive(correlation: float) -> None:
    rng = np.random.default_rng(1)
    t = np.arange(9000) / 50.0
    motion = 0.3 * np.sin(0.7 * t)
    found = channel_noise([motion + coloured(rng, len(t), 0.05, correlation)], [np.zeros(len(t))], sparse=False)
    assert found is not None
    assert found.sigma == pytest.approx(0.05, rel=0.12)
    assert found.correlation == pytest.approx(correlation, abs=0.08)


def test_growth_with_speed() -> None:
    rng = np.random.default_rng(2)
    speed = np.repeat([0.0, 0.1, 0.2, 0.3], 2500)
    values = rng.standard_normal(10000) * np.hypot(0.03, 0.4 * speed)
    found = channel_noise([values], [speed], sparse=False)
    assert found is not None
    assert found.sigma == pytest.approx(0.03, rel=0.1)
    assert found.per_speed == pytest.approx(0.4, rel=0.1)


def test_standard_deviation_of_means_is_the_measured_one() -> None:
    rng = np.random.default_rng(3)
    values = coloured(rng, 50000, 0.05, 0.6) + 0.02 * rng.standard_normal(50000)
    found = channel_noise([values], [np.zeros(50000)], sparse=False)
    assert found is not None
    measured = values.reshape(-1, 5).mean(axis=1).std()
    assert float(found.of_mean(5)) == pytest.approx(measured, rel=0.12)


@pytest.mark.parametrize("quantum", [0.0, 2.4e-3])
def test_rounding_does_not_change_the_means_of_coloured_noise(quantum: float) -> None:
    values = coloured(np.random.default_rng(1), 60000, 0.03, 0.7)
    read = np.round(values / quantum) * quantum if quantum > 0.0 else values
    found = channel_noise([read], [np.zeros(60000)], sparse=False)
    assert found is not None
    assert (found.quantum > 0.0, found.counter) == (quantum > 0.0, False)
    for samples in (5, 10):
        measured = values.reshape(-1, samples).mean(axis=1).std()
        assert float(found.of_mean(samples)) == pytest.approx(measured, rel=0.05)


def test_counter_is_recognised_by_its_quantum() -> None:
    rng = np.random.default_rng(4)
    quantum = 0.0157
    angle = np.cumsum(rng.uniform(0.5, 0.9, 3000))
    speed = np.diff(np.floor(angle / quantum)) * quantum
    found = channel_noise([speed], [np.ones(2999)], sparse=False)
    assert found is not None
    assert found.quantum == pytest.approx(quantum, rel=1e-6)
    assert float(found.of_mean(5)) < 0.5 * found.sigma


@pytest.mark.parametrize("kind", ["counter", "jittering counter", "rounded speed"])
def test_means_of_rounded_speeds_are_as_good_as_they_are(kind: str) -> None:
    """At steady speeds, where what is not the speed is noise."""
    rng = np.random.default_rng(7)
    quantum, steps, each = 0.0157, 60, 150
    speed = np.repeat(rng.uniform(0.3, 1.2, steps), each)
    angle = np.cumsum(speed)
    if kind == "rounded speed":
        read = np.round((speed + 0.5 * quantum * rng.standard_normal(len(speed))) / quantum) * quantum
    else:
        jitter = 0.4 * quantum * rng.standard_normal(len(speed)) if kind == "jittering counter" else 0.0
        read = np.diff(np.floor((angle + jitter) / quantum), prepend=0.0) * quantum
    found = channel_noise(list(read.reshape(steps, each)), list(np.zeros((steps, each))), sparse=False)
    assert found is not None
    assert found.quantum == pytest.approx(quantum, rel=1e-6)
    error = (read - speed)[each:]
    for samples in (5, 10):
        measured = np.std(error.reshape(-1, samples).mean(axis=1))
        assert float(found.of_mean(samples)) == pytest.approx(measured, rel=0.35)
    assert found.counter
    assert (found.correlation == -0.5) == (kind != "rounded speed")


def test_sparse_poses() -> None:
    rng = np.random.default_rng(5)
    values = np.full(6000, np.nan)
    values[::10] = 0.02 * np.arange(600) + 0.012 * rng.standard_normal(600)
    found = channel_noise([values], [np.ones(6000)], sparse=True)
    assert found is not None
    assert found.sigma == pytest.approx(0.012, rel=0.12)


def test_too_few_samples_give_nothing() -> None:
    assert channel_noise([np.full(500, np.nan)], [np.zeros(500)], sparse=False) is None


@pytest.mark.parametrize("sparse", [True, False])
def test_a_constant_channel_has_no_noise(sparse: bool) -> None:
    """A heading that is logged as zeros, and a reading that jumps now and then from one exact value to another."""
    assert channel_noise([np.zeros(500)], [np.ones(500)], sparse=sparse) is None
    jumps = 7 * np.arange(100) % 40
    assert channel_noise([np.repeat(jumps, 20).astype(float)], [np.ones(2000)], sparse=sparse) is None


def test_noise_that_only_motion_brings_is_positive_at_rest() -> None:
    rng = np.random.default_rng(9)
    speed = np.repeat([0.0, 0.1, 0.2, 0.3], 2500)
    found = channel_noise([0.4 * speed * rng.standard_normal(10000)], [speed], sparse=False)
    assert found is not None
    assert 0.0 < float(found.of_mean(5)) < 0.2 * float(found.of_mean(5, 0.1))
    assert found.per_speed == pytest.approx(0.4, rel=0.1)


def test_mean_of_white_noise() -> None:
    assert float(ChannelNoise(0.1, 0.0, 0.0, 0.0).of_mean(4)) == pytest.approx(0.05)
    assert float(ChannelNoise(0.0, 1.0, 0.0, 0.0).of_mean(1, 0.3)) == pytest.approx(0.3)


def test_fine_rounding_is_not_taken_for_a_counter() -> None:
    rng = np.random.default_rng(6)
    values = np.round(0.03 * rng.standard_normal(6000) / 6e-4) * 6e-4
    found = channel_noise([values], [np.zeros(6000)], sparse=False)
    assert found is not None
    assert found.sigma == pytest.approx(0.03, rel=0.1)
    assert found.quantum == pytest.approx(6e-4, rel=1e-6)


def encoders(values: np.ndarray, t: np.ndarray, **more: object) -> Recording:
    columns = {"t": t, "encoder_right": values, "encoder_left": -values}
    return Recording.from_columns(columns, **more)  # type: ignore[arg-type]


def test_nothing_is_interpolated_across_spans() -> None:
    values = np.array([1.0, np.nan, 3.0, np.nan, np.nan, 7.0, np.nan, np.nan])
    recording = encoders(values, np.arange(8.0), spans=[(0, 4), (4, 6), (6, 8)])
    np.testing.assert_array_equal(interpolated(recording, "encoder_right"), [1.0, 2.0, 3.0, 3.0, 7.0, 7.0, 0.0, 0.0])
