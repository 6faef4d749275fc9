"""Null worlds: of another structure, repeatable, near the nominal one; their readings are what the choices say."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.diagnosis.null_bank.drives import Template, null_recordings, template_of
from ddagr_gym.diagnosis.null_bank.readings import PARTS, Reading
from ddagr_gym.diagnosis.null_bank.structural_variants import KINDS, draw_world
from ddagr_gym.identification.noise import ChannelNoise
from ddagr_gym.identification.window_model import ideal_sensors
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate

ROBOT, SOIL = get_robot("ddagr"), get_soil("thesis_a1")
PERIOD = 0.02
COMMANDS = np.repeat(np.array([[0.0, 0.0], [1.0, 1.0], [1.0, 0.4], [0.5, 1.0]]), 50, axis=0)


def template() -> Template:
    present = np.ones((len(COMMANDS), len(CHANNELS)), dtype=bool)
    return Template((COMMANDS,), PERIOD, (present,), (None,) * len(CHANNELS), ((0.0, 0.0, 0.0),))


def drive(kind: str, seed: int = 3) -> Recording:
    return null_recordings(ROBOT, SOIL, template(), kind, np.random.default_rng(seed))[0]


@pytest.mark.parametrize("kind", KINDS)
def test_a_null_drive_is_near_the_nominal_one_and_not_it(kind):
    nominal = simulate(ROBOT, SOIL, COMMANDS, sensors=ideal_sensors(PERIOD))
    made = drive(kind)
    shares = []
    for name in ("encoder_right", "yaw_rate", "pose_x"):
        difference = made[name] - nominal[name]
        assert np.isfinite(difference).all()
        shares.append(np.sqrt(np.mean(difference**2)) / np.std(nominal[name]))
    assert 1e-4 < max(shares) < 0.4


def placed(x: float, y: float) -> Recording:
    columns = {"t": PERIOD * np.arange(len(COMMANDS)), "command_right": COMMANDS[:, 0], "command_left": COMMANDS[:, 1]}
    poses = {"pose_x": x, "pose_y": y, "pose_yaw": 0.5}
    return Recording.from_columns(
        columns | {name: np.full(len(COMMANDS), value) for name, value in poses.items()}, ROBOT
    )


def test_drives_far_from_the_origin_of_their_map_start_about_that_of_the_world():
    """A soil grid about the origin of UTM coordinates would take 1e15 bytes."""
    recordings = [placed(512_340.0, 5_403_210.0), placed(512_344.0, 5_403_204.0), placed(np.nan, np.nan)]
    found = template_of(recordings, (None,) * len(CHANNELS))
    np.testing.assert_allclose(found.starts, [(-2.0, 3.0, 0.5), (2.0, -3.0, 0.5), (0.0, 0.0, 0.5)], atol=1e-6)
    made = null_recordings(ROBOT, SOIL, found, "plain", np.random.default_rng(0))
    assert made[1]["pose_x"][0] == pytest.approx(2.0, abs=0.1)


def test_drives_without_poses_start_at_the_origin():
    found = template_of([placed(np.nan, np.nan)], (None,) * len(CHANNELS))
    assert found.starts == ((0.0, 0.0, 0.5),)


def test_the_same_seed_gives_the_same_drive_and_another_another():
    first, again, other = drive("all"), drive("all"), drive("all", seed=4)
    for name in CHANNELS:
        np.testing.assert_array_equal(first[name], again[name])
    assert not np.array_equal(first["yaw_rate"], other["yaw_rate"])


@pytest.mark.parametrize("kind", KINDS)
def test_what_differs_is_what_the_kind_says(kind):
    world = draw_world(kind, SOIL, 3.0, np.random.default_rng(0))
    assert (world.reading == Reading()) == (kind not in ("readings", "noise", "all"))
    assert (len(world.changes) > 0) == (kind not in ("patchy", "readings", "noise"))


def test_plain_reading_is_that_of_whole_samples():
    whole = simulate(ROBOT, SOIL, COMMANDS, sensors=ideal_sensors(PERIOD))
    reading = Reading()
    parts = simulate(ROBOT, SOIL, reading.commands(COMMANDS), sensors=ideal_sensors(PERIOD / PARTS))
    for name in ("encoder_right", "encoder_left", "yaw_rate", "pose_x"):
        difference = reading.read(name, parts[name]) - whole[name]
        assert np.sqrt(np.mean(difference**2)) < 3e-3 * np.std(whole[name])


def test_commands_of_parts_of_samples():
    given = np.array([[0.0, 0.0], [1.0, 2.0], [1.0, 2.0]])
    held = Reading(command_late=1).commands(given)[:, 0]
    np.testing.assert_array_equal(held, [0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1])
    ramp = Reading(ramped=True).commands(given)[:, 1]
    np.testing.assert_allclose(ramp, [0, 0, 0, 0, 0.5, 1.0, 1.5, 2, 2, 2, 2, 2])


def test_moments_of_readings():
    parts = np.arange(12.0)
    np.testing.assert_array_equal(Reading().read("yaw_rate", parts), [3, 7, 11])
    np.testing.assert_array_equal(Reading(inertial_late=2).read("yaw_rate", parts), [1, 5, 9])
    np.testing.assert_array_equal(Reading(inertial_mean=True).read("specific_force_x", parts), [1.5, 5.5, 9.5])
    np.testing.assert_array_equal(Reading().read("encoder_left", parts), [1.5, 5.5, 9.5])
    np.testing.assert_array_equal(Reading(encoder_instant=True).read("encoder_left", parts), [3, 7, 11])
    np.testing.assert_array_equal(Reading(inertial_late=2).read("pose_x", parts), [3, 7, 11])


def test_noise_has_the_stated_size_whatever_its_shape():
    noise, count = ChannelNoise(0.02, 0.1, 0.3, 0.0), 200_000
    rng = np.random.default_rng(1)
    kurtosis = {}
    for name, reading in (("normal", Reading()), ("tailed", Reading(tails=5.0)), ("slow", Reading(slow=0.3))):
        read = reading.noisy("yaw_rate", np.zeros(count), noise, np.full(count, 0.2), rng)
        assert np.std(read) == pytest.approx(np.hypot(0.02, 0.02), rel=0.03)
        kurtosis[name] = np.mean(read**4) / np.mean(read**2) ** 2
        blocks = np.std(read.reshape(-1, 100).mean(axis=1))
        assert (blocks > 2.0 * np.std(read) / 10.0) == (name == "slow")
    assert kurtosis["normal"] == pytest.approx(3.0, abs=0.1)
    assert kurtosis["tailed"] > 4.0


def test_a_counter_is_rounded_in_its_angle():
    quantum = 0.0157
    read = Reading().noisy("encoder_right", np.full(1000, 0.4), ChannelNoise(0.0, 0.0, -0.5, quantum), np.zeros(1000),
                           np.random.default_rng(2))  # fmt: skip
    assert abs(read[1:].mean() - 0.4) < 1e-4
    assert set(np.round(read[1:] / quantum)) == {25.0, 26.0}


def test_a_rounded_speed_is_rounded_one_by_one():
    quantum, rng = 0.0157, np.random.default_rng(3)
    read = Reading(rounded=True).noisy(
        "encoder_left", np.full(4000, 0.4), ChannelNoise(0.0, 0.0, -0.5, quantum), np.zeros(4000), rng
    )
    counts = read / quantum
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    assert abs(np.corrcoef(read[1:], read[:-1])[0, 1]) < 0.05
    assert abs(read.mean() - 0.4) < 0.05 * quantum
