"""The sub-commands of ``ddagr``, one module each.

To add one, write ``ddagr_gym/commands/<name>.py`` (a hyphen becomes an underscore, a
Python keyword gets one at its end: ``import`` is ``import_.py``) with

- ``Arguments``: a frozen dataclass, typed as tyro reads it. The first line of its docstring is the command's line in
  ``ddagr --help``; the ``Attributes`` section is the help of its options.
- ``EXAMPLES``: command lines that work as they stand.
- ``run(arguments) -> int | None``: does the work; an integer is the exit code.

and add the name to :data:`NAMES`. Import heavy packages inside ``run``: ``ddagr --help`` imports every module here.

The tools for work on the package itself (:data:`CHECKOUT_TOOLS`) are written in the same way in the folder ``tools`` of
the checkout; they are not in the wheel.
"""

from __future__ import annotations

import importlib
import inspect
import keyword
import sys
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from ddagr_gym.errors import InputError, unknown_name

USAGE = "ddagr COMMAND [OPTIONS]"
PURPOSE = "Skid-steer field robots on soft soil: simulate, train, compare, diagnose."

NAMES = (
    "demo",
    "simulate",
    "train",
    "evaluate",
    "import",
    "check",
    "replay",
    "calibrate",
    "diagnose",
    "adapt",
    "export",
    "estimate",
    "null-bank",
    "isolability",
    "next-drive",
    "effects",
    "robots",
    "soils",
    "validate",
)
"""Every command, in the order of ``ddagr --help``."""

CHECKOUT_TOOLS = ("test", "docs", "benchmark", "study", "tune-controllers", "freeze-scenarios", "diagnosis-schema")
"""Tools of the checkout, which ``./ddagr`` starts there."""


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


def load(name: str, package: ModuleType | None = None) -> Command:
    """The command called ``name``.

    Args:
        name: as typed.
        package: module with ``NAMES``, which holds a module for each; this one by default.

    Raises:
        InputError: a tool of the checkout, or an unknown name with the closest ones.
    """
    package = sys.modules[__name__] if package is None else package
    if name not in package.NAMES:
        raise _tool_of_the_checkout(name) if name in CHECKOUT_TOOLS else unknown_name("command", name, package.NAMES)
    stem = name.replace("-", "_") + ("_" if keyword.iskeyword(name) else "")
    module = importlib.import_module(f"{package.__name__}.{stem}")
    return Command(name, module.Arguments, tuple(module.EXAMPLES), module.run)


def _tool_of_the_checkout(name: str) -> InputError:
    return InputError(
        f"{name!r} is a tool for work on ddagr-gym itself and not part of the installed package: clone the repository "
        f"and run ./ddagr {name} in the checkout."
    )
