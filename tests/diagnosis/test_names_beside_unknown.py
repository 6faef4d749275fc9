"""A library effect beside something that no library has: the name is said, and that something else is left."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pytest

import ddagr_gym
from ddagr_gym.diagnosis.gates.threshold_files import default_thresholds
from ddagr_gym.diagnosis.preprocessing.session import prepare
from ddagr_gym.diagnosis.result.drivetrain_names import beside_completed
from ddagr_gym.diagnosis.search.starting_models import refit_nominal
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.base import Vector, size
from ddagr_gym.physics.effects.gyro_bias import GyroBias
from ddagr_gym.physics.effects.gyro_scale import GyroScale
from ddagr_gym.physics.effects.motor_lag import MotorLag
from ddagr_gym.physics.layout import OMEGA, POINT_READINGS, READING, WHEEL_ANGLE
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording


def wobble(row: Vector, parameters: Vector, memory: Vector) -> None:
    """Angle of the right encoder that is off by ``parameters[0]`` times the sine of the wheel's."""
    row[READING + 3] += parameters[0] * row[OMEGA] * math.cos(row[WHEEL_ANGLE])


@dataclass(frozen=True)
class EccentricEncoder(Effect):
    """Encoder disc that sits askew on its shaft: an effect that the library does not have.

    Attributes:
        angle: amplitude.
    """

    name = "eccentric_encoder"
    title = "Eccentric encoder"
    group = "sensors"
    equation = "angle read = phi + angle sin(phi)"
    source = "ours"
    signature = "encoder speed that wobbles once per turn of the wheel"
    actions = ((POINT_READINGS, wobble),)

    angle: float = size("rad", -1.0, 1.0, least=0.01)


BIAS = 0.0122
"""0.7 degrees/s [rad/s]."""


def drives(*effects: Effect) -> list[Recording]:
    return [
        ddagr_gym.simulate(name, effects=effects, rate=25.0, pose_rate=5.0, seed=seed).recording
        for seed, name in enumerate(("arcs", "s_weave"))
    ]


def names(*effects: Effect) -> ddagr_gym.DiagnosisResult:
    return ddagr_gym.diagnose(drives(*effects), names_only=True)


@pytest.mark.slow
def test_a_gyro_bias_is_said_beside_an_encoder_that_no_effect_explains():
    result = names(GyroBias(BIAS), EccentricEncoder(0.1))
    assert result.verdict == ("gyro_bias",)
    assert not result.complete
    assert float(result.findings[0].parameters["bias"]) == pytest.approx(BIAS, rel=0.03)
    misfit = result.diagnosis.misfit
    assert misfit["corrected"]["encoder_right"] > 2.0 * misfit["limit"]["encoder_right"]
    assert "something more is left that has no name here" in result.sentence


@pytest.mark.slow
def test_that_encoder_alone_borrows_no_name():
    assert names(EccentricEncoder(0.1)).verdict == ("unknown",)


@pytest.mark.slow
def test_beside_another_simulator_stays_only_what_stands_there_too():
    """As where the drivetrain was fitted in between: the bias is in the drives, a scale of the gyro is not."""
    gates = default_thresholds("ddagr")
    setting = Setting().with_windows(gates.duration)
    driven = drives(GyroBias(BIAS), EccentricEncoder(0.1))
    session = prepare(driven, get_robot("ddagr"), get_soil("thesis_a1"), gates, setting)
    refitted = refit_nominal(session.problem)[1]
    assert beside_completed(session, refitted, (GyroBias(0.01),)).chosen.names == ("gyro_bias",)
    assert beside_completed(session, refitted, (GyroScale(1.01),)).chosen.names == ()
    assert beside_completed(session, refitted, (MotorLag(0.1), GyroBias(0.01))).chosen.names == ("gyro_bias",)
