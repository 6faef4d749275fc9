"""Errors and warnings that a person caused and can mend: one sentence with the offending value and the remedy."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable
from numbers import Integral, Real


class InputError(ValueError):
    """Bad input from the user. The command line prints the message and exits with code 2."""


class InputWarning(UserWarning):
    """Input that is used as it is, though something about it makes results doubtful. Commands print it as one line."""


def unknown_name(kind: str, name: object, known: Iterable[str], where: str = "") -> InputError:
    """Error for a name that is not in a registry, listing the closest ones.

    Args:
        kind: what the name stands for, singular ("soil", "robot").
        name: the offending value.
        known: the valid names.
        where: how to see all of them, as the rest of the sentence.
    """
    names = sorted(known)
    close = difflib.get_close_matches(str(name), names, n=3, cutoff=0.4)
    hint = f"did you mean {', '.join(repr(c) for c in close)}" if close else f"choose one of {', '.join(names)}"
    return InputError(f"unknown {kind} {name!r}: {hint}{f'; {where}' if where else ''}.")


def at_least(**bounds: tuple[float | None, float]) -> None:
    """Refuse what is no finite number or below its least value; None passes.

    Args:
        bounds: value and least value by name; where the least value is an integer, the value has to be one too.

    Raises:
        InputError: with the first one that is refused.
    """
    for name, (given, least) in bounds.items():
        if given is None:
            continue
        whole = isinstance(least, int)
        if not _is_number(given, whole):
            needed = "a whole number" if whole else "a finite number"
            raise InputError(f"{name} is {given!r}: give {needed} of at least {least}.")
        if given < least:
            raise InputError(f"{name} is {given}: give at least {least}.")


def _is_number(value: object, whole: bool) -> bool:
    """Whether a value is a whole or else a finite number, of Python or numpy; True and False are neither."""
    if isinstance(value, Integral):
        return not isinstance(value, bool)
    return not whole and isinstance(value, Real) and math.isfinite(value)
