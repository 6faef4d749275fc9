"""YAML files as frozen dataclasses, read strictly.

The dataclass is the schema: an unknown key, a missing one, a wrong type, a number that is not finite, a key given twice
or an anchor is an :class:`~ddagr_gym.errors.InputError` that names the file, the place and the remedy.
"""

from __future__ import annotations

import dataclasses
import difflib
import enum
import math
import os
import re
import types
import typing
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypeVar, Union

import yaml

from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.files import expanded, read_text

Config = TypeVar("Config")

MAXIMUM_BYTES = 1_000_000
"""Largest configuration file that is read."""

DEEPEST = 50
"""Levels of lists and mappings in a configuration (ours): ten times what any has; parsers take ever longer beyond."""

_OPENING = (
    yaml.FlowSequenceStartToken, yaml.FlowMappingStartToken, yaml.BlockSequenceStartToken, yaml.BlockMappingStartToken,
)  # fmt: skip
_CLOSING = (yaml.FlowSequenceEndToken, yaml.FlowMappingEndToken, yaml.BlockEndToken)

# YAML 1.1, which PyYAML speaks, takes 1e-3 for text; YAML 1.2 and everybody else for a number.
_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?")


def configs_dir() -> Path:
    """Folder of the configurations: ``configs/`` of the checkout, ``ddagr_gym/configs`` of an installed package."""
    package = Path(__file__).resolve().parent
    for folder in (package.parent / "configs", package / "configs"):
        if folder.is_dir() and (folder.parent == package or (package.parent / "pyproject.toml").is_file()):
            return folder
    raise InputError(f"no configs folder beside or in {package}: install ddagr-gym again.")


def config_names(folder: str) -> tuple[str, ...]:
    """Names of the configurations in one folder of :func:`configs_dir` ("soils"), sorted."""
    return tuple(sorted(file.stem for file in (configs_dir() / folder).glob("*.yaml")))


def find_config(folder: str, name: str | os.PathLike[str]) -> Path:
    """File of a configuration.

    Args:
        folder: of :func:`configs_dir` ("soils").
        name: one of :func:`config_names`, or the path of a ``.yaml`` or ``.yml`` file.

    Raises:
        InputError: no such name (closest names listed) or file, or no regular one.
    """
    path = expanded(name)
    if path.suffix in (".yaml", ".yml"):
        if not path.exists():
            raise InputError(f"{path}: no such configuration file, give the path of one that exists.")
        if not path.is_file():
            raise InputError(f"{path} is not a regular file: give a configuration's file.")
        return path
    names = config_names(folder)
    if str(name) not in names:
        if not names:
            raise InputError(f"unknown configuration {str(name)!r}: configs/{folder} is empty, give a .yaml file.")
        raise unknown_name(f"configuration in configs/{folder}", str(name), names)
    return configs_dir() / folder / f"{name}.yaml"


def load_config(path: str | os.PathLike[str], kind: type[Config]) -> Config:
    """Read a YAML file as an instance of the dataclass ``kind``.

    Args:
        path: file of at most :data:`MAXIMUM_BYTES` bytes, UTF-8.
        kind: frozen dataclass; nested dataclasses, tuples, mappings, enumerations, literals and unions with None are
            understood. Fields with a default may be left out.

    Raises:
        InputError: unreadable file, or content that does not fit; one sentence with file and place.
    """
    file = expanded(path)
    return parse_config(_read(file), kind, source=str(file))


def parse_config(text: str, kind: type[Config], *, source: str = "configuration") -> Config:
    """The same as :func:`load_config` for a text; ``source`` comes first in error messages."""
    content = _parse_yaml(text, source)
    return config_from({} if content is None else content, kind, source=source)


def config_from(content: Any, kind: type[Config], *, source: str = "configuration") -> Config:
    """The same as :func:`load_config` for content that is read already, such as JSON's dictionaries and lists.

    :func:`dataclasses.asdict` of an instance gives such content too.
    """
    return typing.cast(Config, _convert(content, kind, source))


def dump_config(config: Any) -> str:
    """YAML text that :func:`parse_config` reads back as an equal instance."""
    return yaml.safe_dump(_plain(config), sort_keys=False, allow_unicode=True)


def _read(file: Path) -> str:
    return read_text(
        file, MAXIMUM_BYTES, lambda reason: InputError(f"{file} cannot be read: {reason}, give a configuration's file.")
    )


def _parse_yaml(text: str, source: str) -> Any:
    try:
        depth = 0
        for token in yaml.scan(text, Loader=yaml.SafeLoader):
            depth += isinstance(token, _OPENING) - isinstance(token, _CLOSING)
            if depth > DEEPEST:
                raise InputError(f"{source}: nested deeper than {DEEPEST} levels, which no configuration is.")
            if isinstance(token, yaml.AliasToken | yaml.AnchorToken):
                line = token.start_mark.line + 1
                raise InputError(f"{source}, line {line}: anchors and aliases are not read, write the value out.")
        _refuse_repeated_keys(yaml.compose(text, Loader=yaml.SafeLoader), source)
        return yaml.safe_load(text)
    except yaml.MarkedYAMLError as error:
        line = "" if error.problem_mark is None else f", line {error.problem_mark.line + 1}"
        raise InputError(f"{source}{line}: not valid YAML, {error.problem or error.context}.") from None
    except (yaml.YAMLError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{source}: not valid YAML, {' '.join(str(error).split())}.") from None
    except RecursionError:
        raise InputError(f"{source}: nested too deeply to be a configuration.") from None


def _refuse_repeated_keys(node: yaml.Node | None, source: str) -> None:
    if isinstance(node, yaml.SequenceNode):
        for item in node.value:
            _refuse_repeated_keys(item, source)
    if not isinstance(node, yaml.MappingNode):
        return
    seen: set[str] = set()
    for key, value in node.value:
        if isinstance(key, yaml.ScalarNode):
            if key.value in seen:
                line = key.start_mark.line + 1
                raise InputError(f"{source}, line {line}: {key.value!r} is given twice, keep one of them.")
            seen.add(key.value)
        _refuse_repeated_keys(value, source)


def _convert(value: Any, hint: Any, place: str) -> Any:
    """``value`` as the type ``hint``; ``place`` says where it is in the file."""
    origin = typing.get_origin(hint)
    if origin in (Union, types.UnionType):
        return _convert_union(value, typing.get_args(hint), place)
    if origin is Literal:
        return _convert_choice(value, {str(choice): choice for choice in typing.get_args(hint)}, place)
    if origin in (tuple, list, Sequence):
        return _convert_sequence(value, hint, place)
    if origin in (dict, Mapping):
        return _convert_mapping(value, typing.get_args(hint)[1], place)
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        return _convert_dataclass(value, hint, place)
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        return _convert_choice(value, {member.name: member for member in hint}, place)
    return _convert_scalar(value, hint, place)


def _convert_dataclass(value: Any, kind: type[Any], place: str) -> Any:
    if not isinstance(value, dict):
        raise InputError(f"{place} is {_shown(value)}: give the fields of {kind.__name__}, one per line.")
    hints = typing.get_type_hints(kind)
    known = {item.name: item for item in dataclasses.fields(kind) if item.init}
    for key in value:
        if key not in known:
            raise InputError(f"{place}: unknown key {key!r}, {_closest(str(key), known)}.")
    absent = [name for name, item in known.items() if name not in value and not _has_default(item)]
    if absent:
        raise InputError(f"{place}: {', '.join(absent)} missing, {kind.__name__} needs it.")
    arguments = {key: _convert(item, hints[key], f"{place}: {key}") for key, item in value.items()}
    try:
        return kind(**arguments)
    except InputError as error:
        raise InputError(f"{place}: {error}") from None


def _has_default(item: dataclasses.Field[Any]) -> bool:
    return item.default is not dataclasses.MISSING or item.default_factory is not dataclasses.MISSING


def _closest(name: str, known: Mapping[str, Any]) -> str:
    close = difflib.get_close_matches(name, known, n=3, cutoff=0.4)
    return f"did you mean {', '.join(map(repr, close))}" if close else f"known are {', '.join(known)}"


def _convert_union(value: Any, members: tuple[Any, ...], place: str) -> Any:
    if value is None and type(None) in members:
        return None
    others = [member for member in members if member is not type(None)]
    complaints = []
    for member in others:
        try:
            return _convert(value, member, place)
        except InputError as error:
            complaints.append(error)
    if len(complaints) == 1:
        raise complaints[0]
    expected = " or ".join(_type_name(member) for member in others)
    raise InputError(f"{place} is {_shown(value)}: give {expected}.")


def _convert_choice(value: Any, choices: Mapping[str, Any], place: str) -> Any:
    if isinstance(value, bool) or str(value) not in choices:
        raise InputError(f"{place} is {_shown(value)}: choose one of {', '.join(choices)}.")
    return choices[str(value)]


def _convert_sequence(value: Any, hint: Any, place: str) -> Any:
    items = typing.get_args(hint)
    origin = typing.get_origin(hint)
    fixed = origin is tuple and not (len(items) == 2 and items[1] is Ellipsis)
    if not isinstance(value, list | tuple):
        raise InputError(f"{place} is {_shown(value)}: give a list{f' of {len(items)} values' if fixed else ''}.")
    if fixed and len(value) != len(items):
        raise InputError(f"{place} has {len(value)} values: give {len(items)}.")
    hints = items if fixed else (items[0],) * len(value)
    converted = [_convert(v, h, f"{place}[{i}]") for i, (v, h) in enumerate(zip(value, hints, strict=True))]
    return converted if origin is list else tuple(converted)


def _convert_mapping(value: Any, hint: Any, place: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InputError(f"{place} is {_shown(value)}: give names with values, one per line.")
    for key in value:
        if not isinstance(key, str):
            raise InputError(f"{place}: the key {key!r} is not text: put it in quotes.")
    return {key: _convert(item, hint, f"{place}: {key}") for key, item in value.items()}


def _convert_scalar(value: Any, hint: Any, place: str) -> Any:
    if hint is float:
        return _convert_float(value, place)
    if hint is Path and isinstance(value, str):
        return Path(value)
    if hint not in (bool, int, str, Path):
        raise TypeError(f"{place}: configurations cannot hold {hint!r}")
    if not isinstance(value, hint) or (hint is int and isinstance(value, bool)):
        raise InputError(f"{place} is {_shown(value)}: give {_type_name(hint)}.")
    return value


def _convert_float(value: Any, place: str) -> float:
    if isinstance(value, str) and _NUMBER.fullmatch(value):
        value = float(value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{place} is {_shown(value)}: give a number.")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise InputError(f"{place} is {_shown(value)}: give a finite number.")
    return number


def _shown(value: Any) -> str:
    text = "empty" if value is None else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _type_name(hint: Any) -> str:
    names = {bool: "true or false", int: "a whole number", float: "a number", str: "text", Path: "a path"}
    return names.get(hint, f"a {getattr(hint, '__name__', str(hint))}")


def _plain(value: Any) -> Any:
    """``value`` in the types that YAML knows."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {item.name: _plain(getattr(value, item.name)) for item in dataclasses.fields(value) if item.init}
    if isinstance(value, enum.Enum):
        return value.name
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "item"):
        return value.item()
    return value
