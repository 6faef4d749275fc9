"""What a set of pairs holds: what changed between three drives before and one after, drawn from the seed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.changed_pairs.robots import simulated_robot
from benchmarks.concealed.cases import ALL_STRUCTURES, MANOEUVRE_SETS, STRUCTURED_SHARE, STRUCTURES, Case
from benchmarks.concealed.catalogue import LIBRARY_FORMS, OPEN_PAIRS, OUTSIDE_FORMS, RESERVED_PAIRS
from benchmarks.concealed.change import Form
from benchmarks.concealed.streams import stream

SET = "pairs"
PLAIN_NULLS, STRUCTURAL_NULLS, DOUBLES, OUTSIDE, BEGINNING = 20, 20, 24, 24, 24
HIDDEN = ("payload", "viscous_drag", "slip_sinkage", "multipass", "soil_change")
"""Effects of load and soil that an uncertain soil hides: drawn more often than the others."""

FORMS: dict[str, list[Form]] = {
    name: [form for form in forms if (name, form.variant) != ("soil_change", "onset")]
    for name, forms in LIBRARY_FORMS.items()
}
"""Forms of each effect; not the soil that changes in the second of several drives."""

OF_HIDDEN, OF_OTHERS, SINGLES = 6, 2, 96
"""Singles of each hidden effect, at least of each other one, and in all."""

SWITCHED = (
    "command_delay", "motor_lag", "motor_droop", "payload", "wheel_radius_mismatch", "towed_drag", "viscous_drag",
    "soil_split", "gyro_bias", "gyro_scale", "imu_tilt", "encoder_scale",
)  # fmt: skip
"""Effects that may begin in mid-drive: those whose form needs no place on the path."""

EARLIEST, LATEST = 15.0, 45.0
"""Times between which an effect begins [s]."""


@dataclass(frozen=True)
class Pair:
    """Three drives before, one after.

    Attributes:
        case: what changed, on which kind of simulator; its number is that of the pair.
        begins: time of the drive after at which it begins [s]; None where it was there from the start.
        robot: key of :data:`benchmarks.changed_pairs.robots.ROBOTS`.
    """

    case: Case
    begins: float | None = None
    robot: str = "ddagr"

    @property
    def name(self) -> str:
        """Of the pair, unlike any of another robot."""
        return f"{'pair' if self.robot == 'ddagr' else self.robot}_{self.case.number:03d}"

    @property
    def kind(self) -> str:
        """As the case's, or "beginning"."""
        return self.case.kind if self.begins is None else "beginning"


Draft = tuple[str, tuple[Form, ...], float | None]


def _singles(rng: np.random.Generator) -> list[Draft]:
    others = [name for name in FORMS if name not in HIDDEN]
    further = rng.choice(others, SINGLES - OF_HIDDEN * len(HIDDEN) - OF_OTHERS * len(others), replace=False)
    counts = {name: OF_HIDDEN if name in HIDDEN else OF_OTHERS for name in FORMS}
    drafts: list[Draft] = []
    for name, forms in FORMS.items():
        order = rng.permutation(len(forms))
        count = counts[name] + int(name in further)
        drafts += [("single", (forms[order[k % len(forms)]],), None) for k in range(count)]
    return drafts


def _doubles(rng: np.random.Generator) -> list[Draft]:
    pool = OPEN_PAIRS + RESERVED_PAIRS
    chosen = [*pool, *(pool[k] for k in rng.choice(len(pool), DOUBLES - len(pool), replace=False))]
    return [("double", tuple(_form(rng, name) for name in pair), None) for pair in chosen]


def _form(rng: np.random.Generator, name: str) -> Form:
    return FORMS[name][int(rng.integers(len(FORMS[name])))]


def _beginning(rng: np.random.Generator) -> list[Draft]:
    names = [SWITCHED[k % len(SWITCHED)] for k in range(BEGINNING)]
    return [("single", (_form(rng, name),), float(rng.uniform(EARLIEST, LATEST))) for name in names]


def _drafts(rng: np.random.Generator) -> list[Draft]:
    nulls: list[Draft] = [("null", (), None)] * PLAIN_NULLS + [("structural null", (), None)] * STRUCTURAL_NULLS
    outside: list[Draft] = [
        ("outside", (OUTSIDE_FORMS[k],), None) for k in sorted(rng.choice(len(OUTSIDE_FORMS), OUTSIDE, replace=False))
    ]
    return nulls + _singles(rng) + _doubles(rng) + outside + _beginning(rng)


def _set_of(robot: str) -> str:
    """Name from which the numbers of a robot's set are drawn."""
    return SET if robot == "ddagr" else f"{SET} {robot}"


def plan(seed: int, robot: str = "ddagr") -> list[Pair]:
    """All pairs of a set, in the order of their numbers.

    Sizes are drawn evenly between half the least and the largest of the effect's form in the sets of single drives:
    what can be told of changes is smaller.

    Args:
        seed: any non-negative integer.
        robot: key of :data:`benchmarks.changed_pairs.robots.ROBOTS`.

    Raises:
        InputError: there is no such robot.
    """
    scaled, name = simulated_robot(robot), _set_of(robot)
    rng = stream(seed, name, "labels")
    drafts, structures, pairs = _drafts(rng), list(ALL_STRUCTURES)[1:], []
    for number, k in enumerate(rng.permutation(len(drafts)), start=1):
        kind, forms, begins = drafts[k]
        effects = tuple(
            (form, float(rng.uniform(0.5 * form.low, form.high)) * scaled.size_factor(form.name)) for form in forms
        )
        structure = structures[k % len(structures)] if kind == "structural null" else ""
        pairs.append(Pair(_complete(Case(name, number, kind, effects, structure), seed), begins, robot))
    return pairs


def _complete(case: Case, seed: int) -> Case:
    """Draw what does not depend on the label: manoeuvres, logging, structure of pairs in which something changes."""
    rng = stream(seed, case.set_name, case.number, "plan")
    manoeuvres, row = int(rng.integers(MANOEUVRE_SETS)), str(rng.choice(["issued", "acting"]))
    structure, structured = str(rng.choice(list(STRUCTURES)[1:])), bool(rng.random() < STRUCTURED_SHARE)
    case = replace(case, structure=structure) if case.effects and structured else case
    return replace(case, manoeuvres=manoeuvres, command_row=row)
