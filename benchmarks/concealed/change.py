"""One effect of a case as the places where it intervenes, and the forms an effect may take."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .plant import Plant

Array = np.ndarray
Rng = np.random.Generator
Truth = Mapping[str, Array]


@dataclass(frozen=True)
class Change:
    """What one effect does; a missing function means that it does not act there.

    Attributes:
        parameters: for the label, in SI units and radians.
        plant: new plant from the plant.
        command: (commands at 400 Hz (n, 2), rng) -> the same as the motors receive them.
        encoder: (bank angles (T, 2), truth, rng) -> angles that the encoders count.
        inertial: (specific force x, y, z and yaw rate (T, 4), truth, rng) -> the same before noise.
        pose: (x, y, yaw (T, 3), truth, rng) -> the same before noise.
        logged: (columns with noise, rng) -> columns.
    """

    parameters: Mapping[str, Any] = field(default_factory=dict)
    plant: Callable[[Plant], Plant] | None = None
    command: Callable[[Array, Rng], Array] | None = None
    encoder: Callable[[Array, Truth, Rng], Array] | None = None
    inertial: Callable[[Array, Truth, Rng], Array] | None = None
    pose: Callable[[Array, Truth, Rng], Array] | None = None
    logged: Callable[[dict[str, Array], Rng], dict[str, Array]] | None = None


@dataclass(frozen=True)
class Site:
    """What a form may look at to be met by the drives: the paths without any effect."""

    paths: tuple[Truth, ...]

    def point(self, rng: Rng, low: float = 0.3, high: float = 0.7) -> tuple[float, float]:
        """A place on one of the paths, passed within the given share of the drive [m]."""
        path = self.paths[rng.integers(len(self.paths))]
        k = int(rng.uniform(low, high) * len(path["x"]))
        return float(path["x"][k]), float(path["y"][k])

    def middle(self) -> tuple[float, float]:
        """Mean position over all paths [m]."""
        return tuple(float(np.mean([np.mean(p[name]) for p in self.paths])) for name in ("x", "y"))  # type: ignore[return-value]


Builder = Callable[[float, Rng, Site], Change]


@dataclass(frozen=True)
class Form:
    """One physical form of an effect.

    Attributes:
        name: the verdict's name, or for an effect outside the library our own name of it.
        variant: which form of it.
        tag: "same", "variant" or "different" from the form an obvious library would have; "outside" if in none.
        low, high: range of the size in multiples of the least meaningful one; both 0 for effects without a size.
        equation: for people.
        build: (size in the least meaningful unit's unit, rng, site) -> change.
        needs_pose: whether it shows only where the robot carries a receiver.
        reserved: kept for the sealed set.
        later: came after the first sets, whose draws must stay as they are.
        also: other names of the verdict that a field engineer may give it as rightly.
    """

    name: str
    variant: str
    tag: str
    low: float
    high: float
    equation: str
    build: Builder
    needs_pose: bool = False
    reserved: bool = False
    later: bool = False
    also: tuple[str, ...] = ()


def with_body(plant: Plant, **values: Any) -> Plant:
    """Plant with some numbers of the body changed."""
    return plant._replace(body=plant.body._replace(**values))


def with_wheels(plant: Plant, **values: Any) -> Plant:
    """Plant with some numbers of the wheels changed."""
    return plant._replace(wheels=plant.wheels._replace(**values))


def with_radii(plant: Plant, growth: Array) -> Plant:
    """Plant whose outer wheel radii have grown by these shares, (4,)."""
    radii = plant.wheels.major_radius
    return with_wheels(plant, major_radius=radii + (plant.wheels.minor_radius + radii) * growth)


def with_soil(plant: Plant, **factors: float) -> Plant:
    """Plant with numbers of the soil multiplied."""
    soil = plant.soil
    return plant._replace(soil=soil._replace(**{name: getattr(soil, name) * f for name, f in factors.items()}))


def with_ground(plant: Plant, **values: Any) -> Plant:
    """Plant with some numbers of the ground changed."""
    return plant._replace(ground=plant.ground._replace(**values))


def with_motors(plant: Plant, **values: Any) -> Plant:
    """Plant with some numbers of the motors changed."""
    return plant._replace(motors=plant.motors._replace(**values))


def with_external(plant: Plant, row: Array) -> Plant:
    """Plant with one more external force."""
    return plant._replace(externals=np.concatenate([plant.externals, row]))


def signed(rng: Rng) -> float:
    """-1 or 1."""
    return float(rng.choice([-1.0, 1.0]))


def patch_row(kind: float, place: tuple[float, float], radius: float, angle: float, ln_strength: float) -> Array:
    """Row of a soil patch, (1, 7); stiffness follows strength with 1.5 times its logarithm."""
    return np.array([[kind, place[0], place[1], radius, angle, ln_strength, 1.5 * ln_strength]])


REGISTRY: list[Form] = []
"""Every form of every effect, in order of definition."""


def form(
    name: str,
    variant: str,
    tag: str,
    low: float,
    high: float,
    equation: str,
    *,
    needs_pose: bool = False,
    reserved: bool = False,
    later: bool = False,
    also: tuple[str, ...] = (),
) -> Callable[[Builder], Builder]:
    """Register a builder as one form; arguments as in :class:`Form`."""

    def register(build: Builder) -> Builder:
        REGISTRY.append(Form(name, variant, tag, low, high, equation, build, needs_pose, reserved, later, also))
        return build

    return register


def outside(name: str, variant: str, equation: str, **flags: bool) -> Callable[[Builder], Builder]:
    """Register a builder of an effect that no library lists, once to twice the figure in its equation."""
    return form(name, variant, "outside", 1, 2, equation, **flags)
