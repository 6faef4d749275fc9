"""What changed since drives from before, without a calibration: named with its size, and nothing where nothing did."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ddagr_gym
from ddagr_gym.diagnosis.change import run
from ddagr_gym.diagnosis.change.before_drives import (
    DAY,
    GROUND,
    as_left_out,
    day_parameters,
    joint_fit,
    robot_of_before,
)
from ddagr_gym.diagnosis.change.ground_slope import SAME_SLOPE, SLOPE_OF_FIELDS, GroundSlope
from ddagr_gym.diagnosis.change.measured_scatter import measured_scatter
from ddagr_gym.diagnosis.change.ordinary import SOIL_EFFECTS, OrdinaryRobot, Reference
from ddagr_gym.diagnosis.change.run import what_changed_since
from ddagr_gym.diagnosis.preprocessing.mended_recordings import mend_recordings
from ddagr_gym.diagnosis.result.files import as_mapping, validate
from ddagr_gym.errors import InputError
from ddagr_gym.identification.parameters import robot_parameters
from ddagr_gym.physics.effects.gyro_bias import GyroBias
from ddagr_gym.physics.effects.registry import effect_kinds
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.reporting.change_page import write_page
from ddagr_gym.reporting.change_text import change_text
from tests.diagnosis.change.conftest import PICTURES, RATE, drive

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


def test_a_drive_of_a_common_fit_counts_as_if_it_had_been_left_out():
    own = Reference("one", "same", False, None, None, moved={"soil_strength": 1.2})
    assert as_left_out(own, 3).moved == {"soil_strength": pytest.approx(1.8)}
    assert as_left_out(own, 1).moved == {"soil_strength": 1.2}


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "effect", "name", "field", "truth"), CHANGES, ids=[item[2] for item in CHANGES])
def test_a_change_since_one_drive_is_named_with_its_size(before, seed, effect, name, field, truth):
    diagnosis = since([drive(seed, effect)], [before])
    assert diagnosis.verdict[0] == name
    low, high = diagnosis.findings[0].parameters[field].interval
    assert low <= truth <= high
    certificate = diagnosis.change.certificate
    # what a parameter of the robot takes over is forecast well without its name
    assert certificate.as_well > certificate.as_well_without or name == "motor_lag"
    assert certificate.as_well >= 0.6 * certificate.windows


@pytest.mark.slow
@pytest.mark.parametrize("seed", [31, 32])
def test_nothing_is_named_where_nothing_changed(before, seed):
    diagnosis = since([drive(seed)], [before])
    assert diagnosis.verdict == ("none",)
    assert diagnosis.complete
    change = diagnosis.change
    assert change.against == "before"
    assert {item.effect for item in change.shifts} | set(change.not_compared) | {"sensor_hold"} == set(effect_kinds())
    assert "sensor_hold" not in change.not_compared
    least = {item.effect: item.sizes for item in change.shifts}
    assert 0.0 < least["gyro_bias"]["bias"].least_detectable < 0.02
    assert change.certificate.as_well >= 0.6 * change.certificate.windows


def test_the_ground_of_drives_before_is_told_with_its_slope():
    """A nominal robot that stands level would take a slope for fifteen times the stiffness."""
    sloping = drive(1, "slope=0.06,direction=0.8", seconds=24.0)
    known = joint_fit(mend_recordings([sloping]), ROBOT, SOIL, 2.0, np.random.default_rng(0), 1)
    truth = Slope(0.06, 0.8).gradient
    for told, deviation, true in zip(known.gradient, known.slope.deviations, truth, strict=True):
        assert abs(told - true) < 0.002 < SAME_SLOPE <= deviation < 0.008
    stiffness = np.log(known.soil.frictional_modulus / SOIL.frictional_modulus)
    assert abs(stiffness) < 3.0 * known.deviations["soil_stiffness"] < 1.5
    assert known.same_ground["soil_stiffness"] > max(known.deviations["soil_stiffness"], 0.1)


def test_a_drive_without_headings_tells_no_slope():
    level = drive(1, seconds=24.0)
    blind = replace(level, channels={name: v for name, v in level.channels.items() if not name.startswith("pose")})
    assert joint_fit(mend_recordings([blind]), ROBOT, SOIL, 2.0, np.random.default_rng(0), 1).slope is None
    before = GroundSlope((0.06, 0.0), (0.01, 0.01))
    known = OrdinaryRobot(ROBOT, {}, (), {}, None, (), slopes={GROUND: before})
    assert known.seen_by([level], GROUND).slope is before
    assert known.seen_by([level, blind], GROUND).known == ()
    alone = known.seen_by([blind], GROUND).slope
    assert alone.gradient == (0.0, 0.0)
    assert alone.deviations == (pytest.approx(np.hypot(0.06, 0.01)),) * 2


def test_another_ground_may_slope_as_any_where_slopes_are_told():
    level = drive(1, seconds=24.0)
    known = OrdinaryRobot(ROBOT, {}, (), {}, None, (), slopes={GROUND: GroundSlope((0.06, 0.0), (0.01, 0.01))})
    assert known.seen_by([level], "").slope == GroundSlope((0.0, 0.0), (SLOPE_OF_FIELDS, SLOPE_OF_FIELDS))
    assert OrdinaryRobot(ROBOT, {}, (), {}, None, ()).seen_by([level], "").slope is None


def test_a_slope_that_is_named_comes_on_top_of_that_before():
    ground = GroundSlope(Slope(0.05, 0.0).gradient, (0.005, 0.005))
    bias, (both,) = GyroBias(0.01), ground.with_named([Slope(0.05, np.pi)])
    level = GroundSlope((0.0001, 0.0), (0.005, 0.005))
    assert level.with_named([bias]) == (bias,)
    assert level.with_named([Slope(0.02, 0.0)])[0].angle == pytest.approx(0.0201, abs=1e-5)
    assert both.angle == pytest.approx(0.0, abs=1e-12)
    assert ground.with_named([bias]) == (bias, Slope.of_gradient(*ground.gradient))
    assert ground.effects[0].angle == pytest.approx(0.05)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [31, 32])
def test_a_slope_before_and_after_is_no_change(seed):
    """Driven in another way, so that the slope does something else to a soil that stands for it."""
    sloping = "slope=0.06,direction=0.8"
    outcome, known = what_changed_since([drive(seed, sloping)], [drive(1, sloping)], ROBOT, SOIL, same_ground=True)
    assert outcome.diagnosis.verdict == ("none",)
    slope = outcome.diagnosis.change.slope
    assert slope.angle == pytest.approx(0.06, abs=0.003)
    assert "slopes by 3.4 degrees, rising towards 4" in change_text(outcome.diagnosis)
    assert outcome.effects == known.slopes[GROUND].effects


@pytest.mark.slow
def test_noisier_sensors_are_a_change_without_a_name(before, tmp_path):
    """Noise of twice the size is in no effect of the library: the answer says which channels are rougher."""
    rng = np.random.default_rng(5)
    after = drive(32)
    more = {"yaw_rate": 0.004, "specific_force_x": 0.05, "specific_force_y": 0.05, "encoder_right": 0.02}
    channels = {name: after[name] + size * rng.normal(size=len(after)) for name, size in more.items()}
    diagnosis = since([replace(after, channels={**after.channels, **channels})], [before])
    assert diagnosis.verdict == ("unknown",)
    assert not diagnosis.complete
    assert {item.channel for item in diagnosis.change.channels if item.rougher} >= {"yaw_rate", "specific_force_x"}
    assert "the model's error is larger than before in" in diagnosis.sentence
    write_page(tmp_path, diagnosis)
    assert (tmp_path / "index.html").read_text().count('alt="Error of the model in each channel') == 1
    assert validate(as_mapping(diagnosis)).change.channels == diagnosis.change.channels
    assert diagnosis.change.certificate.as_well < 0.3 * diagnosis.change.certificate.windows


@pytest.mark.slow
def test_three_drives_before_and_two_after_on_another_ground(tmp_path):
    """The soil has lost four tenths of its strength: that has no name there, and hides no gyro."""
    after = [drive(seed, "soil_change=0.6", "gyro_bias=0.02") for seed in (25, 29)]
    diagnosis = since(after, [drive(seed) for seed in (1, 2, 3)], same_ground=False)
    assert diagnosis.verdict == ("gyro_bias",)
    change = diagnosis.change
    assert change.ground == ""
    assert change.ordinary == ("drive_1.csv", "drive_2.csv", "drive_3.csv")
    assert set(SOIL_EFFECTS) <= set(change.not_compared)
    assert not {item.effect for item in change.shifts} & set(SOIL_EFFECTS)
    assert "no change of the soil has a name" in diagnosis.sentence
    assert change.shifts[0].degrees == pytest.approx(measured_scatter().other_ground.degrees + 2.0, rel=1e-3)
    again = validate(as_mapping(diagnosis))
    assert again.change.certificate == change.certificate
    text = change_text(diagnosis)
    assert "left-out windows are forecast as well as 90 % of those of the drives before" in text
    write_page(tmp_path, diagnosis)
    page = (tmp_path / "index.html").read_text()
    assert [page.count(f'alt="{picture}') for picture in PICTURES] == [1] * len(PICTURES)
    assert "http" not in page.replace("http-equiv", "")
    assert "on another ground it is another one in any case" in page


@pytest.mark.slow
def test_what_the_robot_has_wrong_before_and_after_is_no_change():
    """A gyro that always reads too much, and encoders that always do: neither changed."""
    always = ("gyro_bias=0.02", "encoder_scale=1.05")
    diagnosis = since([drive(33, *always)], [drive(4, *always)])
    assert diagnosis.verdict == ("none",)
    sizes = {item.effect: item.sizes for item in diagnosis.change.shifts}
    assert sizes["encoder_scale"]["right"].before == pytest.approx(0.05, abs=0.01)


@pytest.mark.slow
def test_pieces_are_of_a_single_drive():
    known = robot_of_before(mend_recordings([drive(1)]), ROBOT, SOIL)
    assert len(known.references) == 1
    assert len(known.pieces) == 2  # of twelve windows, five at least
    assert len(known.losses) == 12
    several = robot_of_before(mend_recordings([drive(1), drive(2)]), ROBOT, SOIL)
    assert (len(several.references), len(several.pieces)) == (2, 0)


def test_drives_from_before_are_mended_once_and_with_the_seed(monkeypatch):
    """What is wrong with their channels is what they are fitted without, whatever the seed."""
    before, seeds, used = drive(1, seconds=45.0), [], []

    def mend(recordings, seed=0):
        seeds.append(seed)
        return mend_recordings(recordings, seed)

    monkeypatch.setattr(run, "mend_recordings", mend)
    monkeypatch.setattr(run, "robot_of_before", lambda mended, *nominal, **options: used.append(mended))

    def stop(*given, usual, **options):
        used.append(usual)
        raise InterruptedError

    monkeypatch.setattr(run, "what_changed", stop)
    with pytest.raises(InterruptedError):
        what_changed_since([drive(2, seconds=45.0)], [before], ROBOT, SOIL, seed=7)
    assert seeds == [7]
    assert used[0] is used[1]
    assert used[0].given == (before,)


def test_only_what_a_day_changes_in_a_robot_is_free():
    assert {p.name for p in robot_parameters(ROBOT)} > {p.name for p in day_parameters(ROBOT)} == {"motor_rate"}
    assert day_parameters(ROBOT)[0].prior == DAY["motor_rate"]


def test_scatter_was_measured_for_every_effect_that_is_compared():
    scatter = measured_scatter()
    compared = set(effect_kinds()) - {"sensor_hold", "soil_patch"}
    for found in (scatter.same_ground, scatter.other_ground):
        assert set(found.deviations) == compared
        assert found.degrees >= 3.0


def refused(match: str, after, before, **options) -> None:
    with pytest.raises(InputError, match=match):
        ddagr_gym.diagnose(after, before=before, **options)


def test_drives_that_cannot_be_compared_are_refused_with_a_sentence(tmp_path):
    fresh, known = drive(41, seconds=45.0), drive(42, seconds=45.0)
    refused("no drive from before is given", fresh, [])
    refused("are of the robots ddagr, husky: give those of one robot", fresh, known.with_meta(robot="husky"))
    refused("was imported for the robot 'husky'", fresh, known.with_meta(robot="husky"), robot="ddagr")
    with pytest.raises(InputError, match="of the robot 'husky', compared with --robot ddagr"):
        since([fresh.with_meta(robot="husky")], [known])
    refused("hold the same values: leave it out on one side", [fresh, known], known)
    refused("a calibration and drives from before are given", fresh, known, calibration=tmp_path)
    refused("the ground is 'sand' and there is no calibration", fresh, known, ground="sand")
    refused("thresholds is given with drives from before", fresh, known, thresholds=tmp_path / "thresholds.json")
    refused(
        "the cache kept is given with a calibration or drives from before: leave it out", fresh, known, cache="kept"
    )
    refused("are too few to compare with ordinary drives: give 32 s at least", drive(43, seconds=20.0), known)
    refused("has no yaw_rate", without(fresh, "yaw_rate"), known)
    still = ddagr_gym.simulate(np.zeros((900, 2)), ROBOT, SOIL, rate=20.0, seed=1).recording
    refused("commanded to stand still", fresh, still)
    slow = ddagr_gym.simulate(np.full((450, 2), 0.7), ROBOT, SOIL, rate=10.0, seed=1).recording
    refused(r"20 Hz and .* from before 10 Hz: .*\(a topic map with `rate: 50` reads a bag at 50 Hz", fresh, slow)
    with pytest.raises(InputError, match="whether the ground is the same is said, and no drive from before"):
        ddagr_gym.diagnose(fresh, same_ground=True)


def without(recording, name):
    return replace(recording, channels={k: v for k, v in recording.channels.items() if k != name})


@pytest.mark.slow
def test_a_gyro_that_began_to_hold_its_readings_is_named(before):
    after = drive(34)
    rows = np.arange(len(after)) // 5 * 5
    held = replace(after, channels={**after.channels, "yaw_rate": after["yaw_rate"][rows]})
    diagnosis = since([held], [before])
    assert diagnosis.verdict == ("sensor_hold",)
    finding = diagnosis.findings[0]
    assert finding.parameters["duration"].value == pytest.approx(4.0 / RATE, rel=0.1)
    assert {name for name in ("gyro", "encoders", "accelerometer") if finding.parameters[name].value} == {"gyro"}
