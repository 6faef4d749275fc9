"""Options of a command as their help shows them: none that stands for nothing has a default."""

from __future__ import annotations

import dataclasses
import types
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import tyro

_WORDS = {Path: "PATH", float: "FLOAT", int: "INT", str: "STR"}
"""What the help calls a value, by its type."""


def shown_options(arguments: type[Any]) -> type[Any]:
    """A dataclass with the same fields and help, in which empty defaults and the type of "not given" are not shown.

    Args:
        arguments: dataclass of a command's options.
    """
    hints = get_type_hints(arguments, include_extras=True)
    entries = [
        (item.name, _shown(hints[item.name], item), dataclasses.field(default=item.default))
        for item in dataclasses.fields(arguments)
    ]
    shown = dataclasses.make_dataclass(arguments.__name__, entries, frozen=True)
    shown.__doc__ = arguments.__doc__
    return shown


def _shown(kind: Any, item: dataclasses.Field[Any]) -> Any:
    """Type of one field, annotated."""
    several = item.default is dataclasses.MISSING and get_origin(_bare(kind)) is tuple  # tyro calls () their default
    if not several and item.default not in (None, "", ()):
        return kind
    return Annotated[kind, tyro.conf.arg(help_behavior_hint="", metavar=_word(kind))]


def _bare(kind: Any) -> Any:
    """Type without what is annotated."""
    return get_args(kind)[0] if get_origin(kind) is Annotated else kind


def _word(kind: Any) -> str | None:
    """What a value is called that may be left out; None where tyro's own word does."""
    bare = _bare(kind)
    if get_origin(bare) not in (Union, types.UnionType):
        return None
    given = [option for option in get_args(bare) if option is not type(None)]
    if get_origin(given[0]) is Literal:
        return f"{{{','.join(map(str, get_args(given[0])))}}}"
    return _WORDS.get(given[0]) if len(given) == 1 else None
