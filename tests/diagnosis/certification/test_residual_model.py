"""A flexible model finds an error that depends on what the robot does, and integrates its path anew."""

import numpy as np

from ddagr_gym.diagnosis.certification.residual_model import Rollout, corrected, fit_residual_model
from ddagr_gym.identification.windows import CHANNELS, WindowSet

PERIOD = 0.05
SAMPLES = 100


def rollout(seed: int, gain: float, count: int = 24) -> Rollout:
    """Robots on circles that really turn ``gain`` times as fast as predicted."""
    rng = np.random.default_rng(seed)
    speed, turn, start = rng.uniform(0.2, 0.6, count), rng.uniform(-0.4, 0.4, count), rng.uniform(-3.0, 3.0, count)
    time = PERIOD * np.arange(1, SAMPLES + 1)
    tracks = []
    for factor in (1.0, gain):
        yaw = start[:, None] + factor * turn[:, None] * time
        x = np.cumsum(speed[:, None] * np.cos(yaw), axis=1) * PERIOD
        y = np.cumsum(speed[:, None] * np.sin(yaw), axis=1) * PERIOD
        readings = np.zeros((count, SAMPLES, 8))
        readings[..., CHANNELS.index("yaw_rate")] = factor * turn[:, None]
        readings[..., 5:] = np.stack([x, y, yaw], axis=-1)
        tracks.append(readings)
    still = np.zeros((count, SAMPLES))
    rates = [np.tile(v[:, None], SAMPLES) for v in (speed, turn)]
    states = np.stack([*np.moveaxis(tracks[0][..., 5:], -1, 0), rates[0], still, rates[1], still, still], axis=-1)
    banks = np.stack([speed + turn, speed - turn], axis=-1)
    commands = np.tile(banks[:, None], (1, SAMPLES, 1))
    begin = 5.0 * np.arange(count)
    none = np.zeros(count, dtype=np.int64)
    windows = WindowSet(PERIOD, none, none, begin, commands, 0, tracks[1], np.zeros((count, 8)))
    return Rollout(windows, tracks[0], states)


def size(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values[:, -1] ** 2)))


def test_an_error_that_can_be_learnt_is_taken_away() -> None:
    model = fit_residual_model(rollout(1, 1.3), 2.0, seed=0)
    assert model is not None
    unseen = rollout(2, 1.3)
    better = corrected(model, unseen)
    for channel in ("yaw_rate", "pose_x", "pose_y", "pose_yaw"):
        k = CHANNELS.index(channel)
        left = [size(unseen.windows.measured[..., k] - made[..., k]) for made in (unseen.readings, better)]
        assert left[1] < 0.25 * left[0], channel


def test_noise_is_not_learnt() -> None:
    """Errors without any reason: the model does not trust itself and leaves the prediction nearly as it was."""
    seen = rollout(1, 1.0)
    seen.windows.measured[...] += 0.1 * np.random.default_rng(3).standard_normal((24, 1, 8))
    model = fit_residual_model(seen, 2.0, seed=0)
    assert model is not None
    unseen = rollout(2, 1.0)
    change = corrected(model, unseen) - unseen.readings
    assert size(change[..., CHANNELS.index("yaw_rate")]) < 0.05


def test_too_little_is_refused() -> None:
    assert fit_residual_model(rollout(1, 1.3, count=3), 2.0, seed=0) is None
