"""Which effects exist: every module of this folder that defines one, and those of other installed packages."""

from __future__ import annotations

import importlib
import pkgutil
from dataclasses import fields
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.physics.effects.base import Effect, build_effect

ENTRY_POINT_GROUP = "ddagr_gym.effects"


def _kinds_of_module(module: Any) -> list[type[Effect]]:
    found = [v for v in vars(module).values() if isinstance(v, type) and issubclass(v, Effect) and v is not Effect]
    return [kind for kind in found if kind.__module__ == module.__name__]


@cache
def effect_kinds() -> dict[str, type[Effect]]:
    """All effects by name: the library's own, then those of installed entry points.

    Raises:
        InputError: an entry point that is no effect, or takes a name that exists.
    """
    kinds: dict[str, type[Effect]] = {}
    package = __name__.rpartition(".")[0]
    for info in pkgutil.iter_modules([str(Path(__file__).parent)]):
        for kind in _kinds_of_module(importlib.import_module(f"{package}.{info.name}")):
            kinds[kind.name] = kind
    for entry in entry_points(group=ENTRY_POINT_GROUP):
        kind = entry.load()
        if not (isinstance(kind, type) and issubclass(kind, Effect)):
            raise InputError(f"entry point {entry.name!r} of {ENTRY_POINT_GROUP} is {kind!r}: give an Effect subclass.")
        if kind.name in kinds:
            raise InputError(f"entry point {entry.name!r} brings the effect {kind.name!r}, which exists: rename it.")
        kinds[kind.name] = kind
    return kinds


def absolute_effect_kinds(frames_apart: bool = False) -> dict[str, type[Effect]]:
    """Effects by name that a diagnosis against a nominal model looks for, without drives from before.

    Args:
        frames_apart: whether stretches of the drives have poses in frames of their own.
    """
    kinds = effect_kinds().items()
    return {
        name: kind for name, kind in kinds if not (kind.needs_earlier_drives or (frames_apart and kind.needs_one_frame))
    }


def effect_kind(name: object) -> type[Effect]:
    """Effect class by name; an unknown one raises InputError with the closest names."""
    kinds = effect_kinds()
    if not isinstance(name, str) or name not in kinds:
        raise unknown_name("effect", name, kinds)
    return kinds[name]


def parse_effect(text: str) -> Effect:
    """Effect from ``name``, ``name=size`` or ``name=size,other=value``, for example ``slope=0.06,direction=0.5``.

    Raises:
        InputError: unknown name or parameter, a parameter given twice, or a value that is no valid number.
    """
    head, *rest = text.split(",")
    name, _, first = head.partition("=")
    kind = effect_kind(name.strip())
    values: dict[str, object] = {}
    if first:
        values[fields(kind)[0].name] = first
    for item in rest:
        key, separator, value = (part.strip() for part in item.partition("="))
        if not separator:
            raise InputError(f"effect {text!r}: write {item.strip()!r} as parameter=value.")
        if key in values:
            raise InputError(f"effect {text!r} gives {key!r} twice: keep one of them.")
        values[key] = value
    return build_effect(kind, values)
