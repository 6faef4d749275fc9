"""Effects that are present in a part of the windows only."""

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.identification.spells import Spell
from ddagr_gym.identification.window_model import WindowModel
from ddagr_gym.identification.windows import cut_windows
from ddagr_gym.physics.effects import load_effects


@pytest.fixture(scope="module")
def windows(drive, robot):
    return cut_windows([drive], 2.0, wheel_radius=robot.outer_radius, half_track=robot.half_track)


@pytest.mark.parametrize("ends", [False, True])
@pytest.mark.parametrize("effect", ["towed_drag=60", "motor_lag=0.2", "gyro_bias=0.05", "gyro_sign=1"])
def test_windows_outside_are_as_without_the_effect(robot, soil, windows, effect, ends):
    effects = load_effects(effect)
    moment = float(windows.time[windows.count // 2])
    spell = Spell(0, moment, ends=ends)
    model = WindowModel(robot, soil, windows)
    timed = model.during({effects[0].name: spell})
    predicted = timed.predict(np.zeros(0), windows.initial, effects)
    whole, none = (model.predict(np.zeros(0), windows.initial, given) for given in (effects, ()))
    present = spell.in_windows(windows)
    assert present.any()
    assert not present.all()
    assert present[0] == ends
    np.testing.assert_array_equal(predicted[present], whole[present])
    np.testing.assert_allclose(predicted[~present], none[~present], atol=1e-12)
    assert np.abs(whole[~present] - none[~present]).max() > 1e-3


def test_other_effects_stay(robot, soil, windows):
    drag, bias = load_effects(["towed_drag=60", "gyro_bias=0.05"])
    model = WindowModel(robot, soil, windows)
    timed = model.during({"towed_drag": Spell(0, 1e6)})
    predicted = timed.predict(np.zeros(0), windows.initial, (drag, bias))
    np.testing.assert_allclose(predicted, model.predict(np.zeros(0), windows.initial, (bias,)), atol=1e-12)


def test_parts_follow_the_windows_of_a_subset(robot, soil, windows):
    effects = load_effects("towed_drag=60")
    timed = WindowModel(robot, soil, windows).during({"towed_drag": Spell(0, float(windows.time[2]))})
    some = windows.subset(np.array([1, 3]))
    part = timed.on(some).predict(np.zeros(0), some.initial, effects)
    np.testing.assert_array_equal(part, timed.predict(np.zeros(0), windows.initial, effects)[[1, 3]])


def test_later_recordings_come_after(windows):
    second = replace(windows, recording=np.ones_like(windows.recording))
    assert Spell(0, 1e3).in_windows(second).all()
    assert not Spell(0, 1e3, ends=True).in_windows(second).any()
    assert not Spell(2, 0.0).in_windows(second).any()
