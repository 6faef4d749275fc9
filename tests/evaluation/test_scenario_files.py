"""The frozen scenario sets are those that were frozen once."""

import gzip
import json
import os

import numpy as np
import pytest

from benchmarks.scenario_sets import PLANS
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation import scenarios as scenario_module
from ddagr_gym.evaluation.scenarios import load_scenarios, scenario_folder, scenario_names, set_hash
from ddagr_gym.physics.soil_laws import LAW, NOMINAL_LAW

FROZEN = {
    "S0": "ad22ca6c05158da86a53f51f3a0dc9c72da30b66cec531b42c34fccb61f21aeb",
    "S1": "a03c73806da02731af1f64a5b4fadc34e8652f09ec19f613a08083d1eac4717f",
    "S2": "488de803e46a34bc512be91facd99dc58d72ff86cff249dc998936731aa61c0d",
    "S3": "d96e54dbc759db81ced45951acdbcfaf493a30a131a192978246deb182ba7202",
    "S4": "eccdbe3c9f674b1c3929f2299f58b00899bf7d76ff68fc1f99962cad2a94da45",
    "S5": "8e5e5ba6c8a83b095bba03e5a459d127d1fbdf8e5d7d68997554b75e0b5ce70f",
    "S6": "a8f674f43be8c6887d6700e94bd7021ba59f7a1189c6570ed5f947514784615d",
    "S7": "714da2b52c4b880fbba6338d99d9cd1250492b1b0a7280d2cb621bc781a766cb",
    "S8": "0d0293cbfbd00226efc645d31d9690d1bdd5bcba4088637f889fa0af01e2671e",
    "T": "00057621c05909b59c88a823ae743346b35edb6c2359a6b0b68d76537de6e717",
    "V": "c79874aeb0f75d69fc7bab288a65a244eeea4af50defd8de7b0a0b95952a968a",
}
"""SHA-256 of every set on the day it was frozen; no change of a set is ever right."""


def test_all_sets_are_there():
    assert scenario_names() == tuple(FROZEN)
    assert set(FROZEN) == set(PLANS)


@pytest.mark.parametrize("name", FROZEN)
def test_set_is_the_one_that_was_frozen(name):
    assert set_hash(name) == FROZEN[name]
    scenarios = load_scenarios(name)  # checks the soil grids
    assert len(scenarios) == PLANS[name].count
    assert {scenario.law for scenario in scenarios} == {LAW if name == "T" else NOMINAL_LAW}


def test_files_are_small():
    assert sum(path.stat().st_size for path in scenario_folder().iterdir()) < 500_000


def test_validation_shares_nothing_with_the_test_sets():
    mine = {scenario.episode.soils for scenario in load_scenarios("V")}
    seeds = {scenario.seed for scenario in load_scenarios("V")}
    for name in set(FROZEN) - {"V", "S0"}:
        others = load_scenarios(name)
        assert not mine & {scenario.episode.soils for scenario in others}
        assert not seeds & {scenario.seed for scenario in others}


def test_transfer_drives_the_turns_of_s1():
    for other, first in zip(load_scenarios("T"), load_scenarios("S1"), strict=False):
        assert other.seed == first.seed
        assert other.episode.soils == first.episode.soils
        np.testing.assert_array_equal(other.episode.field.values, first.episode.field.values)


def test_pairs_of_s7_are_mirror_images():
    scenarios = load_scenarios("S7")
    for left, right in zip(scenarios[::2], scenarios[1::2], strict=True):
        assert (left.episode.turn.side, right.episode.turn.side) == ("left", "right")
        assert left.episode.soils == right.episode.soils
        mine, other = left.episode.sensors.imu, right.episode.sensors.imu
        assert mine.gyro_bias == -other.gyro_bias
        assert mine.accelerometer_bias[0] == other.accelerometer_bias[0]
        assert mine.accelerometer_bias[1] == -other.accelerometer_bias[1]


def test_s6_and_s8_leave_the_training_range():
    assert {scenario.episode.robot.motor_rate for scenario in load_scenarios("S6")} == {1.4}
    radii = [scenario.episode.turn.radius for scenario in load_scenarios("S8")]
    assert min(radii) >= 0.65
    assert max(radii) <= 1.2
    assert np.ptp(radii) > 0.4


@pytest.fixture
def copied(tmp_path, monkeypatch):
    """The file of S0 in a folder of its own, as a function that rewrites it."""
    target = tmp_path / "S0.json.gz"
    content = json.loads(gzip.decompress((scenario_folder() / "S0.json.gz").read_bytes()))
    monkeypatch.setattr(scenario_module, "scenario_folder", lambda: tmp_path)

    def rewrite(change):
        change(content)
        target.write_bytes(gzip.compress(json.dumps(content).encode()))
        return target

    return rewrite


def test_a_changed_value_is_refused(copied):
    def change(content):
        content["scenarios"][1]["soil"]["cohesion"] *= 1.0000001

    copied(change)
    with pytest.raises(InputError, match="hash"):
        load_scenarios("S0")


def test_another_law_is_refused(copied):
    copied(lambda content: content.update(law=LAW))
    with pytest.raises(InputError, match="hash"):
        load_scenarios("S0")


def test_another_grid_is_refused(copied):
    def change(content):
        content["scenarios"][0]["grid_sum"] = 1.0
        content["sha256"] = scenario_module._fingerprint(content["law"], content["scenarios"])

    copied(change)
    with pytest.raises(InputError, match="soil grid"):
        load_scenarios("S0")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"\x1f\x8bnothing at all", "nknown compression method"),
        (b"{}", "Not a gzipped file"),
        (gzip.compress(b"{}")[:10], "ended before"),
        (gzip.compress(b"{"), "Expecting property name"),
        (gzip.compress(b"[]"), "it holds no mapping"),
        (gzip.compress(b"[" * 100_000), "it is nested too deeply"),
        (gzip.compress(b" " * 60_000_000), "it holds more than 50000000 bytes"),
        (gzip.compress(b'{"format": 1, "description": "", "scenarios": []}'), "it lacks 'law'"),
    ],
    # gzip writes the time of packing, which is not for a name
    ids=["damaged", "not packed", "cut off", "no JSON", "no mapping", "too deep", "too large", "incomplete"],
)
def test_a_broken_file_is_one_sentence(copied, content, reason):
    copied(lambda content: None).write_bytes(content)
    with pytest.raises(InputError, match=f"not a scenario set .*{reason}.*: restore the file"):
        load_scenarios("S0")


def test_a_pipe_is_never_opened(copied):
    path = copied(lambda content: None)
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(InputError, match=r"not a scenario set .it is not a regular file.: restore the file"):
        load_scenarios("S0")
