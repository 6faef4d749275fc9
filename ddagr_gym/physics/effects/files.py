"""Effects files: what a diagnosis found, for ``gym.make``, the simulator and replay to load.

::

    version: 1
    source: diagnosis of drives 1 to 3           # for people
    data_hash: 9f86d081884c7d65...               # of the recordings that the values were fitted to
    effects:
      - name: slope
        parameters:
          angle: {value: 0.065, unit: rad, interval: [0.060, 0.069]}
          direction: 0.56                        # a number alone will do
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import yaml

from ddagr_gym.config import config_from, load_config
from ddagr_gym.errors import InputError
from ddagr_gym.files import atomic_path, expanded
from ddagr_gym.physics.effects.base import Effect, build_effect
from ddagr_gym.physics.effects.registry import effect_kind, parse_effect

VERSION = 1
_ENDINGS = (".yaml", ".yml", ".json")
Intervals = Sequence[Mapping[str, tuple[float, float]]]


@dataclass(frozen=True)
class ParameterEntry:
    """A parameter with what is known about it.

    Attributes:
        value: in ``unit``.
        unit: must be the parameter's own.
        interval: low and high, where the value was estimated.
    """

    value: float
    unit: str = ""
    interval: tuple[float, float] | None = None


@dataclass(frozen=True)
class EffectEntry:
    """One effect of a file.

    Attributes:
        name: of the effect.
        parameters: by name; those with a default may be left out.
    """

    name: str
    parameters: Mapping[str, float | ParameterEntry] = field(default_factory=dict)

    def build(self) -> Effect:
        """The effect; InputError for an unknown name, parameter or unit, or a value out of bounds."""
        kind = effect_kind(self.name)
        units = {item.name: item.metadata["unit"] for item in fields(kind)}
        values: dict[str, object] = {}
        for name, entry in self.parameters.items():
            given = entry if isinstance(entry, ParameterEntry) else ParameterEntry(entry)
            if name in units and given.unit not in ("", units[name]):
                raise InputError(f"effect {self.name!r} gives {name!r} in {given.unit!r}: give it in {units[name]}.")
            values[name] = given.value
        return build_effect(kind, values)


@dataclass(frozen=True)
class EffectsFile:
    """Content of an effects file.

    Attributes:
        effects: in the order in which they act.
        version: of this format.
        source: where the values come from, for people.
        data_hash: of the recordings that they were fitted to.
    """

    effects: tuple[EffectEntry, ...]
    version: int = VERSION
    source: str = ""
    data_hash: str = ""

    def __post_init__(self) -> None:
        if self.version != VERSION:
            raise InputError(f"effects file has version {self.version}: this program reads version {VERSION}.")


def read_effects_file(path: str | os.PathLike[str]) -> EffectsFile:
    """Content of an effects file, YAML or JSON.

    Raises:
        InputError: unreadable file, or content that does not fit; one sentence with file and place.
    """
    file = expanded(path)
    if not file.exists():
        raise InputError(f"effects file {str(path)!r} does not exist: give a YAML or JSON file, or name=size.")
    return load_config(file, EffectsFile)


Specification = str | os.PathLike[str] | Effect | Mapping[str, Any]


def load_effects(specification: Specification | Iterable[Specification]) -> tuple[Effect, ...]:
    """Effects from objects, ``name=size`` texts, an effects file (YAML or JSON, by its ending) or entries of one.

    Raises:
        InputError: anything that is not an effect, with the reason.
    """
    if isinstance(specification, Effect):
        return (specification,)
    if isinstance(specification, os.PathLike) or (
        isinstance(specification, str) and Path(specification).suffix in _ENDINGS
    ):
        return _build_all(specification)
    if isinstance(specification, str):
        return (parse_effect(specification),)
    if isinstance(specification, Mapping):
        return (_read_entry(specification).build(),)
    if not isinstance(specification, Iterable):
        raise InputError(f"effects are {specification!r}: give effects, name=size texts or the path of a file.")
    return tuple(effect for item in specification for effect in load_effects(item))


def _read_entry(content: Mapping[str, Any]) -> EffectEntry:
    if "name" not in content:
        # what Gymnasium's EnvSpec keeps of an Effect object: its fields, not its class
        raise InputError(
            f"an effect is given as {dict(content)!r}, without its name: give name=size texts or an effects file "
            "to an environment that is to be stored."
        )
    return config_from(dict(content), EffectEntry, source="effect")


def _build_all(path: str | os.PathLike[str]) -> tuple[Effect, ...]:
    entries = read_effects_file(path).effects
    try:
        return tuple(entry.build() for entry in entries)
    except InputError as error:
        raise InputError(f"{os.fspath(path)}: {error}") from None


def load_intervals(path: str | os.PathLike[str]) -> tuple[Mapping[str, tuple[float, float]], ...]:
    """Interval of every estimated parameter in an effects file: by name, for each effect; empty where none was.

    Raises:
        InputError: as :func:`read_effects_file`.
    """
    return tuple(
        {
            name: item.interval
            for name, item in entry.parameters.items()
            if isinstance(item, ParameterEntry) and item.interval is not None
        }
        for entry in read_effects_file(path).effects
    )


def save_effects(
    path: str | os.PathLike[str],
    effects: Iterable[Effect],
    *,
    intervals: Intervals = (),
    data_hash: str = "",
    source: str = "",
) -> None:
    """Write effects so that :func:`load_effects` returns equal ones; the file is whole or as it was before.

    Args:
        path: ends in .yaml, .yml or .json; its folder is made where absent.
        effects: in the order in which they act.
        intervals: per effect, (low, high) by parameter name; empty for none.
        data_hash: of the recordings that the values were fitted to.
        source: where they come from, for people.

    Raises:
        InputError: another ending, a path that cannot be a file, or intervals that do not belong to the effects.
    """
    file = expanded(path)
    if file.suffix not in _ENDINGS:
        raise InputError(f"effects file {str(path)!r} ends in {file.suffix!r}: end it in {', '.join(_ENDINGS)}.")
    chosen = tuple(effects)
    content = {"version": VERSION, "source": source, "data_hash": data_hash, "effects": _entries(chosen, intervals)}
    is_json = file.suffix == ".json"
    text = json.dumps(content, indent=2) + "\n" if is_json else yaml.safe_dump(content, sort_keys=False)
    with atomic_path(file) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _entries(effects: tuple[Effect, ...], intervals: Intervals) -> list[dict[str, Any]]:
    if intervals and len(intervals) != len(effects):
        raise InputError(
            f"{len(intervals)} sets of intervals for {len(effects)} effects: give one per effect, or none."
        )
    entries = []
    for effect, known in zip(effects, intervals or ({},) * len(effects), strict=True):
        item = effect.as_mapping()
        for name in known:
            if name not in item["parameters"]:
                raise InputError(f"interval for {name!r}, which effect {effect.name!r} does not have: remove it.")
        item["parameters"] = {name: _entry(effect, name, known.get(name)) for name in item["parameters"]}
        entries.append(item)
    return entries


def _entry(effect: Effect, name: str, interval: tuple[float, float] | None) -> dict[str, Any]:
    entry: dict[str, Any] = {"value": float(getattr(effect, name)), "unit": effect.parameter(name).metadata["unit"]}
    if interval is None:
        return entry
    bounds = [float(bound) for bound in interval]
    if len(bounds) != 2 or not all(map(math.isfinite, bounds)):
        raise InputError(f"interval of {effect.name!r} {name!r} is {bounds}: give a finite low and high.")
    return entry | {"interval": bounds}
