"""Blocks and places of recordings whose samples are partly missing, against those of whole ones."""

import numpy as np
import pytest

from ddagr_gym.identification.block_means import TRACKING_ERROR, block_windows, located
from ddagr_gym.identification.noise import ChannelNoise, noise_from_differences
from ddagr_gym.identification.signals import travel_speed
from ddagr_gym.identification.windows import CHANNELS, WindowSet, cut_windows
from ddagr_gym.recordings.schema import Recording

PERIOD, COUNT, RADIUS = 0.02, 1500, 0.2
ROWS = np.arange(COUNT)


def columns(encoders: np.ndarray = ROWS >= 0, gyro: np.ndarray = ROWS >= 0) -> dict[str, np.ndarray]:
    """An arc on which the banks turn 0.4 rad/s slower than commanded, read where the flags say so."""
    t = PERIOD * ROWS
    read = {"t": t, "command_right": 2.0 + np.sin(t), "command_left": 1.5 + np.sin(t)}
    for side in ("right", "left"):
        read[f"encoder_{side}"] = np.where(encoders, read[f"command_{side}"] - 0.4, np.nan)
    for name in ("specific_force_x", "specific_force_y"):
        read[name] = np.zeros(COUNT)
    read["yaw_rate"] = np.where(gyro, 0.1 + 0.2 * np.sin(t), np.nan)
    return read


def cut(*recordings: Recording) -> WindowSet:
    return cut_windows(recordings, 2.0, wheel_radius=RADIUS, half_track=0.3)


def started(recording: Recording) -> np.ndarray:
    """(W, 3) places and headings at which the windows of one recording start."""
    return located(cut(recording), [recording], RADIUS).initial[:, :3]


def test_places_of_a_whole_recording_are_sums_over_its_rows() -> None:
    read = columns()
    recording = Recording.from_columns(read)
    step = recording.period
    yaw = np.cumsum(read["yaw_rate"]) * step
    travel = RADIUS * 0.5 * (read["encoder_right"] + read["encoder_left"]) * step
    path = np.stack([np.cumsum(travel * np.cos(yaw)), np.cumsum(travel * np.sin(yaw)), yaw], axis=1)
    np.testing.assert_array_equal(started(recording), path[cut(recording).start])


def test_places_of_a_recording_with_missing_samples() -> None:
    whole = started(Recording.from_columns(columns()))
    thinned = started(Recording.from_columns(columns(encoders=ROWS % 5 == 0, gyro=ROWS % 2 == 0)))
    np.testing.assert_allclose(thinned, whole, atol=0.01)


def test_travel_speed_and_noise_of_missing_samples() -> None:
    """Four of five encoder rows missing: neither the speed nor what blocks may deviate by is nearer to zero."""
    whole, thinned = columns(), columns(encoders=ROWS % 5 == 0)
    fast, slow = (Recording.from_columns(read) for read in (whole, thinned))
    np.testing.assert_allclose(travel_speed(slow, RADIUS)[:-5], travel_speed(fast, RADIUS)[:-5], atol=0.01)
    noise = [None] * len(CHANNELS)
    noise[CHANNELS.index("yaw_rate")] = ChannelNoise(1e-6, 0.0, 0.0, 0.0)
    for recording in (fast, slow):
        sigma = block_windows(cut(recording), noise, RADIUS).sigma[..., CHANNELS.index("yaw_rate")]
        np.testing.assert_allclose(sigma, 0.4 * TRACKING_ERROR["yaw_rate"], rtol=0.12)


def test_tracking_error_of_banks_that_are_read_in_turn() -> None:
    """Blocks of two rows, each bank in every tenth row: most blocks have no sample of either."""
    read = columns()
    read["encoder_right"] = np.where(ROWS % 10 == 0, read["encoder_right"], np.nan)
    read["encoder_left"] = np.where(ROWS % 10 == 5, read["encoder_left"], np.nan)
    recording = Recording.from_columns(read)
    noise = [None] * len(CHANNELS)
    noise[CHANNELS.index("yaw_rate")] = ChannelNoise(1e-6, 0.0, 0.0, 0.0)
    windows = cut_windows([recording], 2.0, wheel_radius=RADIUS, half_track=0.3)
    sigma = block_windows(windows, noise, RADIUS, block=0.04).sigma[..., CHANNELS.index("yaw_rate")]
    # at a window's ends the nearest sample stands for those beyond it
    np.testing.assert_allclose(sigma, 0.4 * TRACKING_ERROR["yaw_rate"], rtol=0.5)
    assert np.median(sigma) == pytest.approx(0.4 * TRACKING_ERROR["yaw_rate"], rel=0.05)


def test_time_of_a_gap_counts() -> None:
    """Half a second is missing in the middle; what was driven meanwhile is not."""
    rows = np.delete(ROWS, np.arange(700, 725))
    gappy = Recording.from_columns({name: values[rows] for name, values in columns().items()})
    whole = Recording.from_columns(columns())
    after = cut(gappy).time > 15.0
    yaw = np.cumsum(whole["yaw_rate"]) * PERIOD
    expected = np.interp(cut(gappy).time[after], whole.t, yaw)
    np.testing.assert_allclose(started(gappy)[after, 2], expected, atol=0.03)


def test_time_between_spans_is_unknown() -> None:
    read = columns()
    read["t"] = read["t"] + 1000.0 * (ROWS >= 700)
    apart = Recording.from_columns(read, spans=[(0, 700), (700, COUNT)])
    assert np.abs(started(apart)[:, 2]).max() < 6.0


def test_a_heading_logged_as_zeros_is_left_out() -> None:
    rng = np.random.default_rng(1)
    read = columns()
    for name in ("specific_force_x", "specific_force_y", "yaw_rate"):
        read[name] = read[name] + 0.01 * rng.standard_normal(COUNT)
    for name in ("pose_x", "pose_y", "pose_yaw"):
        read[name] = np.where(ROWS % 10 == 0, rng.standard_normal(COUNT) * (name != "pose_yaw"), np.nan)
    recording = Recording.from_columns(read)
    windows = cut(recording)
    blocked = block_windows(windows, noise_from_differences([recording], RADIUS), RADIUS)
    present = np.isfinite(blocked.sigma).any(axis=(0, 1))
    assert [CHANNELS[k] for k in np.flatnonzero(~present)] == ["pose_yaw"]
    assert np.isfinite(blocked.residual(np.zeros(windows.measured.shape))).all()


def test_without_a_pose_a_place_is_where_the_wheels_rolled_to_also_over_rows_in_bursts():
    t = (0.04 * np.arange(500)[:, None] + 2e-4 * np.arange(5)).ravel()
    columns = {"t": t, "yaw_rate": np.zeros(t.size)}
    columns |= dict.fromkeys(("command_right", "command_left", "encoder_right", "encoder_left"), np.full(t.size, 2.0))
    recording = Recording.from_columns(columns)
    windows = cut_windows([recording], 2.0, wheel_radius=0.3, half_track=0.5)
    placed = located(windows, [recording], 0.3).initial[:, 0]
    np.testing.assert_allclose(placed, 0.3 * 2.0 * recording.t[windows.start], atol=0.05)
