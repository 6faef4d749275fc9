"""What changed since drives from before, without a calibration: named with its size, and nothing where nothing did."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ddagr_gym
from ddagr_gym.diagnosis.change.before_drives import DAY, SOIL_EFFECTS, day_parameters, robot_of_before
from ddagr_gym.diagnosis.change.measured_scatter import measured_scatter
from ddagr_gym.diagnosis.change.run import what_changed_since
from ddagr_gym.diagnosis.result.files import as_mapping, validate
from ddagr_gym.errors import InputError
from ddagr_gym.identification.parameters import robot_parameters
from ddagr_gym.physics.effects.registry import effect_kinds
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.reporting.change_page import write_page
from ddagr_gym.reporting.change_text import change_text
from tests.diagnosis.change.conftest import drive

ROBOT, SOIL = get_robot("ddagr"), get_soil("thesis_a1")

CHANGES = (
    (21, "gyro_bias=0.02", "gyro_bias", "bias", 0.02),
    (22, "encoder_scale=1.08", "encoder_scale", "right", 1.08),
    (23, "imu_misalignment=0.25", "imu_misalignment", "yaw", 0.25),
    (24, "motor_lag=0.25", "motor_lag", "lag", 0.25),
    (26, "command_delay=0.15", "command_delay", "delay", 0.15),
)
"""Seed, what is written into the drive, its name and size."""


def since(after, before, same_ground=True):
    return what_changed_since(after, before, ROBOT, SOIL, same_ground=same_ground)[0].diagnosis


@pytest.fixture(scope="module")
def before():
    return drive(1)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "effect", "name", "field", "truth"), CHANGES, ids=[item[2] for item in CHANGES])
def test_a_change_since_one_drive_is_named_with_its_size(before, seed, effect, name, field, truth):
    diagnosis = since([drive(seed, effect)], [before])
    assert diagnosis.verdict[0] == name
    low, high = diagnosis.findings[0].parameters[field].interval
    assert low <= truth <= high
    certificate = diagnosis.change.certificate
    assert certificate.as_well > certificate.as_well_without
    assert certificate.as_well >= 0.6 * certificate.windows


@pytest.mark.slow
@pytest.mark.parametrize("seed", [31, 32])
def test_nothing_is_named_where_nothing_changed(before, seed):
    diagnosis = since([drive(seed)], [before])
    assert diagnosis.verdict == ("none",)
    assert diagnosis.complete
    change = diagnosis.change
    assert change.against == "before"
    assert {item.effect for item in change.shifts} | set(change.not_compared) == set(effect_kinds())
    least = {item.effect: item.sizes for item in change.shifts}
    assert 0.0 < least["gyro_bias"]["bias"].least_detectable < 0.02
    assert change.certificate.as_well >= 0.6 * change.certificate.windows
