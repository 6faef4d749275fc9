"""Readings and commands whose factor or offset is known to be wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ddagr_gym.diagnosis.preprocessing.known_errors import without_known_errors
from ddagr_gym.physics.effects.command_gain import CommandGain
from ddagr_gym.physics.effects.encoder_scale import EncoderScale
from ddagr_gym.physics.effects.gyro_bias import GyroBias
from ddagr_gym.physics.effects.gyro_scale import GyroScale
from ddagr_gym.physics.effects.imu_tilt import ImuTilt
from ddagr_gym.recordings.schema import RobotGeometry
from tests.recordings.conftest import Faults, drive

MADE = drive(RobotGeometry("warthog", 0.3, 0.54), Faults(), seconds=20.0)


def test_what_is_known_to_be_wrong_with_the_readings_is_undone():
    wrong = {
        # the bias comes behind the scale, as the effects do
        "yaw_rate": 1.1 * MADE["yaw_rate"] + 0.05,
        "encoder_right": 0.9 * MADE["encoder_right"],
        "encoder_left": 1.2 * MADE["encoder_left"],
        # the banks do 0.8 and 1.25 times what the log says that they were told
        "command_right": MADE["command_right"] / 0.8,
        "command_left": MADE["command_left"] / 1.25,
    }
    effects = [GyroScale(1.1), GyroBias(0.05), EncoderScale(0.9, 1.2), CommandGain(0.8, 1.25), ImuTilt(0.1, 0.0)]
    found = without_known_errors(replace(MADE, channels={**MADE.channels, **wrong}), effects)
    for name, values in MADE.channels.items():
        np.testing.assert_allclose(found[name], values, rtol=1e-12, atol=1e-12, err_msg=name)


def test_a_recording_without_these_channels_stays_as_it_is():
    bare = replace(MADE, channels={n: v for n, v in MADE.channels.items() if n != "yaw_rate"})
    assert without_known_errors(bare, [GyroScale(1.1)]) is bare
    assert without_known_errors(MADE, []) is MADE
