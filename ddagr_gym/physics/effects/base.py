"""What an effect is: named physics that the nominal model leaves out, attached at fixed points of the simulator.

An effect is a frozen dataclass of parameters plus one or more compiled actions ``f(row, parameters, memory)``; see
:mod:`ddagr_gym.physics.layout` for the row and the points, and CONTRIBUTING for how to add one.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from dataclasses import Field, dataclass, field, fields
from functools import cache
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.physics.callbacks import compile_effect
from ddagr_gym.physics.layout import EFFECT_PARAMETERS
from ddagr_gym.validated import Validated

Vector = NDArray[np.float64]
Action = Callable[[Vector, Vector, Vector], None]

GROUPS = ("commands and motors", "robot", "ground", "sensors")
"""Where effects act, in the words and order of the verdict's table."""


def size(
    unit: str,
    low: float,
    high: float,
    *,
    least: float,
    default: float | None = None,
    neutral: float = 0.0,
    step: float | None = None,
) -> Any:
    """Field that says how big an effect is; at ``neutral`` the field does nothing.

    Args:
        unit: SI.
        low: smallest valid value.
        high: largest.
        least: distance from ``neutral`` below which nobody would care.
        default: when it need not be given; the first field of an effect is its main size.
        neutral: value without effect.
        step: for finite differences; a quarter of ``least`` by default.
    """
    metadata = {"unit": unit, "low": low, "high": high, "open_low": False, "least": least}
    metadata |= {"neutral": neutral, "step": 0.25 * least if step is None else step}
    return field(metadata=metadata) if default is None else field(default=default, metadata=metadata)


def shape(unit: str, low: float, high: float, *, default: float, step: float) -> Any:
    """Field that says how or where an effect acts; it has no influence while the sizes are neutral."""
    metadata = {"unit": unit, "low": low, "high": high, "open_low": False, "least": 0.0, "neutral": None, "step": step}
    return field(default=default, metadata=metadata)


@dataclass(frozen=True)
class DriveExtent:
    """What drives cover; effects that act at a place, a time or a limit choose their probes by it.

    Attributes:
        duration: of the longest drive [s].
        x: least and greatest world position [m].
        y: the same across [m].
        wheel_speed: largest bank speed [rad/s].
        wheel_acceleration: largest change of a bank speed per time [rad/s^2].
        turning: largest commanded distance of a bank's speed from the mean of both [rad/s].
        traction: torque of half the robot's weight at the rim [N m].
    """

    duration: float = 60.0
    x: tuple[float, float] = (0.0, 10.0)
    y: tuple[float, float] = (0.0, 10.0)
    wheel_speed: float = 1.0
    wheel_acceleration: float = 2.0
    turning: float = 0.5
    traction: float = 250.0


@dataclass(frozen=True)
class Effect(Validated):
    """Base of all effects. Subclasses are final, set the class attributes and add fields with size() and shape().

    Actions are pure functions of row, parameters and memory. At the points wheel_forces and body_forces they are called
    several times per step, in any order of trial states: there they must leave their memory alone. Before a window of
    a replay those at the points commands and motors are called for each earlier sample whose command is known, at the
    motion of the window's start, so that they know what was commanded; they must not count on that motion to change.
    """

    name: ClassVar[str]
    """The word that the verdict uses, and the name of its file."""
    title: ClassVar[str]
    group: ClassVar[str]
    """One of GROUPS."""
    equation: ClassVar[str]
    source: ClassVar[str]
    """Paper, standard, thesis equation or data sheet; "ours" where there is none."""
    signature: ClassVar[str]
    """What it leaves in the recordings."""
    confused_with: ClassVar[tuple[str, ...]] = ()
    """Names that the same recordings may allow as well; a symmetric relation."""
    differentiable: ClassVar[bool] = True
    """Whether readings have a useful derivative by every size at neutral; if not, probe with finite sizes."""
    categorical: ClassVar[bool] = False
    """Whether only the bounds of the sizes exist in nature (a sign); values between serve sensitivities."""
    needs_earlier_drives: ClassVar[bool] = False
    """Whether only drives from before say what is usual, so that a diagnosis against a nominal model leaves it out."""
    needs_one_frame: ClassVar[bool] = False
    """Whether it acts by direction or place in the world, so that poses in several frames cannot show it."""
    load_sizes: ClassVar[tuple[str, ...]] = ()
    """Sizes that are a torque or power of the motors: the readings show them only by what the ground resists with."""
    actions: ClassVar[tuple[tuple[int, Action], ...]]
    """(point, function) pairs, called in this order at their points; each has a memory of its own."""

    @classmethod
    def size_names(cls) -> tuple[str, ...]:
        """Fields that say how big the effect is, the main one first."""
        return tuple(item.name for item in fields(cls) if item.metadata["neutral"] is not None)

    @classmethod
    def shape_names(cls) -> tuple[str, ...]:
        """Fields that say how or where it acts."""
        return tuple(item.name for item in fields(cls) if item.metadata["neutral"] is None)

    @classmethod
    def parameter(cls, name: str) -> Field[Any]:
        """Field by name; its ``metadata`` holds unit, low, high, least, neutral (None for a shape) and step."""
        return {item.name: item for item in fields(cls)}[name]

    @classmethod
    def reach(cls, name: str) -> float:
        """Largest distance of a size from neutral that exists, in its unit."""
        data = cls.parameter(name).metadata
        return float(max(data["high"] - data["neutral"], data["neutral"] - data["low"]))

    @classmethod
    def description(cls) -> str:
        """The class's docstring without its list of attributes."""
        return inspect.cleandoc(cls.__doc__ or "").partition("\n\nAttributes:")[0]

    @classmethod
    def meaning(cls, name: str) -> str:
        """What the docstring says about a field, in one line."""
        attributes = inspect.cleandoc(cls.__doc__ or "").partition("\nAttributes:\n")[2]
        found = re.search(rf"^    {name}: (.*(?:\n     .*)*)", attributes, re.MULTILINE)
        return " ".join(found.group(1).split()) if found else ""

    @classmethod
    def neutral(cls, **shapes: float) -> Self:
        """The effect that changes nothing: sizes at neutral, shapes at their default or as given."""
        return cls(**{name: cls.parameter(name).metadata["neutral"] for name in cls.size_names()}, **shapes)

    @classmethod
    def probes(cls, extent: DriveExtent) -> tuple[Any, ...]:
        """Small effects that together span what this kind can do to first order.

        One per size, a step from neutral; kinds with shapes, and those that are not differentiable, give their own.
        """
        start = cls.neutral()
        return tuple(
            start.with_values(**{name: getattr(start, name) + cls.parameter(name).metadata["step"]})
            for name in cls.size_names()
        )

    @property
    def is_neutral(self) -> bool:
        """Whether it changes nothing."""
        return all(getattr(self, name) == self.parameter(name).metadata["neutral"] for name in self.size_names())

    @property
    def acting(self) -> tuple[tuple[int, Action], ...]:
        """The actions that a simulation calls; fewer where a shape switches some off."""
        return self.actions

    @property
    def idle_shapes(self) -> frozenset[str]:
        """Shapes that no fit moves where the effect stands, because nothing would show it."""
        return frozenset()

    @property
    def soils(self) -> Mapping[str, tuple[float, float]]:
        """Factors on strength and stiffness of the soils that it tells apart, by where they are, in words.

        Two at most, the one that is stated first; a single one where it is the same everywhere. Empty for effects on
        anything else.
        """
        return {}

    def is_meaningful(self, extent: DriveExtent) -> bool:
        """Whether any size is at least its least meaningful distance from neutral."""
        limits = {name: self.parameter(name).metadata for name in self.size_names()}
        return any(abs(getattr(self, name) - item["neutral"]) >= item["least"] for name, item in limits.items())

    def vector(self) -> Vector:
        """Parameters as the actions read them, (EFFECT_PARAMETERS,), in the order of the fields, zero padded."""
        values = [float(getattr(self, item.name)) for item in fields(self)]
        return np.array(values + [0.0] * (EFFECT_PARAMETERS - len(values)))

    def as_mapping(self) -> dict[str, Any]:
        """Name and parameters, as they stand in an effects file."""
        return {"name": self.name, "parameters": {item.name: getattr(self, item.name) for item in fields(self)}}


@cache
def action_address(action: Action) -> int:
    """Address of a compiled action; compiled once per process, cached on disk."""
    return compile_effect(action)


def effect_table(effects: tuple[Effect, ...]) -> tuple[NDArray[np.int64], NDArray[np.int64], Vector]:
    """Points, addresses and parameters of all actions of ``effects``, as the simulator's kernel reads them."""
    rows = [(point, action_address(action), effect.vector()) for effect in effects for point, action in effect.acting]
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
