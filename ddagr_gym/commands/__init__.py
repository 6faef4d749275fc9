"""The sub-commands of ``ddagr``, one module each.

To add one, write ``ddagr_gym/commands/<name>.py`` (a hyphen becomes an underscore, a
Python keyword gets one at its end: ``import`` is ``import_.py``) with

- ``Arguments``: a frozen dataclass, typed as tyro reads it. The first line of its docstring is the command's line in
  ``ddagr --help``; the ``Attributes`` section is the help of its options.
- ``EXAMPLES``: command lines that work as they stand.
- ``run(arguments) -> int | None``: does the work; an integer is the exit code.

and add the name to :data:`NAMES`. Import heavy packages inside ``run``: ``ddagr --help`` imports every module here.
"""

from __future__ import annotations

import importlib
import inspect
import keyword
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ddagr_gym.errors import unknown_name

NAMES = (
    "demo",
    "simulate",
    "import",
    "check",
    "replay",
    "diagnose",
    "null-bank",
    "isolability",
    "next-drive",
    "robots",
    "soils",
    "validate",
    "effects",
    "estimate",
    "study",
    "train",
    "evaluate",
    "freeze-scenarios",
    "tune-controllers",
    "benchmark",
    "test",
)
"""Every command, in the order of ``ddagr --help``."""


@dataclass(frozen=True)
class Command:
    """A sub-command, loaded.

    Attributes:
        name: as typed.
        arguments: dataclass of its options.
        examples: command lines for its help.
        run: the work; returns an exit code or None for 0.
    """

    name: str
    arguments: type[Any]
    examples: tuple[str, ...]
    run: Callable[[Any], int | None]

    @property
    def summary(self) -> str:
        """First line of the arguments' docstring, without the full stop."""
        return (inspect.getdoc(self.arguments) or "").split("\n", 1)[0].rstrip(".")


def load(name: str) -> Command:
    """The command called ``name``; an unknown one raises InputError with the closest names."""
    if name not in NAMES:
        raise unknown_name("command", name, NAMES)
    stem = name.replace("-", "_") + ("_" if keyword.iskeyword(name) else "")
    module = importlib.import_module(f"{__name__}.{stem}")
    return Command(name, module.Arguments, tuple(module.EXAMPLES), module.run)
