"""``ddagr effects``: the table, one card, all cards."""

from __future__ import annotations

import pytest

from ddagr_gym import cli
from ddagr_gym.physics.effects import GROUPS, effect_kinds


def printed(capsys, *words: str) -> str:
    assert cli.main(("effects", *words)) == 0
    return capsys.readouterr().out


def test_table_holds_every_effect_under_its_group_in_order(capsys):
    lines = printed(capsys).splitlines()[2:-2]
    assert len(lines) == len(effect_kinds())
    order = [next(i for i, group in enumerate(GROUPS) if line.startswith(group)) for line in lines]
    assert order == sorted(order)
    for name, kind in effect_kinds().items():
        (line,) = (line for line in lines if f"  {name} " in line)
        main = kind.size_names()[0]
        assert f"{main} [{kind.parameter(main).metadata['unit']}]" in line
        assert line.endswith(kind.description().split("\n")[0])


def test_table_says_where_a_size_begins_to_matter(capsys):
    numbers = {}
    for line in printed(capsys).splitlines()[2:-2]:
        name = next(name for name in effect_kinds() if f"  {name} " in line)
        numbers[name] = line.split("]")[1].split()[:4]
    assert numbers["gyro_scale"] == ["1", "0.1", "10", "1.01"]
    assert numbers["slope"] == ["0", "-0.6", "0.6", "0.0087"]
    assert numbers["motor_saturation"] == ["1000", "0.01", "1000", "20"]


@pytest.mark.parametrize("name", effect_kinds())
def test_card_says_everything_about_an_effect(capsys, name):
    card = printed(capsys, name)
    kind = effect_kinds()[name]
    assert card.startswith(f"{name}: {kind.title}\n")
    for text in (kind.equation, kind.source, kind.signature, *kind.confused_with):
        assert text in card
    for parameter in (*kind.size_names(), *kind.shape_names()):
        item = kind.parameter(parameter).metadata
        assert f"  {parameter} " in card
        assert f"{item['low']:g} to {item['high']:g} {item['unit']}" in card
        assert kind.meaning(parameter) in card


def test_full_prints_every_card(capsys):
    cards = printed(capsys, "--full")
    for name, kind in effect_kinds().items():
        assert f"{name}: {kind.title}\n" in cards


def test_unknown_effect_is_refused_with_the_closest_names(capsys):
    assert cli.main(("effects", "slop")) == 2
    assert "'slope'" in capsys.readouterr().err
