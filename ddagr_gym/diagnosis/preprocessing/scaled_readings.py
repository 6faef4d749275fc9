"""Readings and commands whose scale is known to be wrong, as they should have been."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.command_gain import CommandGain
from ddagr_gym.physics.effects.encoder_scale import EncoderScale
from ddagr_gym.physics.effects.gyro_scale import GyroScale
from ddagr_gym.recordings.schema import Recording


def without_scales(recording: Recording, effects: Sequence[Effect]) -> Recording:
    """A recording whose gyro and encoders read what there was, and whose commands are those that the banks obeyed.

    Args:
        recording: with or without these channels.
        effects: scales of the gyro and of the encoders and gains of commands are undone, others stay.
    """
    factors: dict[str, float] = {}
    for effect in effects:
        if isinstance(effect, GyroScale):
            factors["yaw_rate"] = effect.scale
        elif isinstance(effect, EncoderScale):
            factors |= {"encoder_right": effect.right, "encoder_left": effect.left}
        elif isinstance(effect, CommandGain):
            factors |= {"command_right": 1.0 / effect.right, "command_left": 1.0 / effect.left}
    known = {name: recording[name] / factor for name, factor in factors.items() if recording.has(name)}
    return replace(recording, channels={**recording.channels, **known}) if known else recording
