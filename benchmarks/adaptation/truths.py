"""Truths of the demonstration: what is different about the robot or its ground, and the same in the library's terms."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.concealed.catalogue import LIBRARY_FORMS
from benchmarks.concealed.change import Change, Site, patch_row, with_ground
from benchmarks.concealed.ground import DISC
from benchmarks.concealed_truth import true_sizes
from ddagr_gym.physics.effects import Effect, build_effect, effect_kind

_NOWHERE = Site(())


@dataclass(frozen=True)
class Truth:
    """One concealed truth.

    Attributes:
        name: in files.
        title: in tables and pictures.
        effect: name in the library; "" where it has none, or nothing is different.
        make: rng -> what is different in the other simulator.
        shapes: of the library's effect, from the other simulator's parameters.
    """

    name: str
    title: str
    effect: str
    make: Callable[[np.random.Generator], Change]
    shapes: Callable[[Mapping[str, Any]], dict[str, float]] = lambda known: {}

    def change(self) -> Change:
        """What is different; the same at every call."""
        return self.make(np.random.default_rng(0))

    def named_effects(self) -> tuple[Effect, ...]:
        """The same in the library's terms, as one who was told would write it down."""
        if not self.effect:
            return ()
        known = self.change().parameters
        sizes = true_sizes({"name": self.effect, "parameters": known})
        return (build_effect(effect_kind(self.effect), {**sizes, **self.shapes(known)}),)


def _form(name: str, variant: str, size: float) -> Callable[[np.random.Generator], Change]:
    form = next(item for item in LIBRARY_FORMS[name] if item.variant == variant)
    return lambda rng: form.build(size, rng, _NOWHERE)


def _slope(degrees: float, uphill: float) -> Callable[[np.random.Generator], Change]:
    angle = math.radians(degrees)
    steep = math.tan(angle)
    gradients = {"gradient_x": steep * math.cos(uphill), "gradient_y": steep * math.sin(uphill)}
    return lambda rng: Change({"angle": angle, "uphill": uphill}, plant=lambda p: with_ground(p, **gradients))


def _lateral(factor: float) -> Callable[[np.random.Generator], Change]:
    """All lateral wheel forces times a factor, for which the library has no effect."""
    return lambda rng: Change({"lateral": factor}, plant=lambda p: with_ground(p, lateral=factor))


def _patch(x: float, y: float, radius: float, logarithm: float) -> Callable[[np.random.Generator], Change]:
    row = patch_row(DISC, (x, y), radius, 0.0, logarithm)
    known = {"ln_strength": logarithm, "ln_stiffness": 1.5 * logarithm, "x": x, "y": y, "radius": radius}
    return lambda rng: Change(known, plant=lambda p: with_ground(p, patches=row))


TRUTHS = {
    item.name: item
    for item in (
        Truth("nothing", "nothing is different", "", lambda rng: Change()),
        Truth("slope", "slope of 3 degrees", "slope", _slope(3.0, 0.7), lambda k: {"direction": k["uphill"]}),
        Truth("delay", "commands 0.16 s late", "command_delay", _form("command_delay", "constant", 0.16)),
        Truth("split", "soil split by side, strength x 1.5", "soil_split", _form("soil_split", "both", 0.4)),
        Truth("payload", "payload of 50 kg", "payload", _form("payload", "low", 50.0)),
        Truth("radii", "wheel radii differ by 4 %", "wheel_radius_mismatch",
              _form("wheel_radius_mismatch", "banks", 0.04)),
        Truth("lag", "motors 0.3 s slower", "motor_lag", _form("motor_lag", "slower loop", 0.3)),
        Truth("towed", "towed drag of 120 N", "towed_drag", _form("towed_drag", "hitch", 120.0),
              lambda k: {"hitch_distance": -k["hitch_x"], "hitch_side": k["hitch_y"]}),
        Truth("patch", "soft patch, strength x 0.55", "soil_patch", _patch(0.9, 0.8, 0.9, -0.6),
              lambda k: {"centre_x": k["x"], "centre_y": k["y"], "radius": k["radius"], "edge": 0.06}),
        Truth("gyro", "gyro reads 6 % wrong", "gyro_scale", _form("gyro_scale", "constant", 0.06)),
        Truth("centre", "centre of mass 0.1 m off", "centre_of_mass_offset",
              _form("centre_of_mass_offset", "along", 0.1)),
        Truth("viscous", "viscous drag of 300 N s/m", "viscous_drag", _form("viscous_drag", "linear", 300.0)),
        Truth("weak_sideways", "lateral forces x 0.8", "", _lateral(0.8)),
        Truth("strong_sideways", "lateral forces x 1.2", "", _lateral(1.2)),
    )
}  # fmt: skip
"""The truths by name; sizes were fixed before the first run with them."""
