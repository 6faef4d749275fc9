"""Readings and commands whose factor or offset is known to be wrong, as they should have been."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.command_gain import CommandGain
from ddagr_gym.physics.effects.encoder_scale import EncoderScale
from ddagr_gym.physics.effects.gyro_bias import GyroBias
from ddagr_gym.physics.effects.gyro_scale import GyroScale
from ddagr_gym.recordings.schema import Recording


def without_known_errors(recording: Recording, effects: Sequence[Effect]) -> Recording:
    """A recording whose gyro and encoders read what there was, and whose commands are those that the banks obeyed.

    Args:
        recording: with or without these channels.
        effects: in the order in which they act. Scale and bias of the gyro, scales of the encoders and gains of
            commands are undone; others stay.
    """
    for effect in reversed(effects):
        if isinstance(effect, GyroBias) and recording.has("yaw_rate"):
            sound = {"yaw_rate": recording["yaw_rate"] - effect.bias}
            recording = replace(recording, channels={**recording.channels, **sound})
        elif isinstance(effect, GyroScale):
            recording = with_readings_over(recording, {"yaw_rate": effect.scale})
        elif isinstance(effect, EncoderScale):
            recording = with_readings_over(recording, {"encoder_right": effect.right, "encoder_left": effect.left})
        elif isinstance(effect, CommandGain):
            obeyed = {"command_right": 1.0 / effect.right, "command_left": 1.0 / effect.left}
            recording = with_readings_over(recording, obeyed)
    return recording


def with_readings_over(recording: Recording, factors: Mapping[str, float]) -> Recording:
    """A recording whose readings are divided by factors.

    Args:
        recording: with or without these channels.
        factors: by channel.
    """
    known = {name: recording[name] / factor for name, factor in factors.items() if recording.has(name)}
    return replace(recording, channels={**recording.channels, **known}) if known else recording
