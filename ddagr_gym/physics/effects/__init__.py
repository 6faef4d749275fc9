"""The effect library: physics that the nominal model leaves out, by name.

Every module in this folder that defines an :class:`Effect` is found by itself; other packages add theirs through
the entry point group ``ddagr_gym.effects``.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterable
from dataclasses import fields
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import yaml

from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.physics.effects.base import Effect, build_effect, effect_table

__all__ = ["Effect", "effect_kinds", "effect_table", "load_effects", "parse_effect"]

ENTRY_POINT_GROUP = "ddagr_gym.effects"
_LARGEST_FILE = 1_000_000


def _kinds_of_module(module: Any) -> list[type[Effect]]:
    found = [v for v in vars(module).values() if isinstance(v, type) and issubclass(v, Effect) and v is not Effect]
    return [kind for kind in found if kind.__module__ == module.__name__]


@cache
def effect_kinds() -> dict[str, type[Effect]]:
    """All effects by name: the library's own, then those of installed entry points."""
    kinds: dict[str, type[Effect]] = {}
    for info in pkgutil.iter_modules(__path__):
        if info.name != "base":
            for kind in _kinds_of_module(importlib.import_module(f"{__name__}.{info.name}")):
                kinds[kind.name] = kind
    for entry in entry_points(group=ENTRY_POINT_GROUP):
        kind = entry.load()
        if not (isinstance(kind, type) and issubclass(kind, Effect)):
            raise InputError(f"entry point {entry.name!r} of {ENTRY_POINT_GROUP} is {kind!r}: give an Effect subclass.")
        kinds[kind.name] = kind
    return kinds


def _kind(name: object) -> type[Effect]:
    kinds = effect_kinds()
    if not isinstance(name, str) or name not in kinds:
        raise unknown_name("effect", name, kinds)
    return kinds[name]


def parse_effect(text: str) -> Effect:
    """Effect from ``name=size`` or ``name=size,other=value``, for example ``slope=0.06,direction=0.5``.

    Raises:
        InputError: unknown name or parameter, or a value that is no valid number.
    """
    head, *rest = text.split(",")
    name, _, first = head.partition("=")
    kind = _kind(name.strip())
    values: dict[str, object] = {}
    if first:
        values[fields(kind)[0].name] = first
    for item in rest:
        key, separator, value = item.partition("=")
        if not separator:
            raise InputError(f"effect {text!r}: write {item!r} as parameter=value.")
        values[key.strip()] = value
    return build_effect(kind, values)


def _read_file(path: Path) -> list[Effect]:
    if not path.is_file():
        raise InputError(f"effects file {str(path)!r} does not exist: give a YAML or JSON file, or name=size.")
    if path.stat().st_size > _LARGEST_FILE:
        raise InputError(f"effects file {str(path)!r} is larger than {_LARGEST_FILE} bytes: it is not an effects file.")
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise InputError(f"effects file {str(path)!r} is not valid YAML: {str(error).splitlines()[0]}.") from None
    items = content.get("effects") if isinstance(content, dict) else None
    if not isinstance(items, list):
        raise InputError(f"effects file {str(path)!r} has no list 'effects': see configs/effects/example.yaml.")
    return [_from_mapping(item, path) for item in items]


def _from_mapping(item: Any, path: Path) -> Effect:
    parameters = item.get("parameters") if isinstance(item, dict) else None
    if not isinstance(item, dict) or not isinstance(parameters, dict):
        raise InputError(f"effects file {str(path)!r} holds {item!r}: each effect needs 'name' and 'parameters'.")
    values = {k: v["value"] if isinstance(v, dict) and "value" in v else v for k, v in parameters.items()}
    return build_effect(_kind(item.get("name")), values)


def load_effects(specification: str | Path | Effect | Iterable[str | Effect]) -> tuple[Effect, ...]:
    """Effects from objects, ``name=size`` texts or an effects file (YAML or JSON, by its ending).

    Raises:
        InputError: anything that is not an effect, with the reason.
    """
    if isinstance(specification, Effect):
        return (specification,)
    if isinstance(specification, Path) or (
        isinstance(specification, str) and Path(specification).suffix in (".yaml", ".yml", ".json")
    ):
        return tuple(_read_file(Path(specification)))
    if isinstance(specification, str):
        return (parse_effect(specification),)
    loaded: list[Effect] = []
    for item in specification:
        loaded.extend(load_effects(item))
    return tuple(loaded)
