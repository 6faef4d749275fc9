"""``ddagr effects``: the library of missing physics."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tyro.conf import Positional

from ddagr_gym.commands.output import format_table

if TYPE_CHECKING:
    from ddagr_gym.physics.effects import Effect

EXAMPLES = (
    "ddagr effects",
    "ddagr effects slope",
    "ddagr effects --full",
)


@dataclass(frozen=True)
class Arguments:
    """List the effects that a simulation can add and a diagnosis can name, or explain one.

    Attributes:
        name: effect to explain; all of them are listed when it is left out.
        full: explain every effect.
    """

    name: Positional[str] = ""
    full: bool = False


def run(arguments: Arguments) -> None:
    """Print the effect's card, every card, or one line per effect and group."""
    from ddagr_gym.physics.effects import effect_kind, effect_kinds

    if arguments.name:
        print(_card(effect_kind(arguments.name)))
    elif arguments.full:
        print("\n\n".join(map(_card, effect_kinds().values())))
    else:
        print(_overview(list(effect_kinds().values())))


def _overview(kinds: list[type[Effect]]) -> str:
    """One table of all effects, the groups in the verdict's order."""
    from ddagr_gym.physics.effects import GROUPS

    rows = []
    for kind in sorted(kinds, key=lambda kind: GROUPS.index(kind.group)):
        main = kind.size_names()[0]
        item = kind.parameter(main).metadata
        bounds = (item["neutral"], item["low"], item["high"], _matters_from(item))
        rows.append((kind.group, kind.name, f"{main} [{item['unit']}]", *bounds, kind.description().split("\n")[0]))
    header = ("acts on", "effect", "size", "none at", "from", "to", "matters from", "what it is")
    return f"{format_table(header, rows)}\n\nEquation, signature and rivals of one: ddagr effects NAME"


def _card(kind: type[Effect]) -> str:
    """Everything about one effect."""
    from ddagr_gym.physics.layout import POINTS

    facts = {
        "acts on": f"{kind.group}, at {', '.join(POINTS[point] for point, _ in kind.actions)}",
        "equation": kind.equation,
        "source": kind.source,
        "signature": kind.signature,
        "confused with": ", ".join(kind.confused_with) or "nothing in the library",
        "derivative": "by every size, at neutral too" if kind.differentiable else "none at neutral",
    }
    names = (*kind.size_names(), *kind.shape_names())
    lines = [f"{kind.name}: {kind.title}", "", kind.description(), ""]
    lines += [f"{name:<14} {text}" for name, text in facts.items()]
    return "\n".join([*lines, "", "parameters", *(_parameter(kind, name) for name in names)])


def _matters_from(item: Mapping[str, float]) -> float:
    """Value of the size at which somebody begins to care, on the side where its step points."""
    return item["neutral"] + math.copysign(item["least"], item["step"])


def _parameter(kind: type[Effect], name: str) -> str:
    """A parameter's numbers and what it means, in two lines."""
    field = kind.parameter(name)
    item = field.metadata
    words = f"{item['low']:g} to {item['high']:g} {item['unit']}"
    if item["neutral"] is None:
        words += f", {field.default:g} unless given"
    else:
        words += f", no effect at {item['neutral']:g}, matters from {_matters_from(item):g}"
    return f"  {name:<20} {words}\n  {'':<20} {kind.meaning(name)}"
