"""What changed is named, and nothing where nothing did."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.api.change import ChangeResult
from ddagr_gym.diagnosis.change.run import what_changed
from ddagr_gym.diagnosis.result.files import as_mapping, validate
from ddagr_gym.errors import InputError
from ddagr_gym.reporting.change_page import write_page
from ddagr_gym.reporting.change_text import change_text
from tests.diagnosis.change.conftest import PICTURES, drive
from tests.viewers.reading import read

CHANGES = (
    (21, "gyro_bias=0.02", "gyro_bias", "bias", 0.02),
    (22, "encoder_scale=1.08", "encoder_scale", "right", 1.08),
    (23, "imu_misalignment=0.25", "imu_misalignment", "yaw", 0.25),
    (24, "motor_lag=0.15", "motor_lag", "lag", 0.15),
)
"""Seed, what is written into the drive, its name and size."""

BEGINS, SCALE = 41.0, 1.03
"""From when on a gyro reads too much [s], and by how much."""


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "effect", "name", "field", "truth"), CHANGES, ids=[item[2] for item in CHANGES])
def test_a_change_is_named_with_its_size(ordinary_robot, seed, effect, name, field, truth):
    diagnosis = what_changed([drive(seed, effect)], ordinary_robot, "field").diagnosis
    assert diagnosis.verdict[0] == name
    low, high = diagnosis.findings[0].parameters[field].interval
    assert low <= truth <= high
    assert diagnosis.findings[0].gain > diagnosis.findings[0].gate


@pytest.mark.slow
@pytest.mark.parametrize("seed", [31, 32, 33])
def test_nothing_is_named_in_an_ordinary_drive(ordinary_robot, seed):
    diagnosis = what_changed([drive(seed)], ordinary_robot, "field").diagnosis
    assert diagnosis.verdict == ("none",)
    assert diagnosis.complete
    change = diagnosis.change
    assert {item.effect for item in change.shifts} | set(change.not_compared) == set(known_effects())
    least = {item.effect: item.sizes for item in change.shifts}
    assert 0.0 < least["gyro_bias"]["bias"].least_detectable < 0.02
    assert all(item.limit > 3.0 for item in change.shifts)  # of a single normal test it would be 1.96


@pytest.mark.slow
def test_a_gyro_that_reads_too_much_from_a_time_on_is_told_with_that_time(ordinary_robot):
    """On average over the drive it is less than what would be found between drives."""
    usual = drive(34, seconds=80.0)
    yaw_rate = np.where(usual.t < BEGINS, 1.0, SCALE) * usual["yaw_rate"]
    later = replace(usual, channels={**usual.channels, "yaw_rate": yaw_rate})
    diagnosis = what_changed([later], ordinary_robot, "field").diagnosis
    (finding,) = diagnosis.findings
    least = {item.effect: item.sizes for item in diagnosis.change.shifts}["gyro_scale"]["scale"].least_detectable
    assert finding.name == "gyro_scale"
    assert finding.onset.kind == "begins"
    low, high = finding.onset.interval
    assert low <= BEGINS <= high
    low, high = finding.parameters["scale"].interval
    assert low <= SCALE <= high
    assert least > 0.5 * (SCALE - 1.0)


def known_effects() -> list[str]:
    from ddagr_gym.physics.effects.registry import effect_kinds

    return list(effect_kinds())


@pytest.mark.slow
def test_what_changed_is_written_for_viewers(ordinary_robot, tmp_path):
    """The bias is what the refitted robot leaves in the gyro, and the corrected one does not."""
    pytest.importorskip("foxglove", reason="needs the extra foxglove")
    outcome = what_changed([drive(26, "gyro_bias=0.02")], ordinary_robot, "field")
    drives = read(ChangeResult(outcome).to_mcap(tmp_path / "changed.mcap"))
    left = {model: drives.column(f"/residual/{model}", "yaw_rate")[:, 2] for model in ("nominal", "corrected")}
    assert np.mean(left["corrected"] ** 2) < 0.5 * np.mean(left["nominal"] ** 2)
    (event,) = [item for _, item in drives.messages["/findings/events"]]
    assert {pair.key: pair.value for pair in event.metadata}["located"] == "no"


@pytest.mark.slow
def test_an_unknown_ground_hides_the_soil_and_not_the_sensors(ordinary_robot, tmp_path):
    outcome = what_changed([drive(25, "soil_change=1.5", "gyro_bias=0.02")], ordinary_robot, "")
    diagnosis = outcome.diagnosis
    assert diagnosis.verdict == ("gyro_bias",)
    assert diagnosis.change.ground == ""
    again = validate(as_mapping(diagnosis))
    assert again.change.shifts[0].effect == diagnosis.change.shifts[0].effect
    assert math.isclose(again.findings[0].gain, diagnosis.findings[0].gain)
    write_page(tmp_path, diagnosis)
    page = (tmp_path / "index.html").read_text()
    assert [page.count(f'alt="{picture}') for picture in PICTURES] == [1] * len(PICTURES)
    assert "http" not in page.replace("http-equiv", "")
    assert "Gyro bias" in change_text(diagnosis)


@pytest.mark.slow
def test_drives_that_cannot_be_compared_are_refused_with_a_sentence(ordinary_robot):
    fresh = drive(41)
    with pytest.raises(InputError, match="has no ground 'mud': choose from field"):
        what_changed([fresh], ordinary_robot, "mud")
    with pytest.raises(InputError, match="robot 'husky' and the calibration is of 'ddagr'"):
        what_changed([fresh.with_meta(robot="husky")], ordinary_robot, "field")
    with pytest.raises(InputError, match="are too few to compare with ordinary drives"):
        what_changed([drive(42, seconds=30.0)], ordinary_robot, "field")
