"""What a comparison needs of ordinary drives is read as it was written."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.calibration.ordinary_drives import Ordinary, pooled
from ddagr_gym.calibration.ordinary_drives import _Left as Left
from ddagr_gym.calibration.ordinary_files import load_ordinary, save_ordinary
from ddagr_gym.diagnosis.change.ordinary import Reference, Scores
from ddagr_gym.diagnosis.change.robot_on_ground import RobotOnGround
from ddagr_gym.diagnosis.change.weighing import SensorBias, Weighing
from ddagr_gym.errors import InputError
from ddagr_gym.presets import get_robot, get_soil


def scores() -> Scores:
    rng = np.random.default_rng(0)
    root = rng.normal(size=(3, 3))
    return Scores(("a 0", "a 1", "b 0"), rng.normal(size=3), root @ root.T, 2.0 * root @ root.T, 0.1 * root @ root.T)


WEIGHING = Weighing(6.0, 1.2, 0.1, 1.0, np.array([1.0, np.inf, *np.ones(6)]), np.full(8, 2.0), 1e-3, 0.05)
ROBOT, SOIL = get_robot("ddagr"), get_soil("thesis_a1")
ORDINARY = Ordinary(
    replace(WEIGHING, turning=0.2),
    (
        Reference(
            "one.csv",
            "sand",
            False,
            scores(),
            scores(),
            robot=ROBOT,
            soil=SOIL,
            moved={"mass": 1.5},
            period=0.025,
            holds={"pose": 0.15},
        ),
        Reference("two.csv", "sand", False, scores(), scores(), on_ground=RobotOnGround({"a": 0.5}, {"a": 0.25})),
    ),
    {"sand": RobotOnGround({"a": -0.5}, {"a": 0.125})},
)


def test_weights_and_scores_read_back(tmp_path):
    save_ordinary(ORDINARY, tmp_path / "bank.json")
    found = load_ordinary(tmp_path / "bank.json")
    assert found.weighing.sigma.tolist() == WEIGHING.sigma.tolist()
    assert (found.weighing.lateness, found.weighing.turning) == (0.1, 0.2)
    first = found.references[0]
    assert (first.drive, first.ground, first.reversed_gyro) == ("one.csv", "sand", False)
    for name in ("gradient", "information", "within", "between"):
        np.testing.assert_allclose(getattr(first.known_ground, name), getattr(scores(), name), rtol=1e-8)
    assert (first.robot, first.soil) == (ROBOT, SOIL)
    assert first.moved == {"mass": 1.5}
    assert (first.period, found.references[1].period) == (0.025, 0.0)
    assert (first.holds, found.references[1].holds) == ({"pose": 0.15}, None)
    assert (found.references[1].robot, found.references[1].soil) == (None, None)
    assert found.references[1].on_ground == ORDINARY.references[1].on_ground
    assert found.on_grounds == ORDINARY.on_grounds


def test_a_bank_of_the_second_version_is_read(tmp_path):
    path = tmp_path / "bank.json"
    save_ordinary(ORDINARY, path)
    body = json.loads(path.read_text())
    del body["ordinary"]["on_grounds"], body["ordinary"]["references"][1]["on_ground"]
    del body["ordinary"]["references"][0]["period"], body["ordinary"]["references"][0]["holds"]
    path.write_text(json.dumps({**body, "version": 2, "runs": [{"kind": "real"}]}))
    found = load_ordinary(path)
    assert [item.drive for item in found.references] == ["one.csv", "two.csv"]
    assert (found.references[0].period, found.references[0].holds) == (0.0, None)
    assert (found.on_grounds, found.references[1].on_ground) == ({}, RobotOnGround())


def test_a_bank_without_ordinary_drives_is_refused(tmp_path):
    path = tmp_path / "bank.json"
    path.write_text(json.dumps({"version": 2, "runs": [], "ordinary": None}))
    with pytest.raises(InputError, match="says nothing of the sizes of effects in ordinary drives: calibrate again"):
        load_ordinary(path)


def test_no_bank_is_said(tmp_path):
    with pytest.raises(InputError, match="make it with `ddagr calibrate` from two drives or more, without --no-bank"):
        load_ordinary(tmp_path / "bank.json")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "is no bank of drives"),
        ("[]", "make it with `ddagr calibrate` from two drives or more, without --no-bank"),
        ('{"ordinary": {}}', "make it with `ddagr calibrate` from two drives or more, without --no-bank"),
        ('{"version": 1, "runs": []}', "has version 1, this program reads 3: calibrate again"),
        ('{"version": 3, "ordinary": {"weighing": {}}}', "is no bank of drives"),
    ],
)
def test_what_is_no_bank_is_refused(text, said, tmp_path):
    path = tmp_path / "bank.json"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        load_ordinary(path)


def test_weights_are_those_of_all_drives_and_a_channel_that_one_lacks_is_weighed_by_the_others():
    blank = replace(WEIGHING, sigma=np.ones(8), robust=np.ones(8))
    left = [
        Left(
            np.array([3.0, np.inf, *np.ones(6)]), np.full(8, 2.0), SensorBias("a", "sand", np.array([0.003, 0.1, 0.0]))
        ),
        Left(
            np.array([4.0, 2.0, *np.ones(6)]), np.full(8, 1.5), SensorBias("b", "sand", np.array([-0.004, 0.0, -0.1]))
        ),
    ]
    found = pooled(blank, left)
    assert found.sigma[0] == pytest.approx(np.sqrt(12.5))
    assert found.sigma[1] == 2.0
    assert found.robust.tolist() == [1.5] * 8
    assert found.gyro_bias == pytest.approx(0.007 / np.sqrt(2.0))
    assert found.accelerometer_bias == pytest.approx(np.sqrt(0.005))
    assert found.offsets.tolist() == pytest.approx([-0.0005, 0.05, -0.05])


def test_a_single_drive_says_nothing_of_what_sensors_always_read_too_much():
    left = [Left(np.ones(8), np.full(8, 2.0), SensorBias("a", "sand", np.array([0.003, 0.1, 0.0])))]
    found = pooled(replace(WEIGHING, sigma=np.ones(8), robust=np.ones(8)), left)
    assert found.offsets.tolist() == [0.0, 0.0, 0.0]
    assert found.gyro_bias == 0.003
