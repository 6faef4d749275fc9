"""`ddagr calibrate` refuses what it cannot calibrate in one sentence, and writes nothing."""

import dataclasses

import numpy as np
import pytest

from ddagr_gym.cli import main
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.channels import CHANNELS
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.recordings.storage import save_parquet
from ddagr_gym.simulator import simulate

RATE = 25.0
ROBOT = get_robot("ddagr")


def _commands(seconds, seed):
    rng = np.random.default_rng(seed)
    held = round(2.0 * RATE)
    return np.repeat(rng.uniform(0.3, 1.3, (round(seconds / 2.0), 2)), held, axis=0)


def _drive(path, seed=0, seconds=80.0, *, robot=ROBOT, still=False, without=(), named=ROBOT):
    sensors = Sensors(imu=Imu(sample_rate=RATE), pose=PoseReceiver(rate=5.0))
    commands = _commands(seconds, seed) * (0.0 if still else 1.0)
    columns = simulate(robot, get_soil("firm_ground"), commands, sensors=sensors, seed=seed)
    kept = {key: values for key, values in columns.items() if key in ("t", *CHANNELS) and key not in without}
    save_parquet(Recording.from_columns(kept, named, source=path.stem), path)


def _wheels_larger_by(more):
    wheels = tuple(dataclasses.replace(wheel, minor_radius=wheel.minor_radius + more) for wheel in ROBOT.wheels)
    return dataclasses.replace(ROBOT, wheels=wheels)


@pytest.fixture(scope="module")
def drives(tmp_path_factory):
    """Drives of which all but two cannot be calibrated with."""
    folder = tmp_path_factory.mktemp("drives")
    _drive(folder / "monday.parquet", 0)
    _drive(folder / "tuesday.parquet", 1)
    _drive(folder / "blink.parquet", 2, 4.0)
    _drive(folder / "parked.parquet", 3, still=True)
    _drive(folder / "deaf.parquet", 4, without=("yaw_rate",))
    _drive(folder / "husky.parquet", 5, named=get_robot("husky"))
    _drive(folder / "large.parquet", 6, robot=_wheels_larger_by(0.06))
    _drive(folder / "small.parquet", 7, robot=_wheels_larger_by(-0.03))
    (folder / "empty").mkdir()
    (folder / "notes.parquet").write_text("no drive")
    return folder


TWO = ("monday", "tuesday")
REFUSED = {
    "no drive": ((), (), "no ordinary drive is given"),
    "no such file": (("sunday",), (), "sunday"),
    "no recording": (("notes",), (), "notes.parquet"),
    "an empty folder": (("empty/",), (), "empty"),
    "too short": (("blink",), (), "4 s under known commands"),
    "standing still": (("parked",), (), "stand still"),
    "no gyro": (("deaf",), (), "yaw_rate"),
    "another robot": (("monday", "husky"), (), "husky"),
    "two robots": (("small", "large"), (), "not of one robot"),
    "one drive twice": (("monday", "monday"), (), "monday"),
    "no such robot": (TWO, ("--robot", "tractor"), "tractor"),
    "no such soil": (TWO, ("--soil", "cheese"), "cheese"),
    "soil of no ground": (TWO, ("--soil", "moon=firm_ground"), "moon"),
    "a ground without drives": (TWO, ("--ground", "sand="), "sand="),
    "a ground twice": (TWO, ("--ground", "sand=monday.parquet", "--ground", "sand=tuesday.parquet"), "sand"),
    "a drive on two grounds": (
        TWO,
        ("--ground", "a=monday.parquet,tuesday.parquet", "--ground", "b=monday.parquet"),
        "one ground",
    ),
    "a drive on no ground": (TWO, ("--ground", "a=monday.parquet"), "tuesday"),
    "a ground of a drive that is not given": (TWO, ("--ground", "a=sunday.parquet"), "sunday"),
    "negative threads": (TWO, ("--threads", "-1"), "-1"),
    "no processes": (TWO, ("--processes", "0"), "processes"),
    "a negative seed": (TWO, ("--seed", "-1"), "-1"),
}


def test_grounds_of_drives_of_one_file_name(drives, tmp_path, monkeypatch, capsys):
    paths = [tmp_path / name / "run.parquet" for name in TWO]
    for name, path in zip(TWO, paths, strict=True):
        path.parent.mkdir()
        path.write_bytes((drives / f"{name}.parquet").read_bytes())

    def grounds_alone(found, grounds, *others, **options):
        raise InputError(f"{[item.meta.source for item in found]} on {grounds}")

    monkeypatch.setattr("ddagr_gym.calibration.run.calibrate_drives", grounds_alone)
    grounds = ["--ground", "sand=tuesday/run.parquet", "--ground", f"yard={paths[0]}"]
    words = ["calibrate", *map(str, paths), "--robot", "ddagr", *grounds, "-o", str(tmp_path / "calibration")]
    assert main(words) == 2
    assert "['monday/run.parquet', 'tuesday/run.parquet'] on ('yard', 'sand')" in capsys.readouterr().err


def test_limits_of_the_command_are_kept(drives, tmp_path, capsys):
    words = ["calibrate", str(drives / "monday.parquet"), "--robot", "ddagr", "--maximum-rows", "10"]
    assert main([*words, "-o", str(tmp_path / "calibration")]) == 2
    assert "more than 10 rows" in capsys.readouterr().err


@pytest.mark.parametrize(("given", "options", "said"), REFUSED.values(), ids=REFUSED)
def test_refusals_are_one_sentence_and_write_nothing(given, options, said, drives, tmp_path, capsys):
    paths = [str(drives / name) if name.endswith("/") else str(drives / f"{name}.parquet") for name in given]
    robot = () if "--robot" in options else ("--robot", "ddagr")
    output = tmp_path / "calibration"
    assert main(["calibrate", *paths, *robot, *options, "-o", str(output)]) == 2
    text = capsys.readouterr().err
    assert said in text
    assert "Traceback" not in text
    assert not list(tmp_path.iterdir())
