"""What an effect is: named physics that the nominal model leaves out, attached at a fixed point of the simulator.

An effect is a frozen dataclass of parameters plus one or more compiled actions ``f(row, parameters, memory)``; see
:mod:`ddagr_gym.physics.layout` for the row and the points, and CONTRIBUTING for how to add one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from functools import cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Validated
from ddagr_gym.physics.callbacks import compile_effect
from ddagr_gym.physics.layout import EFFECT_PARAMETERS

Action = Callable[[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]], None]


def size(unit: str, low: float, high: float, *, least: float, default: float | None = None) -> Any:
    """Field of an effect: unit, bounds, and the least size that a user would care about.

    A field without a default must be given; the first field is the effect's size.
    """
    metadata = {"unit": unit, "low": low, "high": high, "open_low": False, "least": least}
    return field(metadata=metadata) if default is None else field(default=default, metadata=metadata)


@dataclass(frozen=True)
class Effect(Validated):
    """Base of all effects. Subclasses are final, set the class attributes and add float fields with :func:`size`."""

    name: ClassVar[str]
    """The word that the verdict uses."""
    title: ClassVar[str]
    equation: ClassVar[str]
    source: ClassVar[str]
    signature: ClassVar[str]
    """What it leaves in the recordings."""
    confused_with: ClassVar[tuple[str, ...]] = ()
    actions: ClassVar[tuple[tuple[int, Action], ...]]
    """(point, function) pairs, called in this order at their points."""

    def vector(self) -> NDArray[np.float64]:
        """Parameters as the actions read them, (EFFECT_PARAMETERS,), zero padded."""
        values = [float(getattr(self, item.name)) for item in fields(self)]
        return np.array(values + [0.0] * (EFFECT_PARAMETERS - len(values)))

    def as_mapping(self) -> dict[str, Any]:
        """Name and parameters, as they stand in an effects file."""
        return {"name": self.name, "parameters": {item.name: getattr(self, item.name) for item in fields(self)}}


@cache
def action_address(action: Action) -> int:
    """Address of a compiled action; compiled once per process, cached on disk."""
    return compile_effect(action)


def effect_table(effects: tuple[Effect, ...]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Points, addresses and parameters of all actions of ``effects``, as the simulator's kernel reads them."""
    rows = [(point, action_address(action), effect.vector()) for effect in effects for point, action in effect.actions]
    points = np.array([row[0] for row in rows], dtype=np.int64)
    addresses = np.array([row[1] for row in rows], dtype=np.int64)
    parameters = np.array([row[2] for row in rows], dtype=np.float64).reshape(-1, EFFECT_PARAMETERS)
    return points, addresses, parameters


def build_effect(kind: type[Effect], values: Mapping[str, object]) -> Effect:
    """Effect from named parameters, with a sentence for an unknown or missing one.

    Raises:
        InputError: unknown, missing or invalid parameter.
    """
    known = {item.name: item for item in fields(kind)}
    for key in values:
        if key not in known:
            raise InputError(f"effect {kind.name!r} has no parameter {key!r}: it takes {', '.join(known)}.")
    missing = [k for k, item in known.items() if k not in values and item.default is item.default_factory]
    if missing:
        unit = known[missing[0]].metadata["unit"]
        raise InputError(f"effect {kind.name!r} needs {missing[0]!r} [{unit}]: write {kind.name}=VALUE.")
    try:
        return kind(**{key: float(value) for key, value in values.items()})  # type: ignore[arg-type]
    except (TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"effect {kind.name!r} got {dict(values)!r}: parameters are numbers.") from None
