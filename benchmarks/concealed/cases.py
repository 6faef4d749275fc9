"""What a set holds: which case has which effects, drawn from the seed and shuffled."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .catalogue import (
    DRIVETRAIN,
    DRIVETRAIN_FORMS,
    DRIVETRAIN_PAIRS,
    LIBRARY_FORMS,
    OPEN_PAIRS,
    OUTSIDE_FORMS,
    RESERVED_PAIRS,
)
from .change import Form
from .ground import Ground, random_waves
from .plant import Body, Plant, nominal_plant
from .sensors import SensorNoise
from .soil import ELASTOPLASTIC, HUMP, SATURATING, TWO_STAGE, Soil
from .streams import stream
from .terrain_memory import HEIGHT_GRID

SETS = ("development", "sealed", "ninth")
"""The first eight sealed sets are "sealed"; the ninth has the drivetrain's later forms and more pairs with it."""
PLAIN_NULLS, STRUCTURAL_NULLS, SINGLES_PER_EFFECT, DOUBLES = 20, 20, 2, 10
DRIVETRAIN_DOUBLES, OTHER_DOUBLES = 8, 6
"""Doubles of the ninth set with an effect between command and wheel, and without one."""
OUTSIDE = {"development": (16, 0), "sealed": (8, 10), "ninth": (8, 10)}
"""(open, reserved) effects outside the library."""
MANOEUVRE_SETS = 8
STRUCTURED_SHARE = 0.2
"""Share of the cases with effects whose simulator also has one of the structural changes."""
RECEIVER_SHARE = 0.8

STRUCTURES: dict[str, dict[str, dict[str, Any]]] = {
    "": {},
    "rough": {
        "ground": {"relief_height": 0.003},
        "noise": {"accelerometer_per_speed": 0.45, "accelerometer_correlation": 0.8},
    },
    "hump shear": {"soil": {"shear_law": HUMP}},
    "elastoplastic shear": {"soil": {"shear_law": ELASTOPLASTIC}},
    "saturating pressure": {"soil": {"pressure_law": SATURATING}},
    "two-stage pressure": {"soil": {"pressure_law": TWO_STAGE, "exit_ratio": 0.75}},
    "patchy": {"ground": {"strength_spread": 0.07, "stiffness_spread": 0.1}},
    "soft frame": {"body": {"torsion": 4000.0, "transfer_time": 0.3, "soil_damping": 20000.0}},
    "all laws": {
        "soil": {"pressure_law": SATURATING, "shear_law": HUMP, "rate_gain": 0.08},
        "ground": {"strength_spread": 0.05},
    },
}
"""Structural changes of the simulator by name: fields of soil, ground, body and noise."""

LATER_STRUCTURES: dict[str, dict[str, dict[str, Any]]] = {
    "ruts that stay": {"ground": {"rut_mode": HEIGHT_GRID, "rebound": 0.2}},
}
"""Structural changes that came after the first sets, whose draws must stay as they are."""

ALL_STRUCTURES = STRUCTURES | LATER_STRUCTURES
"""Whatever a case may have."""


@dataclass(frozen=True)
class Case:
    """One case of a set.

    Attributes:
        set_name: of :data:`SETS`.
        number: from 1, after shuffling.
        kind: "null", "structural null", "single", "double" or "outside".
        effects: (form, multiple of the least meaningful size), at most two.
        structure: name of a structural change of the simulator, "" for none.
        manoeuvres: number of the manoeuvre set.
        receiver: whether poses are logged.
        command_row: "issued" where a row holds the command sent at its time, "acting" where it holds the one that
            acted during the sample just ended, as a logger that runs after the controller writes it.
    """

    set_name: str
    number: int
    kind: str
    effects: tuple[tuple[Form, float], ...]
    structure: str = ""
    manoeuvres: int = 0
    receiver: bool = True
    command_row: str = "issued"

    @property
    def name(self) -> str:
        """Folder of the case."""
        return f"case_{self.number:03d}"

    @property
    def verdict(self) -> list[str]:
        """The right answer, in the words of the verdict."""
        if not self.effects:
            return ["none"]
        return ["unknown"] if self.kind == "outside" else [form.name for form, _ in self.effects]


Draft = tuple[str, tuple[Form, ...]]


def _singles(rng: np.random.Generator) -> list[Draft]:
    """Every effect ``SINGLES_PER_EFFECT`` times, in different forms as far as there are any."""
    drafts: list[Draft] = []
    for forms in LIBRARY_FORMS.values():
        order = rng.permutation(len(forms))
        drafts += [("single", (forms[order[k % len(forms)]],)) for k in range(SINGLES_PER_EFFECT)]
    return drafts


def _doubles(set_name: str, rng: np.random.Generator) -> list[Draft]:
    pool = OPEN_PAIRS if set_name == "development" else OPEN_PAIRS + RESERVED_PAIRS
    chosen = [pool[k] for k in sorted(rng.choice(len(pool), DOUBLES, replace=False))]
    forms = [tuple(LIBRARY_FORMS[name][rng.integers(len(LIBRARY_FORMS[name]))] for name in pair) for pair in chosen]
    return [("double", pair) for pair in forms]


def _drivetrain_singles() -> list[Draft]:
    """Every later form of the drivetrain once."""
    return [("single", (form,)) for forms in DRIVETRAIN_FORMS.values() for form in forms]


def _ninth_doubles(rng: np.random.Generator) -> list[Draft]:
    """Pairs with and without the drivetrain; every other one of the former has a later form of it."""
    pool = OPEN_PAIRS + RESERVED_PAIRS + DRIVETRAIN_PAIRS
    driven = [pair for pair in pool if set(pair) & set(DRIVETRAIN)]
    others = [pair for pair in pool if not set(pair) & set(DRIVETRAIN)]
    chosen = [driven[k] for k in rng.choice(len(driven), DRIVETRAIN_DOUBLES, replace=False)]
    chosen += [others[k] for k in rng.choice(len(others), OTHER_DOUBLES, replace=False)]
    return [("double", _forms_of(pair, k % 2 == 0, rng)) for k, pair in enumerate(chosen)]


def _forms_of(pair: tuple[str, str], later: bool, rng: np.random.Generator) -> tuple[Form, ...]:
    """A form of each effect; of the drivetrain's a later one where that is asked for."""
    pools = [DRIVETRAIN_FORMS[name] if later and name in DRIVETRAIN else LIBRARY_FORMS[name] for name in pair]
    return tuple(pool[rng.integers(len(pool))] for pool in pools)


def _outside(set_name: str, rng: np.random.Generator) -> list[Draft]:
    drafts: list[Draft] = []
    for reserved, count in zip((False, True), OUTSIDE[set_name], strict=True):
        pool = [form for form in OUTSIDE_FORMS if form.reserved == reserved]
        drafts += [("outside", (pool[k],)) for k in sorted(rng.choice(len(pool), count, replace=False))]
    return drafts


def _complete(case: Case, seed: int) -> Case:
    """Draw what does not depend on the label: manoeuvres, receiver, logging, structure of cases with effects."""
    rng = stream(seed, case.set_name, case.number, "plan")
    manoeuvres, receiver = int(rng.integers(MANOEUVRE_SETS)), bool(rng.random() < RECEIVER_SHARE)
    structure, structured = str(rng.choice(list(STRUCTURES)[1:])), bool(rng.random() < STRUCTURED_SHARE)
    row = str(rng.choice(["issued", "acting"]))
    needed = any(form.needs_pose for form, _ in case.effects)
    if case.effects and structured:
        case = replace(case, structure=structure)
    return replace(case, manoeuvres=manoeuvres, receiver=receiver or needed, command_row=row)


def plan(set_name: str, seed: int) -> list[Case]:
    """All cases of a set, in the order of their numbers.

    Args:
        set_name: of :data:`SETS`.
        seed: any non-negative integer.
    """
    rng = stream(seed, set_name, "labels")
    drafts: list[Draft] = [("null", ())] * PLAIN_NULLS + [("structural null", ())] * STRUCTURAL_NULLS
    drafts += _singles(rng)
    drafts += _drivetrain_singles() + _ninth_doubles(rng) if set_name == "ninth" else _doubles(set_name, rng)
    drafts += _outside(set_name, rng)
    structures, cases = list(STRUCTURES)[1:], []
    for number, k in enumerate(rng.permutation(len(drafts)), start=1):
        kind, forms = drafts[k]
        effects = tuple((form, float(rng.uniform(form.low, form.high))) for form in forms)
        structure = structures[k % len(structures)] if kind == "structural null" else ""
        cases.append(_complete(Case(set_name, number, kind, effects, structure), seed))
    return cases


def counts(set_name: str) -> dict[str, int]:
    """Cases of each kind in a set; the same for every seed.

    Args:
        set_name: of :data:`SETS`.
    """
    return dict(Counter(case.kind for case in plan(set_name, 0)))


def _field_soil(rng: np.random.Generator, changes: dict[str, Any]) -> Soil:
    """The nominal soil, off by some ten per cent in strength and stiffness."""
    soil = Soil()
    return soil._replace(
        strength=float(np.exp(0.1 * rng.standard_normal())),
        stiffness=float(np.exp(0.12 * rng.standard_normal())),
        shear_length=soil.shear_length * float(np.exp(0.1 * rng.standard_normal())),
        friction_angle=soil.friction_angle * float(np.exp(0.06 * rng.standard_normal())),
        exponent=soil.exponent * float(np.exp(0.05 * rng.standard_normal())),
        exit_ratio=float(np.clip(soil.exit_ratio + 0.03 * rng.standard_normal(), 0.75, 0.98)),
    )._replace(**changes)


def field_plant(case: Case, seed: int) -> Plant:
    """The robot on the case's own field, without its effects."""
    rng = stream(seed, case.set_name, case.number, "soil")
    changes = ALL_STRUCTURES[case.structure]
    soil = _field_soil(rng, changes.get("soil", {}))
    spread = rng.uniform(0.02, 0.04, 2)
    length = rng.uniform(0.8, 3.0, 2)
    ground = Ground(
        strength_waves=random_waves(rng, length[0]),
        stiffness_waves=random_waves(rng, length[1]),
        relief_waves=random_waves(rng, 0.45),
        strength_spread=float(spread[0]),
        stiffness_spread=float(spread[1]),
    )._replace(**changes.get("ground", {}))
    return nominal_plant(soil, ground)._replace(body=Body()._replace(**changes.get("body", {})))


def field_noise(case: Case, seed: int) -> SensorNoise:
    """The case's sensor noise."""
    rng = stream(seed, case.set_name, case.number, "noise level")
    noise = SensorNoise(
        accelerometer=rng.uniform(0.025, 0.04),
        accelerometer_per_speed=rng.uniform(0.2, 0.35),
        accelerometer_correlation=rng.uniform(0.45, 0.75),
        accelerometer_offset=tuple(0.006 * rng.standard_normal(2)),
        gyro_offset=1.5e-4 * rng.standard_normal(),
    )
    return replace(noise, **ALL_STRUCTURES[case.structure].get("noise", {}))
