"""The frozen scenario sets are those that were frozen once."""

import gzip
import json
import os
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.scenario_sets import (
    FOURTH,
    ON_PLANTS,
    ON_PLANTS_AGAIN,
    ON_PLANTS_FOURTH,
    PLANS,
    PLANT_COUNT,
    SECOND,
    THIRD,
)
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation import scenarios as scenario_module
from ddagr_gym.evaluation.scenarios import load_scenarios, scenario_folder, scenario_names, set_hash
from ddagr_gym.physics.soil_laws import LAW

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
    "V": "c79874aeb0f75d69fc7bab288a65a244eeea4af50defd8de7b0a0b95952a968a",
    "T": "00057621c05909b59c88a823ae743346b35edb6c2359a6b0b68d76537de6e717",
    "S1b": "e8716611c76fd4631eb06cfc2821aec44606fcc114e1ad165448be751d94d3f0",
    "S2b": "d5ae016fdcdbf6c650faf30eafa0edd6135221f953a579f1f5dd9566d99b6151",
    "S3b": "880eb13dd60f27e3fb157737a3509031e628a256f2255f2ad6fa80f65012fae4",
    "S4b": "9001c4711824f990347c139a0566dd679687bece9027ffc97dd3ab46988a2e72",
    "S5b": "cb70b9d78431610f1a33c0bf03834949b1d0843b05628b97f339f227f58bc9b1",
    "S6b": "b7498584b4256f35f94a97db0524f3a56d5f7c95b49e10777d25ad43905a26b8",
    "S7b": "e66923f14e846a9fc4c21831ffd64d5017e8d0dcfb5ea319336f95f75ad7e113",
    "S8b": "8601cece71ca32d766351dece042f8835e644525fb9dcf76f88152f6ab3085d5",
    "Tb": "9a827d926bc6fabfc9b3fe25d739c11f2c5be5fe17f19c298bd4492d30facf0a",
    "on_slope_3": "7d2546c9782e6a90e645ca98d15f17a30ea6509a35f5d486238b8d8674ccaf43",
    "on_slope_5": "cdd76432e0c7c4af0121234e87e0777ed29bce91ae140c231d3fbedcb879242e",
    "on_weaker": "df11b4b0792cd1188359db8755982873f43dcb036d9e97db6ac34a95ebb284f9",
    "on_lateral_0.8": "06ecab0c7d39e0e5067a35f0db01c41732196234385777159f8e6dcb867c4c3c",
    "on_lateral_1.2": "f6cfd7871f9cfb2fac954b01093eb9159c5ab44b8a9c483bf856da2b2fdbbb5b",
    "on_late": "1e5ac37e166ecc828887cdf28905d55c028488ed97b755c14cb2c88627ac96e7",
    "on_heavy": "a3317bf52aacc3f70f7b66c8a1296e2e4000339d1f58c6696ab97daa6e29d038",
    "on_ruts": "c6dc7676ae3f4568e1bc3d12c8855c70ea7a9c433d0d882191c312a41f17e006",
    "on_slip_sinkage": "535f250bf3988bc9fba1daf9f55417aef643e89a13dcbce3110eaca26df05b28",
    "on_bulldozing": "47efe4045ed5a4500064b5308daad96a74960d79a7f76db2ba345345eda753d5",
    "on_payload": "addb9e23c3fe52a3be4496f8bf62782eb369fb2e2c6712f43703ea21398a82b7",
    "on_slow": "daf5cc069d2cc4c8835f4e3e14e865bb2b4c5a5896b5142bca36cccb1b1f4ff2",
    "on_weak_motors": "3814cc9dec4343c78a1e9b8febb262d9e5a79a37c6d13e63b4a75f762566ccb3",
    "on_split": "bb724075c3b00dc5a22a563352c7826df0dadc7630482af63a858954c6f7db90",
    "on_patch": "6d9345b6f3db4832715554646f300f9ba4e4c266107a9e73ea4de743f3ecc0b1",
    "S1c": "b2e2431ac89f46ad235eafa6c5bebf03b02c27bbff7653323baf0928cac6f8df",
    "S2c": "ea5ffdf5fdb11c1553a3531d781745e6e9835f97a70927ea387302dfc0d5a4f5",
    "S3c": "e07e9cf3dba6d2848625fb7e8f9347b8731517d6fd5cd44320ab4c952aa90df4",
    "S4c": "fbe204a46a0a14076f6dfa96da85cda221d4d49fa61b2fca7de60385907257c3",
    "S5c": "3b8bcd88c49fbe46faecce510a0efe5a41cd4818484d34e06c0b5b0f3402f0a5",
    "S6c": "90c49a042fa1aabfd1c1c3506d7d9cc571f59dd590fae22a80e8b025ec44496c",
    "S7c": "44f505d017f9c6ac8746a94e7ab90bcc2c01a9626a97f1ca2111b893941a1b13",
    "S8c": "a7b15727f4ee87c9c6dfa4f330b4d57719944d69e83572bf93c19a9ef1c48039",
    "Tc": "a505b61083fab3c838045c12769089eae4fc94c37710eb5a4bcb6cca9c4717e4",
    "on_slope_3_c": "f3cd418ec5e9a22d234c80c688bcac41319c67bb5b4bd8d873a32d3ec1dfb46f",
    "on_slope_5_c": "11a2334af961864652426bd0b6c16e6d50539cb03d6e426efbba9688d5b14aa8",
    "on_weaker_c": "927c23c5479883a6d9b981dfb488dcaec257488408f20f073b1daecbb7dffdf3",
    "on_lateral_0.8_c": "5d76b6cedf6372fb3665a463407c97715a0a55127fa9a720a585e5888b51fd17",
    "on_lateral_1.2_c": "2107eae8d26f1ddd5227378dd91f618fc8f5be082acfd6e2a42db2df731d8022",
    "on_late_c": "6e00868766dd77b564e5df81155ea8d9dd32790fdab5939eeba43e5705554569",
    "on_heavy_c": "322bf34ec9d964345037c646bc72e21a268cdd39ab97eeeaf29ace30b0f42a16",
    "on_ruts_c": "af27c3395f6fe3be57d65c2b18dc6fd422b8205e26013e2f5e6d7d5f79bfd189",
    "on_slip_sinkage_c": "d2027f7c207162da6aaf481930a0c6a47a601746a67cb5e6469a34dd53af3b40",
    "on_bulldozing_c": "cd8d49f0981355cd6d40eb25a0defebcb0d61f7076eb0d476583ddebfaffaf59",
    "on_payload_c": "36d7ca924c75dd1e1ab14c31f9857debf04015ff373acb14815b7776d93a9a24",
    "on_slow_c": "fde279ec1f57bb0b23815e4c58ab7f3a82091bdebde667c97f9fbea05140d99a",
    "on_weak_motors_c": "788f0dfeb257ad75b6700de96f583c4b8f029708796f4ab40b85245fb07fdb7f",
    "on_split_c": "fe0d37483fc958cf9b2d859cf3ca4d9e7a84a61be7aa2a550a1a3745f4b6f983",
    "on_patch_c": "f15a24d4c7f27ddff0cd8c640cb99489774aba2198098ca14c1d930a7db2df2b",
    "S1d": "c13761845fd56ca89dab5a278bf4216b50aace5e05757e8546af77449b7c7a40",
    "S2d": "d4f336966ab80296791ed7005a091b49dbda098ea1169a0bc40bdc77df6da0bf",
    "S3d": "3ceb89d34d9a3765402a0344a911ea81776bb62e579379f56ad0eea8a4314728",
    "S4d": "e40470f42e0f86f9a66f9910e530b70eb1879253da82fb077afcd83a1e34a929",
    "S5d": "a264d5a38199e403e5b0d752729038991ec8c48da75c30919b4d57093860e130",
    "S6d": "0ba9a1927a168ad13bc8f882b7cfbf9bf2510ea327cfaee3f0e3d765c2be0a6d",
    "S7d": "b4d7c256397a1141382ededc4b1cab5730444569f2166f14197db215c02ee638",
    "S8d": "abadae62a3529a07e2e2fc368e8638f0d7bb0c02448e719e27e32de31d15aced",
    "Td": "9877189ffdb98331e2c942c51ed28053a2d962b9c778eda000f84512946f2a59",
    "on_slope_3_d": "8ca65580f8a058513b8058f20db115145b334a0a48e9ea1230a9c75f7bdeaafb",
    "on_slope_5_d": "817bdba07451eb6e6ca7306c5a1908ed8e10c7d706a8f4aabe0edd4d21ea6cc6",
    "on_weaker_d": "aa6de18b7663e72ab6d7f1130d9a985afaf07ad058c08e66f3e72dbd39a0fa5c",
    "on_lateral_0.8_d": "6eeca872d08e35e4968b8619d4f387b3133ee3400f5d1d4156d2366a8dd742c7",
    "on_lateral_1.2_d": "dabe7bf050e1c1b2a705f7ba5f118400b869a8f3d78f2685d68ee919aba42357",
    "on_late_d": "6b10b3959a5bd622698f47db1019a1df518774b53e012f5d3e2e4bbc6cefe4ef",
    "on_heavy_d": "fc16c94239ac95c00274a2198bb8a8d158981d7214158e628d668753aa1a8c10",
    "on_ruts_d": "e655fc838d4fa4e2cd27eddf6b9c0621b3ac960c4476fe19a09d61ed8ce95df5",
    "on_slip_sinkage_d": "2c47dcb5beb84bbdca114557b225c77b00306a1e7341f3724fc197be58c831c0",
    "on_bulldozing_d": "f04868d0ef6f3989fc4ba2cef014c83d19b6e2d1f413c85557e98d8dcfd5d4a5",
    "on_payload_d": "e86b6149feb79adb7112c1a20876977f808ad854d297078ce03934b5eb40d520",
    "on_slow_d": "898e1442539349983e27d2d57e3d11fee6c447b876cfcef7f10f050ee11f27fc",
    "on_weak_motors_d": "673f0cdbb643ebbd7fb8343bb2a6790e7f9da751b60d031ba0c850599e84fc5a",
    "on_split_d": "2b870b808df0e99629a6e70c2ba46bec72bfe99cf56ad805a0f692b6eb2da23d",
    "on_patch_d": "69b815745f629eda1c43d81e105bad958d554da14dd6cfb4ff7cb2f8cd000d93",
}
"""SHA-256 of every set on the day it was frozen; no change of a set is ever right."""


def test_all_sets_are_there():
    assert scenario_names() == tuple(sorted(FROZEN))
    assert set(FROZEN) == set(PLANS)


@pytest.mark.parametrize("name", FROZEN)
def test_set_is_the_one_that_was_frozen(name):
    assert set_hash(name) == FROZEN[name]
    scenarios = load_scenarios(name)  # checks the soil grids
    assert len(scenarios) == PLANS[name].count
    assert {scenario.law for scenario in scenarios} == {PLANS[name].law}
    assert (PLANS[name].law == LAW) == (name in ("T", "Tb", "Tc", "Td"))


def test_files_are_small():
    assert sum(path.stat().st_size for path in scenario_folder().iterdir()) < 1_700_000


def test_validation_shares_nothing_with_the_test_sets():
    mine = {scenario.episode.soils for scenario in load_scenarios("V")}
    seeds = {scenario.seed for scenario in load_scenarios("V")}
    for name in set(FROZEN) - {"V", "S0"}:
        others = load_scenarios(name)
        assert not mine & {scenario.episode.soils for scenario in others}
        assert not seeds & {scenario.seed for scenario in others}


@pytest.mark.parametrize("drawing", ["", "b", "c", "d"])
def test_transfer_drives_the_turns_of_s1(drawing):
    for other, first in zip(load_scenarios(f"T{drawing}"), load_scenarios(f"S1{drawing}"), strict=False):
        assert other.seed == first.seed
        assert other.episode.soils == first.episode.soils
        np.testing.assert_array_equal(other.episode.field.values, first.episode.field.values)


@pytest.mark.parametrize(("name", "in_range"), [*((name, "S1b") for name in ON_PLANTS),
                                              *((name, "S1c") for name in ON_PLANTS_AGAIN),
                                              *((name, "S1d") for name in ON_PLANTS_FOURTH)])  # fmt: skip
def test_plants_are_driven_by_the_turns_in_range(name, in_range):
    """Same soils, starts and noise on every plant, and something that differs."""
    pairs = list(zip(load_scenarios(name), load_scenarios(in_range), strict=False))
    assert len(pairs) == PLANT_COUNT
    for other, first in pairs:
        assert other.seed == first.seed
        assert other.episode.soils == first.episode.soils
        assert other.episode.lateral_offset == first.episode.lateral_offset
        changed = replace(other, set_name=first.set_name, episode=first.episode)
        assert (
            changed != first
            or other.episode.robot != first.episode.robot
            or (other.episode.command_delay != first.episode.command_delay)
        )


@pytest.mark.parametrize("name", [*SECOND, *THIRD, *FOURTH])
def test_a_later_drawing_shares_nothing_with_the_others(name):
    seeds = {scenario.seed for scenario in load_scenarios(name)}
    for drawing in {"", "b", "c", "d"} - {name[-1]}:
        assert not seeds & {scenario.seed for scenario in load_scenarios(name[:-1] + drawing)}


@pytest.mark.parametrize("name", ["S7", "S7b", "S7c"])
def test_pairs_of_s7_are_mirror_images(name):
    scenarios = load_scenarios(name)
    for left, right in zip(scenarios[::2], scenarios[1::2], strict=True):
        assert (left.episode.turn.side, right.episode.turn.side) == ("left", "right")
        assert left.episode.soils == right.episode.soils
        mine, other = left.episode.sensors.imu, right.episode.sensors.imu
        assert mine.gyro_bias == -other.gyro_bias
        assert mine.accelerometer_bias[0] == other.accelerometer_bias[0]
        assert mine.accelerometer_bias[1] == -other.accelerometer_bias[1]


@pytest.mark.parametrize("drawing", ["", "b", "c", "d"])
def test_s6_and_s8_leave_the_training_range(drawing):
    assert {scenario.episode.robot.motor_rate for scenario in load_scenarios(f"S6{drawing}")} == {1.4}
    radii = [scenario.episode.turn.radius for scenario in load_scenarios(f"S8{drawing}")]
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
