"""Configuration files: what is read, and every refusal as one sentence with file, place and value."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ddagr_gym import config
from ddagr_gym.config import config_names, configs_dir, dump_config, find_config, load_config, parse_config
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Numerics, Robot, Sensors, Soil, TorusWheel


class Side(enum.Enum):
    left = 1
    right = -1


@dataclass(frozen=True)
class Turn:
    radius: float
    side: Side = Side.left
    mode: Literal["fast", "slow"] = "slow"
    repeats: int = 1
    check: bool = False
    note: str | None = None
    window: tuple[float, float] = (0.0, 1.0)
    seeds: tuple[int, ...] = ()
    weights: Mapping[str, float] = field(default_factory=dict)
    track: Path | None = None


@dataclass(frozen=True)
class Plan:
    turns: tuple[Turn, ...]
    soil: Soil | None = None


def refusal(text: str, kind: type = Turn) -> str:
    with pytest.raises(InputError) as caught:
        parse_config(text, kind, source="turn.yaml")
    message = str(caught.value)
    assert message.startswith("turn.yaml")
    assert "\n" not in message
    return message


def test_every_kind_of_field():
    text = """
        radius: 1
        side: right
        mode: fast
        repeats: 3
        check: true
        note: first
        window: [-1e-3, 2.5E+1]
        seeds: [4, 5]
        weights: {exit: 1e2, slip: .5}
        track: beds/north.csv
    """
    expected = Turn(
        1.0,
        Side.right,
        "fast",
        3,
        True,
        "first",
        (-1e-3, 25.0),
        (4, 5),
        {"exit": 100.0, "slip": 0.5},
        Path("beds/north.csv"),
    )
    turn = parse_config(text, Turn)
    assert turn == expected
    assert isinstance(turn.radius, float)


def test_defaults_and_empty_files():
    assert parse_config("radius: 2.0", Turn) == Turn(2.0)
    assert parse_config("", Numerics) == Numerics()


def test_nested_dataclasses():
    soil = Soil(4140.0, 0.2269, 0.5, 13190.0, 692150.0, 0.006, 0.5, 0.5, 0.9)
    plan = Plan((Turn(0.8), Turn(1.2, seeds=(1,))), soil)
    assert parse_config(dump_config(plan), Plan) == plan


@pytest.mark.parametrize(
    ("text", "fragments"),
    [
        ("radius: 1\nradios: 2", ("'radios'", "did you mean 'radius'")),
        ("radius: 1\nzzz: 2", ("'zzz'", "known are radius, side")),
        ("side: left", ("radius missing",)),
        ("radius: wide", ("radius is 'wide'", "give a number")),
        ("radius: true", ("radius is True", "give a number")),
        ("radius:", ("radius is empty",)),
        ("radius: .nan", ("radius is nan", "finite")),
        ("radius: -.inf", ("radius is -inf", "finite")),
        ("radius: 1e400", ("finite",)),
        (f"radius: {'9' * 400}", ("finite",)),
        ("radius: 1\nrepeats: 1.5", ("repeats is 1.5", "whole number")),
        ("radius: 1\nrepeats: true", ("repeats is True", "whole number")),
        ("radius: 1\ncheck: 1", ("check is 1", "true or false")),
        ("radius: 1\nnote: 5", ("note is 5", "text")),
        ("radius: 1\nside: up", ("side is 'up'", "left, right")),
        ("radius: 1\nmode: medium", ("mode is 'medium'", "fast, slow")),
        ("radius: 1\nwindow: [1]", ("window has 1 values", "give 2")),
        ("radius: 1\nwindow: 1", ("window is 1", "list of 2 values")),
        ("radius: 1\nseeds: [1, x]", ("seeds[1] is 'x'", "whole number")),
        ("radius: 1\nweights: [1]", ("weights is [1]", "names with values")),
        ("radius: 1\nweights: {1: 2}", ("the key 1 is not text",)),
        ("radius: 1\nweights: {exit: .nan}", ("weights: exit is nan",)),
        ("- 1", ("is [1]", "fields of Turn")),
        ("radius: 1\nradius: 2", ("line 2", "'radius' is given twice")),
        ("radius: 1\nweights: {a: 1, a: 2}", ("line 2", "'a' is given twice")),
        ("radius: [1", ("line", "not valid YAML")),
        ("radius: 1\n\tside: left", ("line 2", "not valid YAML")),
        ("radius: \x07", ("not valid YAML",)),
        ("radius: &a 1\nnote: *a", ("line 1", "anchors and aliases")),
        ("radius: !!python/object/apply:os.system [ls]", ("not valid YAML",)),
        ("a: 1\n---\nb: 2", ("not valid YAML",)),
        ("radius: 2026-13-45", ("not valid YAML",)),
        ("[" * 5000, ("nested deeper than 50 levels",)),
    ],
)
def test_refusals(text, fragments):
    message = refusal(text)
    assert all(fragment in message for fragment in fragments), message


def test_refusal_in_a_nested_place_says_where():
    assert "turn.yaml: turns[1]: radius is 'x'" in refusal("turns: [{radius: 1}, {radius: x}]", Plan)


def test_validation_of_the_dataclass_is_kept():
    message = refusal("minor_radius: -0.1\nhalf_width: 0.1\nmajor_radius: 0.2", TorusWheel)
    assert "TorusWheel.minor_radius is -0.1" in message


def test_aliases_cannot_blow_up():
    levels = "\n".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 12))
    assert "anchors" in refusal(f"a0: &a0 [1]\n{levels}")


def test_unsupported_field_type_is_a_bug_not_bad_input():
    @dataclass(frozen=True)
    class Odd:
        value: complex

    with pytest.raises(TypeError, match="complex"):
        config._convert({"value": 1}, Odd, "odd")


finite = st.floats(allow_nan=False, allow_infinity=False)
turns = st.builds(
    Turn,
    radius=finite,
    side=st.sampled_from(Side),
    mode=st.sampled_from(["fast", "slow"]),
    repeats=st.integers(),
    check=st.booleans(),
    note=st.none() | st.text(),
    window=st.tuples(finite, finite),
    seeds=st.lists(st.integers(), max_size=3).map(tuple),
    weights=st.dictionaries(st.text(), finite, max_size=3),
    track=st.none() | st.just(Path("a b/c.csv")),
)


@given(turns)
def test_dump_and_parse_are_inverse(turn):
    assert parse_config(dump_config(turn), Turn) == turn


@given(st.text(max_size=80) | st.text(max_size=20).map(lambda text: f"radius: {text}"))
def test_any_text_is_read_or_refused_in_one_line(text):
    try:
        outcome = str(parse_config(text, Turn).radius)
    except InputError as error:
        outcome = str(error)
    assert outcome
    assert "\n" not in outcome


@pytest.mark.parametrize("kind", [Sensors, Numerics])
def test_package_defaults_survive_a_round_trip(kind):
    assert parse_config(dump_config(kind()), kind) == kind()


def test_presets_survive_a_round_trip():
    from ddagr_gym.presets import get_robot, get_soil, robot_names, soil_names

    for name in robot_names():
        assert parse_config(dump_config(get_robot(name)), Robot) == get_robot(name)
    for name in soil_names():
        assert parse_config(dump_config(get_soil(name)), Soil) == get_soil(name)


def test_files(tmp_path):
    file = tmp_path / "a b.yaml"
    file.write_text("radius: 0.8")
    assert load_config(file, Turn) == Turn(0.8)
    file.write_text("radius: x")
    with pytest.raises(InputError, match=r"a b\.yaml: radius is 'x'"):
        load_config(file, Turn)


def test_unreadable_files(tmp_path):
    file = tmp_path / "turn.yaml"
    with pytest.raises(InputError, match=r"turn\.yaml cannot be read: no such file"):
        load_config(file, Turn)
    with pytest.raises(InputError, match="is not a regular file"):
        load_config(tmp_path, Turn)
    file.write_bytes(b"radius: 1 # \xff")
    with pytest.raises(InputError, match="not UTF-8"):
        load_config(file, Turn)
    file.write_text("#" * (config.MAXIMUM_BYTES + 1))
    with pytest.raises(InputError, match="1000001 bytes"):
        load_config(file, Turn)


def test_configs_dir_is_the_checkouts(repository):
    assert configs_dir() == repository / "configs"
    for folder in ("robots", "soils", "sensors", "tasks", "training", "evaluation", "recordings"):
        assert (configs_dir() / folder / "README.md").read_text().startswith(f"# {folder}\n")


def test_configs_are_found_by_name_and_by_path(tmp_path, monkeypatch):
    (tmp_path / "soils").mkdir()
    (tmp_path / "tasks").mkdir()
    (tmp_path / "soils" / "clay.yaml").write_text("")
    monkeypatch.setattr(config, "configs_dir", lambda: tmp_path)
    assert config_names("soils") == ("clay",)
    assert find_config("soils", "clay") == tmp_path / "soils" / "clay.yaml"
    assert find_config("soils", tmp_path / "soils" / "clay.yaml") == tmp_path / "soils" / "clay.yaml"
    with pytest.raises(InputError, match="unknown configuration in configs/soils 'cley': did you mean 'clay'"):
        find_config("soils", "cley")
    with pytest.raises(InputError, match="configs/tasks is empty"):
        find_config("tasks", "turn")
    with pytest.raises(InputError, match=r"sand\.yaml: no such configuration file, give the path of one that exists"):
        find_config("soils", tmp_path / "sand.yaml")
