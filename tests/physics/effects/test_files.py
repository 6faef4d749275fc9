"""Effects files: what is written is read back, and nothing bad gets in."""

from __future__ import annotations

import json

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym.errors import InputError
from ddagr_gym.physics.effects import (
    effect_kinds,
    load_effects,
    load_intervals,
    parse_effect,
    read_effects_file,
    save_effects,
)
from ddagr_gym.physics.effects.gyro_sign import GyroSign
from ddagr_gym.physics.effects.slope import Slope

EVERYTHING = tuple(kind.neutral() for kind in effect_kinds().values())


@pytest.mark.parametrize("ending", [".yaml", ".yml", ".json"])
def test_every_effect_is_read_back_equal(tmp_path, ending):
    file = tmp_path / f"effects{ending}"
    save_effects(file, EVERYTHING)
    assert load_effects(file) == load_effects(str(file)) == EVERYTHING
    assert [path.name for path in tmp_path.iterdir()] == [file.name]


@given(angle=st.floats(-0.6, 0.6), direction=st.floats(-7.0, 7.0))
def test_values_are_read_back_to_the_bit(tmp_path_factory, angle, direction):
    for ending in ("yaml", "json"):
        file = tmp_path_factory.mktemp("effects") / f"effects.{ending}"
        save_effects(file, [Slope(angle, direction)])
        assert load_effects(file) == (Slope(angle, direction),)


def test_intervals_hash_and_source_are_kept(tmp_path):
    file = tmp_path / "found.json"
    save_effects(
        file,
        [Slope(0.06, 0.5), GyroSign()],
        intervals=[{"angle": (0.05, 0.07)}, {}],
        data_hash="9f86d0",
        source="drive 1",
    )
    content = json.loads(file.read_text())
    assert content["effects"][0]["parameters"]["angle"] == {"value": 0.06, "unit": "rad", "interval": [0.05, 0.07]}
    assert content["effects"][0]["parameters"]["direction"] == {"value": 0.5, "unit": "rad"}
    read = read_effects_file(file)
    assert (read.data_hash, read.source, read.version) == ("9f86d0", "drive 1", 1)
    assert read.effects[0].parameters["angle"].interval == (0.05, 0.07)


def test_example_in_the_configurations_loads(repository):
    loaded = load_effects(repository / "configs" / "effects" / "example.yaml")
    assert [effect.name for effect in loaded] == ["slope", "motor_lag", "gyro_sign"]


def test_objects_texts_and_files_mix(tmp_path):
    file = tmp_path / "one.yaml"
    save_effects(file, [Slope(0.06, 0.5)])
    assert load_effects(Slope(0.1)) == (Slope(0.1),)
    assert load_effects("motor_lag=0.1") == (parse_effect("motor_lag=0.1"),)
    assert load_effects([Slope(0.1), "motor_lag=0.1", str(file)]) == (
        Slope(0.1), parse_effect("motor_lag=0.1"), Slope(0.06, 0.5),
    )  # fmt: skip
    assert load_effects([]) == ()


def written(tmp_path, content):
    file = tmp_path / "bad.yaml"
    file.write_text(content if isinstance(content, str) else yaml.safe_dump(content))
    return file


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ({"effects": [{"name": "slop"}]}, "unknown effect 'slop'"),
        ({"effects": [{"name": "slope", "parameters": {"angel": 0.1}}]}, "no parameter 'angel'"),
        ({"effects": [{"name": "slope"}]}, "effect 'slope' needs 'angle'"),
        ({"effects": [{"name": "slope", "parameters": {"angle": 9.0}}]}, "Slope.angle is 9"),
        ({"effects": [{"name": "slope", "parameters": {"angle": {"value": 3.7, "unit": "deg"}}}]}, "give it in rad"),
        ({"effects": [{"name": "slope", "parameters": {"angle": "steep"}}]}, "angle"),
        ({"effects": [], "version": 2}, "version 2: this program reads version 1"),
        ({"effects": [], "extra": 1}, "unknown key 'extra'"),
        ({}, "effects missing"),
        ([1, 2], "give the fields of EffectsFile"),
        ("effects: [", "not valid YAML"),
        ("effects: !!python/object/apply:os.getcwd []", "not valid YAML"),
        ("effects: &a [*a]", "anchors"),
    ],
)  # fmt: skip
def test_bad_files_are_refused_in_one_sentence(tmp_path, content, sentence):
    with pytest.raises(InputError, match=sentence) as refusal:
        load_effects(written(tmp_path, content))
    assert str(refusal.value).count("bad.yaml") == 1


def test_missing_file_is_refused():
    with pytest.raises(InputError, match="does not exist"):
        load_effects("nowhere.yaml")


@pytest.mark.parametrize("value", [None, 3, 1.5])
def test_what_is_no_effect_is_refused(value):
    with pytest.raises(InputError, match="effects are"):
        load_effects(value)


def test_failed_write_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    file = tmp_path / "effects.yaml"
    save_effects(file, [Slope(0.1)])
    before = file.read_bytes()
    monkeypatch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        save_effects(file, [Slope(0.2)])
    assert file.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == [file.name]


@pytest.mark.parametrize(
    ("name", "options", "sentence"),
    [
        ("effects.txt", {}, r"ends in '.txt': end it in .yaml, .yml, .json"),
        ("effects.yaml", {"intervals": [{}, {}]}, "2 sets of intervals for 1 effects"),
        ("effects.yaml", {"intervals": [{"angle": (0, float("nan"))}]}, "give a finite low and high"),
        (
            "effects.yaml",
            {"intervals": [{"slope": (0, 1)}]},
            "interval for 'slope', which effect 'slope' does not have",
        ),
    ],
)
def test_bad_requests_to_write_are_refused(tmp_path, name, options, sentence):
    with pytest.raises(InputError, match=sentence):
        save_effects(tmp_path / name, [Slope(0.1)], **options)
    assert list(tmp_path.iterdir()) == []


def test_intervals_are_read_by_effect_and_are_empty_where_nothing_was_estimated(tmp_path):
    file = tmp_path / "found.yaml"
    save_effects(file, [Slope(0.06, 0.5), GyroSign()], intervals=[{"angle": (0.05, 0.07)}, {}])
    assert load_intervals(file) == ({"angle": (0.05, 0.07)}, {})
