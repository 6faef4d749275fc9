"""Options of a command that have a least value."""

from __future__ import annotations

from typing import Any

from ddagr_gym.errors import InputError


def check_at_least(arguments: Any, **least: float) -> None:
    """Refuse options below their least value; those that were left out pass.

    Args:
        arguments: of a command.
        least: value by name of the option.

    Raises:
        InputError: with the first one that is below, or no number.
    """
    for name, value in least.items():
        given = getattr(arguments, name)
        if given is not None and not given >= value:
            raise InputError(f"--{name} is {given}: give at least {value}.")
