"""Pages of the reference that are written from the package: the commands, the effects, the robots and soils."""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Callable, Sequence
from typing import Any

import ddagr_gym
from ddagr_gym import commands
from ddagr_gym.physics.effects import GROUPS, Effect, effect_kinds
from ddagr_gym.presets import get_robot, get_soil, robot_names, soil_names


def commands_page() -> str:
    """Every command with its options, their defaults and its examples."""
    loaded = [commands.load(name) for name in commands.NAMES]
    overview = _table(("command", "what it does"), [(f"[`{c.name}`](#{c.name})", c.summary) for c in loaded])
    intro = "`./ddagr COMMAND --help` prints the same. Exit codes: 0 done, 1 the command found something wrong, "
    intro += "2 bad input (one sentence says what and how to mend it), 130 interrupted."
    return "\n\n".join(["# Commands", intro, overview, *map(_command, loaded)]) + "\n"


def _command(command: commands.Command) -> str:
    text, meanings = _described(command.arguments)
    rows = [
        (_option(item), _default(item), _plain(meanings.get(item.name, "")))
        for item in dataclasses.fields(command.arguments)
    ]
    options = [_table(("option", "default", "meaning"), rows)] if rows else []
    examples = "\n".join(f"./{example}" for example in command.examples)
    return "\n\n".join([f"## {command.name}", _plain(text), *options, f"```sh\n{examples}\n```"])


def _described(kind: type[Any]) -> tuple[str, dict[str, str]]:
    """Docstring of a dataclass before its attributes, and the meaning of each of them."""
    text, _, attributes = inspect.cleandoc(kind.__doc__ or "").partition("\nAttributes:\n")
    found = re.findall(r"^    (\w+): (.*(?:\n {5,}.*)*)", attributes, re.MULTILINE)
    return text.strip(), {name: " ".join(meaning.split()) for name, meaning in found}


def _option(item: dataclasses.Field[Any]) -> str:
    if "Positional" in str(item.type):
        return f"`{item.name.upper()}`"
    return f"`--{item.name.replace('_', '-')}`"


def _default(item: dataclasses.Field[Any]) -> str:
    if item.default is dataclasses.MISSING:
        return "required"
    shown = " ".join(map(str, item.default)) if isinstance(item.default, tuple) else str(item.default)
    return f"`{shown}`" if shown and item.default is not None else ""


def functions_page() -> str:
    """The functions of `import ddagr_gym` and what they return."""
    public = [getattr(ddagr_gym, name) for name in ddagr_gym.__all__ if not name.startswith("_")]
    functions = [item for item in public if inspect.isfunction(item)]
    classes = [item for item in public if inspect.isclass(item)]
    intro = (
        "What `import ddagr_gym` offers beside the environments. Each function does what the command of its name does "
    )
    intro += "and returns a typed result, which prints as the command does and shows as a table in a notebook."
    entries = [_entry(item) for item in (*functions, *classes)]
    return "\n\n".join(["# Python functions", intro, *entries]) + "\n"


def _entry(item: Any) -> str:
    """A function or class under the name by which it is imported."""
    options = f"    options:\n      heading: ddagr_gym.{item.__name__}\n      toc_label: {item.__name__}"
    return f"::: {item.__module__}.{item.__name__}\n{options}"


def effects_page() -> str:
    """The effect library, one section an effect."""
    kinds = sorted(effect_kinds().values(), key=lambda kind: GROUPS.index(kind.group))
    rows = [(kind.group, f"[`{kind.name}`](#{kind.name})", kind.title) for kind in kinds]
    intro = (
        "Each effect is a piece of physics that the nominal simulator leaves out. The simulator, the environment and"
    )
    intro += " the training can add it, and a diagnosis can name it. `./ddagr effects NAME` prints one of them."
    overview = _table(("acts on", "effect", "what it is"), rows)
    return "\n\n".join(["# Effect library", intro, overview, *map(_effect, kinds)]) + "\n"


def _effect(kind: type[Effect]) -> str:
    rows = []
    for name in (*kind.size_names(), *kind.shape_names()):
        item = kind.parameter(name).metadata
        least = f"{item['least']:g}" if item["neutral"] is not None else ""
        rows.append((f"`{name}`", item["unit"], f"{item['low']:g} to {item['high']:g}", least, kind.meaning(name)))
    rivals = ", ".join(f"[`{n}`](#{n})" for n in kind.confused_with) or "nothing in the library"
    facts = [
        f"Equation: `{kind.equation}`",
        f"Source: {kind.source}",
        f"Trace in the recordings: {kind.signature}",
        f"May be confused with: {rivals}",
    ]
    head = ("parameter", "unit", "range", "matters from", "meaning")
    lines = "\n".join(f"- {fact}" for fact in facts)
    return "\n\n".join([f"## {kind.name}", _plain(kind.description()), lines, _table(head, rows) if rows else ""])


def presets_page() -> str:
    """Robots and soils that are built in."""
    robots = [
        (f"`{n}`", f"{r.mass:g}", f"{2 * r.half_wheelbase:g}", f"{2 * r.half_track:g}", r.source)
        for n, r in ((name, get_robot(name)) for name in robot_names())
    ]
    soils = [
        (
            f"`{n}`",
            f"{s.cohesion / 1e3:g}",
            f"{s.friction_angle:.3g}",
            f"{s.sinkage_exponent:g}",
            f"{s.shear_modulus:g}",
        )
        for n, s in ((name, get_soil(name)) for name in soil_names())
    ]
    return "\n\n".join(
        [
            "# Robots and soils",
            "`./ddagr robots NAME` and `./ddagr soils NAME` print all parameters of one.",
            "## Robots",
            _table(("robot", "mass [kg]", "wheelbase [m]", "track [m]", "source"), robots),
            "## Soils",
            _table(("soil", "cohesion [kPa]", "friction angle [rad]", "sinkage exponent", "shear modulus [m]"), soils),
        ]
    )


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def _plain(text: str) -> str:
    """Docstring text as Markdown: what looks like an HTML tag is none."""
    return re.sub(r"``([^`]+)``", r"`\1`", text).replace("<", "&lt;")


GENERATED: dict[str, Callable[[], str]] = {
    "reference/api.md": functions_page,
    "reference/commands.md": commands_page,
    "reference/effect-library.md": effects_page,
    "reference/presets.md": presets_page,
}
"""Pages by their place in the site."""
