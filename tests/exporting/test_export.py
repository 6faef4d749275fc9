"""A corrected simulator in other projects' formats: numbers, files, and a MuJoCo model that turns as ours does."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest

import ddagr_gym
from ddagr_gym.cli import main
from ddagr_gym.config import load_config
from ddagr_gym.errors import InputError
from ddagr_gym.exporting.carried_over import _limits, first_order
from ddagr_gym.exporting.friction import friction_of_turn, sliding_forces
from ddagr_gym.exporting.gazebo_model import NAMESPACE
from ddagr_gym.exporting.mujoco_model import mujoco_model
from ddagr_gym.exporting.randomisation import RandomisationFile
from ddagr_gym.parameters import Drivetrain
from ddagr_gym.physics.effects import load_effects, save_effects
from ddagr_gym.physics.effects.motor_saturation import MotorSaturation
from ddagr_gym.presets import get_robot

EFFECTS = (
    "gyro_scale=1.05", "command_delay=0.1", "motor_lag=0.1", "imu_tilt=0.05,pitch=-0.03",
    "accelerometer_bias=0.2", "slope=0.04",
)  # fmt: skip
INTERVALS = ({"scale": (1.03, 1.07)}, {"delay": (0.08, 0.12)}, {}, {}, {}, {})


@pytest.fixture(scope="module")
def diagnosis(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("found") / "diagnosis"
    save_effects(folder / "effects.yaml", load_effects(EFFECTS), intervals=INTERVALS)
    (folder / "diagnosis.json").write_text("{}")
    return folder


def exported(diagnosis: Path, to: str, **options):
    return ddagr_gym.export(diagnosis, to, robot="ddagr", soil="thesis_a1", draws=options.pop("draws", 3), **options)


def test_numbers_are_those_of_the_effects(diagnosis):
    found = exported(diagnosis, "randomisation").carried_over
    assert found.gyro_scale == 1.05
    assert found.command_delay == pytest.approx(0.1, abs=0.01)
    assert found.time_constant == pytest.approx(1.0 / 4.5 + 0.1, rel=0.03)
    assert (found.slope_angle, found.accelerometer_bias_x, found.imu_pitch) == (0.04, 0.2, -0.03)
    assert found.track < found.effective_track == pytest.approx(found.commanded_track, rel=1e-3)


def test_a_lag_after_a_delay_is_told():
    time = np.arange(1, 1001) / 125.0
    speeds = 2.0 * (1.0 - np.exp(-np.maximum(time - 0.3, 0.0) / 0.25))
    assert first_order(speeds, 125.0) == pytest.approx((0.3, 0.25), rel=1e-3)


def test_friction_balances_a_turn():
    x, y = np.array([0.3, 0.3, -0.3, -0.3]), np.array([-0.5, 0.5, -0.5, 0.5])
    load, rim, rate, along = np.full(4, 400.0), np.array([0.3, 0.1, 0.3, 0.1]), 0.13, 0.2
    friction_along, friction_across = friction_of_turn(x, y, load, rim, rate, along)
    v_x = 0.2
    f_x, f_y = sliding_forces(
        v_x - rate * y - rim, rate * x, friction_along * load, friction_across / friction_along, 0.3
    )
    assert (x * f_y - y * f_x).sum() == pytest.approx(0.0, abs=0.03 * np.abs(y * f_x).sum())
    assert np.abs(f_x).sum() / load.sum() == pytest.approx(along, rel=0.03)
    assert all(math.isnan(value) for value in friction_of_turn(x, y, load, rim, 0.5, along))


def test_mujoco_turns_as_the_corrected_simulator(diagnosis):
    mujoco = pytest.importorskip("mujoco", reason="needs the extra mujoco")
    result = exported(diagnosis, "mujoco")
    found, comparison = result.carried_over, result.comparison
    errors = {row.drive: (row.yaw_error, row.speed_error) for row in comparison.drives}
    for drive in ("left turn (working point)", "right turn (working point)"):
        assert abs(errors[drive][0]) < 0.01
        assert abs(errors[drive][1]) < 0.05
    assert all(abs(yaw) < 0.04 for yaw, _ in errors.values() if yaw is not None)
    assert found.effective_track > 1.2 * found.track  # without slip it would turn a fifth faster
    assert abs(errors["straight"][1]) < 0.01
    assert comparison.step_error < 0.01
    apart = np.linalg.norm(comparison.own_paths - comparison.other_paths, axis=2).max(axis=1)
    lengths = np.linalg.norm(np.diff(comparison.own_paths, axis=1), axis=2).sum(axis=1)
    assert (apart[:3] < 0.06 * lengths[:3]).all()
    model = mujoco.MjModel.from_xml_string(result.files["robot.xml"])
    assert sum(model.body_mass) == pytest.approx(found.mass)
    assert model.actuator_delay == pytest.approx(found.command_delay)
    assert np.linalg.norm(model.opt.gravity) == pytest.approx(9.80665)


def test_friction_makes_mujoco_turn_as_the_balance_of_forces_says(diagnosis):
    pytest.importorskip("mujoco", reason="needs the extra mujoco")
    from ddagr_gym.exporting.mujoco_drives import drive_mujoco

    found = exported(diagnosis, "randomisation").carried_over
    command = np.array([[0.9, 0.3]])
    rim, half_base, half_track = 0.3 * found.rolling_radius, 0.5 * found.wheelbase, 0.5 * found.track
    rates = []
    for across in (0.5, 1.0, 2.0):
        model = mujoco_model("ddagr", dataclasses.replace(found, friction_across=across * found.friction_along))
        rate = drive_mujoco(model, command).yaw_rate[0]
        sliding = np.array([rate * half_track - rim]), np.array([rate * half_base])
        f_x, f_y = sliding_forces(*sliding, np.ones(1), across, rim)
        assert half_track * f_x[0] + half_base * f_y[0] == pytest.approx(0.0, abs=0.02 * half_track)
        rates.append(rate)
    assert rates[0] > 1.1 * rates[1] > 1.2 * rates[2]


def test_the_turn_needs_friction_by_direction(tmp_path):
    pytest.importorskip("mujoco", reason="needs the extra mujoco")
    from ddagr_gym.exporting.mujoco_drives import drive_mujoco

    save_effects(tmp_path / "effects.yaml", ())
    (tmp_path / "diagnosis.json").write_text("{}")
    result = ddagr_gym.export(tmp_path, "mujoco", robot="husky", soil="lete_sand_wong", draws=2)
    turn, found = result.comparison.drives[1], result.carried_over
    assert abs(turn.yaw_error) < 0.01
    alike = dataclasses.replace(found, friction_across=found.friction_along)
    rate = drive_mujoco(mujoco_model("husky", alike), np.array([[turn.right, turn.left]])).yaw_rate[0]
    assert rate > 1.1 * turn.yaw_rate


def test_without_mujoco_the_model_is_written_and_said_not_to_be_stepped(diagnosis, monkeypatch):
    monkeypatch.setattr("ddagr_gym.api.export.find_spec", lambda name: None)
    result = exported(diagnosis, "mujoco")
    assert not result.comparison.stepped
    assert ElementTree.fromstring(result.files["robot.xml"]).tag == "mujoco"
    assert "robot.xml was not stepped, since the package 'mujoco' is not installed" in str(result)


def test_mujoco_reads_a_tilted_imu_as_ours_does(diagnosis):
    mujoco = pytest.importorskip("mujoco", reason="needs the extra mujoco")
    found = exported(diagnosis, "mujoco").carried_over
    level = dataclasses.replace(found, slope_angle=0.0)
    model = mujoco.MjModel.from_xml_string(mujoco_model("ddagr", level))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=2000)
    reading = data.sensor("accelerometer").data
    assert reading[0] == pytest.approx(-9.80665 * math.sin(-0.03), abs=0.02)
    assert reading[1] == pytest.approx(9.80665 * math.sin(0.05) * math.cos(-0.03), abs=0.02)


def test_gazebo_model_has_the_numbers(diagnosis):
    result = exported(diagnosis, "gazebo")
    found, root = result.carried_over, ElementTree.fromstring(result.files["model.sdf"])
    drive = root.find("model/plugin")
    assert drive.get("name") == "gz::sim::systems::DiffDrive"
    assert float(drive.findtext("wheel_separation")) == pytest.approx(found.commanded_track)
    assert float(drive.findtext("wheel_radius")) == pytest.approx(found.rolling_radius)
    joints = {joint.get("name") for joint in root.findall("model/joint")}
    named = [item.text for side in ("left_joint", "right_joint") for item in drive.findall(side)]
    assert set(named) == joints
    assert len(named) == 4
    masses = [float(item.text) for item in root.iter("mass")]
    assert sum(masses) == pytest.approx(found.mass)
    for ode in root.iter("ode"):
        assert float(ode.findtext("mu")) == pytest.approx(found.friction_along)
        assert float(ode.findtext("mu2")) == pytest.approx(found.friction_across)
        assert ode.find("fdir1").get(f"{{{NAMESPACE}}}expressed_in") == "base_link"
    noise = root.find("model/link/sensor/imu/linear_acceleration/x/noise")
    assert float(noise.findtext("mean")) == pytest.approx(0.2)


def test_ranges_are_read_again_and_hold_the_intervals(diagnosis, tmp_path):
    result = exported(diagnosis, "randomisation", draws=40, seed=1)
    path = tmp_path / "randomisation.yaml"
    path.write_text(result.files["randomisation.yaml"])
    content = load_config(path, RandomisationFile)
    scale, mass = content.parameters["gyro_scale"], content.parameters["mass"]
    assert scale.distribution == "normal"
    assert (scale.low, scale.high) == (pytest.approx(1.03, abs=0.012), pytest.approx(1.07, abs=0.012))
    assert (mass.distribution, mass.low, mass.value, mass.high) == ("fixed", 168.0, 168.0, 168.0)
    assert content.parameters["acceleration_limit"].value is None
    again = exported(diagnosis, "randomisation", draws=40, seed=1)
    assert again.files == result.files


def test_command_writes_files_and_page(diagnosis, tmp_path, capsys):
    words = [
        "export", str(diagnosis), "--to", "gazebo", "--robot", "ddagr", "--soil", "thesis_a1", "--draws", "2",
        "--output", str(tmp_path / "out"),
    ]  # fmt: skip
    assert main(words) == 0
    assert "at the working point" in capsys.readouterr().out
    page = (tmp_path / "out" / "index.html").read_text()
    assert "What does not carry over" in page
    assert "was not run in Gazebo" in page
    assert {"model.sdf", "model.config"} <= {item.name for item in (tmp_path / "out").iterdir()}
    assert main(words) == 2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--to", "isaac"], "unknown format 'isaac'"),
        (["--to", "gazebo", "--ground", "sand"], "leave out --ground"),
        (["--to", "gazebo"], "holds no robot.yaml"),
        (["--to", "gazebo", "--robot", "ddagr", "--soil", "thesis_a1", "--speed", "9"], "speed is 9 m/s"),
        (["--to", "gazebo", "--draws", "1"], "draws is 1"),
    ],
)
def test_bad_input_is_one_sentence(diagnosis, tmp_path, capsys, words, said):
    assert main(["export", str(diagnosis), "--output", str(tmp_path / "out"), *words]) == 2
    complaint = capsys.readouterr().err
    assert said in complaint
    assert complaint.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_folder_without_an_answer(tmp_path):
    with pytest.raises(InputError, match="holds neither diagnosis"):
        ddagr_gym.export(tmp_path, "gazebo")


def test_limits_are_the_lowest_of_robot_and_effect():
    robot = dataclasses.replace(get_robot("ddagr"), drivetrain=Drivetrain(load_compliance=0.02, acceleration_limit=3.0))
    for effect, expected in (
        (MotorSaturation(0.9, torque_limit=25.0), (0.9, 0.5)),
        (MotorSaturation(1e3, 2.0), (robot.maximum_wheel_speed, 2.0)),
        (MotorSaturation(1e3, turning_limit=0.3), (robot.maximum_wheel_speed, 3.0)),
    ):
        found = _limits(SimpleNamespace(robot=robot, effects=(effect,)))
        assert (found["speed_limit"], found["acceleration_limit"]) == expected
        assert found["bank_inertia"] == pytest.approx(50.0)
        assert found["torque_limit"] == pytest.approx(50.0 * expected[1])


def test_a_torque_limit_of_ideal_banks_stays_a_torque():
    found = _limits(SimpleNamespace(robot=get_robot("ddagr"), effects=(MotorSaturation(1e3, torque_limit=25.0),)))
    assert (found["acceleration_limit"], found["torque_limit"], found["bank_inertia"]) == (np.inf, 25.0, 0.0)
