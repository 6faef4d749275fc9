"""A joint fit over simulated drives finds what they were made with, and its files load everywhere."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import ddagr_gym
from benchmarks.simulated_robots import (
    CASES,
    DELAY,
    FEW,
    GROUNDS,
    MOTOR_RATE,
    STRENGTH,
    calibrated_case,
    drive,
    kept_parts,
)
from ddagr_gym import cli
from ddagr_gym.api.calibrate import CalibrationResult
from ddagr_gym.calibration import files
from ddagr_gym.calibration.result import CALIBRATED, DATA_SHEET
from ddagr_gym.calibration.run import LittleExplainedError, calibrate_drives
from ddagr_gym.config import load_config
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Robot
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.presets import get_robot, get_soil


def calibrated(drives, cache=None, lines=None):
    soils = {ground: get_soil("thesis_a1") for ground in GROUNDS}
    return calibrate_drives(
        drives, GROUNDS, get_robot("ddagr"), soils, FEW, data_sheet="ddagr", cache=cache,
        progress=(lambda line: None) if lines is None else lines.append,
    )  # fmt: skip


@pytest.fixture(scope="module")
def result(drives) -> CalibrationResult:
    return CalibrationResult(calibrated(drives))


@pytest.fixture(scope="module")
def folder(result, tmp_path_factory) -> Path:
    return result.report(tmp_path_factory.mktemp("calibrated") / "CAL")


def holds(item, truth: float) -> bool:
    return item.interval is not None and item.interval[0] <= truth <= item.interval[1]


@pytest.mark.slow
def test_an_imu_that_sits_where_it_is_stated_is_left_there(result, folder):
    assert not any(item.kept for item in result.calibration.imu.sizes)
    assert files.load(folder) == result.calibration
    assert "How the IMU is mounted" in (folder / "calibration.html").read_text()


@pytest.mark.slow
def test_the_mounting_of_an_imu_is_found_and_written_as_effects(tmp_path):
    sits = ("imu_lever_arm=0.4,y=-0.25", "imu_misalignment=0.12", "imu_tilt=0,pitch=0.03")
    moved = [drive(ground, seed, effects=sits) for ground, seed in (("field", 1), ("field", 2), ("track", 3))]
    found = CalibrationResult(calibrated(moved))
    arm, turned, tilted = load_effects(found.report(tmp_path / "CAL") / "effects.yaml")
    assert (arm.x, arm.y) == (pytest.approx(0.4, abs=0.02), pytest.approx(-0.25, abs=0.02))
    assert turned.yaw == pytest.approx(0.12, abs=0.01)
    assert (tilted.roll, tilted.pitch) == (0.0, pytest.approx(0.03, abs=0.002))
    assert "turned about the vertical" in str(found)


@pytest.mark.slow
def test_no_part_is_looked_for_where_all_together_explain_too_little(drives):
    lines = []
    asked = replace(FEW, least_explained=0.9999)
    soils = {ground: get_soil("thesis_a1") for ground in GROUNDS}
    with pytest.raises(LittleExplainedError) as raised:
        calibrate_drives(drives, GROUNDS, get_robot("ddagr"), soils, asked, progress=lines.append)
    assert 0.9 < raised.value.share < 0.9999
    assert not any("without" in line for line in lines)


@pytest.mark.slow
def test_shared_motor_rate_and_delay_are_found(result):
    for name, truth in (("motor_rate", MOTOR_RATE), ("command_delay", DELAY)):
        item = result.calibration.parameter(name)
        assert item.value == pytest.approx(truth, rel=0.02), name
        # the windows of three drives do not cover what the simulator's adaptive steps leave: 1 % of either
        assert item.interval[0] * 0.99 <= truth <= item.interval[1] * 1.01, name


@pytest.mark.slow
def test_strength_is_found_by_ground(result):
    for ground, truth in STRENGTH.items():
        item = result.calibration.parameter(f"soil_strength/{ground}")
        assert item.value == pytest.approx(truth, rel=0.1)
        assert holds(item, truth), (ground, item.interval)


@pytest.mark.slow
def test_parts_that_are_right_on_the_data_sheet_are_kept_off(result):
    kept = {part.name for part in result.calibration.parts if part.kept}
    assert kept == {"speed_loop", "command_delay"}
    assert result.robot.mass == get_robot("ddagr").mass
    item = result.calibration.parameter("yaw_inertia")
    assert not item.calibrated
    assert item.reason
    assert "quick reversals" in item.helps


@pytest.mark.slow
def test_left_out_drives_are_forecast_better(result):
    """Ten times better: the data sheet's motor is twice as fast and not late."""
    for drive_name in {item.drive for item in result.calibration.forecasts}:
        size = {
            e.model: e.rms
            for e in result.calibration.forecasts
            if (e.drive, e.metric, e.horizon) == (drive_name, "wheel_speed", None)
        }
        assert size[CALIBRATED] < 0.1 * size[DATA_SHEET]


@pytest.mark.slow
def test_a_drive_that_is_alone_on_its_ground_is_forecast_by_its_first_half(result):
    found = {item.drive: item.soil_from for item in result.calibration.forecasts}
    assert found == {"field_1.csv": "other drives", "field_2.csv": "other drives", "track_3.csv": "its first half"}


@pytest.mark.slow
def test_an_interrupted_calibration_goes_on_to_the_same_bits(drives, result, tmp_path):
    class Stopped(Exception):
        pass

    def stop(line):
        if line == "every drive by itself":
            raise Stopped

    soils = {ground: get_soil("thesis_a1") for ground in GROUNDS}
    with pytest.raises(Stopped):
        calibrate_drives(
            drives, GROUNDS, get_robot("ddagr"), soils, FEW, data_sheet="ddagr", cache=tmp_path / "c", progress=stop
        )
    again = calibrated(drives, cache=tmp_path / "c").calibration
    assert files.as_text(replace(again, seconds=0.0)) == files.as_text(replace(result.calibration, seconds=0.0))


@pytest.mark.slow
def test_the_file_reads_back_as_it_was(result, folder):
    assert files.as_text(files.load(folder)) == files.as_text(result.calibration)
    assert files.load_robot(folder) == result.robot
    assert files.load_soil(folder, "track") == ("track", result.soils["track"])
    with pytest.raises(InputError, match="name one of them with --ground"):
        files.load_soil(folder)
    with pytest.raises(InputError, match="not calibrated on 'mud'"):
        files.load_soil(folder, "mud")


@pytest.mark.slow
def test_robot_and_soil_are_taken_by_the_other_commands(folder, tmp_path):
    import gymnasium

    robot, soil = str(folder / "robot.yaml"), str(folder / "soil_field.yaml")
    output = tmp_path / "drive.parquet"
    effects = ["--effects", str(folder / "effects.yaml")]
    assert (
        cli.main(
            ["simulate", "--manoeuvre", "straight", "--robot", robot, "--soil", soil, *effects, "--output", str(output)]
        )
        == 0
    )
    environment = gymnasium.make("DDAGR-Turn-v0", robot=robot, soil=soil)
    environment.reset(seed=0)
    assert environment.unwrapped.settings.robot == load_config(robot, Robot)


@pytest.mark.slow
def test_episodes_draw_robots_and_soils_from_a_calibration(folder, result):
    import gymnasium

    environment = gymnasium.make("DDAGR-Turn-v0", calibration=folder, ground="track")
    draws = []
    for seed in range(3):
        environment.reset(seed=seed)
        draws.append(environment.unwrapped.episode)
    # what was not calibrated has no spread, and neither has the default randomisation beside a calibration
    assert {episode.robot.mass for episode in draws} == {result.robot.mass}
    assert len({episode.robot.motor_rate for episode in draws}) == 3
    assert len({episode.soils.cohesion for episode in draws}) == 3
    for episode in draws:
        assert episode.soils.cohesion == pytest.approx(result.soils["track"].cohesion, rel=0.5)
    with pytest.raises(InputError, match="leave them out"):
        gymnasium.make("DDAGR-Turn-v0", calibration=folder, robot="warthog")
    with pytest.raises(InputError, match="unknown ground 'mud'"):
        gymnasium.make("DDAGR-Turn-v0", calibration=folder, ground="mud")


@pytest.mark.slow
def test_replay_takes_the_calibration_without_a_fit(folder, drives, tmp_path):
    fresh = drive("track", 31, 60.0)
    before = ddagr_gym.replay(fresh, "ddagr", "thesis_a1")
    after = ddagr_gym.replay(fresh, calibration=folder, ground="track")
    sizes = [result.errors(5.0, "heading")[0].error.rms for result in (before, after)]
    assert sizes[1] < 0.2 * sizes[0]
    with pytest.raises(InputError, match="a calibration and robot are given"):
        ddagr_gym.replay(fresh, "ddagr", calibration=folder, ground="track")


@pytest.mark.slow
def test_the_page_stands_alone(folder):
    page = (folder / files.PAGE).read_text()
    assert 'src="data:image/svg+xml' in page
    assert "http" not in page.replace("http-equiv", "")
    for name in ("field_1.csv", "track_3.csv", "motor rate", "What would help"):
        assert name in page
    assert page.count("<figure>") == 3 + 4


def found_of(name):
    """What drives of a simulated robot say, the parts that are kept, and the robot as it is."""
    case = CASES[name]
    found = calibrated_case(case)
    kept = kept_parts(found.calibration)
    assert case.parts <= kept
    return found.robot, kept, case.robot


@pytest.mark.slow
def test_a_limit_of_the_commanded_turning_is_found():
    """Half of the turns of these steps are cut by the robot's controller; its data sheet does not say so."""
    found, _, true = found_of("limit of turning")
    assert found.drivetrain.turning_limit == pytest.approx(true.drivetrain.turning_limit, rel=0.02)


@pytest.mark.slow
def test_a_ramp_of_the_commands_is_kept():
    """A robot that takes a second and a half to its commanded speed in equal steps has no dead time in its stead."""
    found, _, true = found_of("ramp of each bank")
    assert found.drivetrain.command_ramp == pytest.approx(true.drivetrain.command_ramp, rel=0.05)
    assert found.drivetrain.command_delay == pytest.approx(DELAY, rel=0.05)


@pytest.mark.slow
def test_ramps_of_mean_and_turning_are_told_from_one_of_each_bank():
    """A robot whose controller limits acceleration and yaw acceleration has neither late commands nor a slow loop."""
    found, kept, true = found_of("ramps of mean and turning")
    assert not kept & {"command_ramp", "command_filter"}
    assert found.drivetrain.mean_ramp == pytest.approx(true.drivetrain.mean_ramp, rel=0.05)
    assert found.drivetrain.turning_ramp == pytest.approx(true.drivetrain.turning_ramp, rel=0.05)
    assert found.drivetrain.command_delay == pytest.approx(DELAY, rel=0.05)


@pytest.mark.slow
def test_a_filter_of_the_commands_is_found():
    """Neither a ramp nor a dead time stands for it; a loop and a filter in series may share their lag otherwise."""
    found, kept, true = found_of("filter of commands")
    assert not kept & {"command_ramp", "mean_ramp", "turning_ramp"}
    lag = found.drivetrain.command_filter + 1.0 / found.motor_rate
    assert lag == pytest.approx(true.drivetrain.command_filter + 1.0 / true.motor_rate, rel=0.05)
    assert found.drivetrain.command_delay == pytest.approx(DELAY, abs=0.05)


@pytest.mark.slow
def test_wheels_that_are_not_as_on_the_data_sheet_are_found():
    found, _, true = found_of("wider track")
    assert found.half_track == pytest.approx(true.half_track, rel=0.02)
