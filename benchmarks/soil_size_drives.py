"""Drives over two soils with known truth: of the package's simulator, and of the concealed benchmark's own.

Sizes and the forces of a wheel on either soil are known in both. The second simulator has other laws of pressure and
shear, so that its forces at the same sizes are others.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

import ddagr_gym
from benchmarks.concealed.cases import STRUCTURES, Case, field_plant
from benchmarks.concealed.mechanics import local_soil
from benchmarks.concealed.wheel import static_wheel
from benchmarks.mid_drive_drives import ALWAYS, BEGINS, Switched, recording_of
from ddagr_gym.diagnosis.answer.soil_at_work import WorkingPoint
from ddagr_gym.diagnosis.result.soil_at_work import wheel_at
from ddagr_gym.identification.fitted_values import with_values
from ddagr_gym.parameters import Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.soil_change import SoilChange
from ddagr_gym.physics.effects.soil_split import SoilSplit
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording

ROBOT = "ddagr"
OWN, OTHER = "package's simulator", "another simulator"
SEED = 7000
BEGIN = 30.0
"""Time from which a changed soil holds [s]."""

Wheels = Callable[[WorkingPoint], list[list[float]]]
"""Function that gives what a wheel does at a working point on both soils, as the diagnosis orders it."""

_FIELD = {
    "soil_strength": 0.1,
    "soil_stiffness": 0.12,
    "shear_modulus": 0.1,
    "friction": 0.06,
    "sinkage_exponent": 0.05,
}
"""Deviations of a field's soil from the nominal one, of logarithms."""

_OWN = (("thesis_a1", "arcs"), ("lete_sand_wong", "s_weave"), ("upland_sandy_loam_wong_51", "arcs"))
"""Soils and manoeuvres, in turn."""

_FORMS = (("both", 4.5), ("strength", 4.0), ("stiffness", 5.0), ("both", 6.0))
"""Forms and sizes of a soil that differs from side to side, in turn, in the least that is meaningful."""


@dataclass(frozen=True)
class TwoSoils:
    """A drive over two soils.

    Attributes:
        name: of the drive.
        simulator: OWN or OTHER.
        structure: what else is another in the second simulator; a soil for the first.
        recording: of the drive.
        soil: nominal one.
        truth: the effect at its true sizes.
        wheels: what a wheel truly does.
    """

    name: str
    simulator: str
    structure: str
    recording: Recording
    soil: Soil
    truth: Effect
    wheels: Wheels


def own_drive(number: int) -> TwoSoils:
    """A drive in the package's simulator, on a field that is not the nominal one."""
    rng = np.random.default_rng([SEED, number])
    name, manoeuvre = _OWN[number % len(_OWN)]
    nominal, robot = get_soil(name), get_robot(ROBOT)
    field = {key: deviation * float(rng.normal()) for key, deviation in _FIELD.items()}
    strength, stiffness = (math.exp(rng.choice([-1.0, 1.0]) * rng.uniform(*span)) for span in ((0.2, 0.6), (0.0, 0.8)))
    effect = SoilSplit(strength, stiffness)
    soil = with_values(robot, nominal, field)[1]
    drive = ddagr_gym.simulate(manoeuvre, robot, soil, effect, rate=50.0, pose_rate=5.0, seed=number)
    soils = [with_values(robot, nominal, {**field, **_more(field, *factors)})[1] for factors in effect.soils.values()]
    return TwoSoils(
        f"own {number}", OWN, name, drive.recording, nominal, effect,
        lambda point: [wheel_at(robot.wheels[0], item, point) for item in soils],
    )  # fmt: skip


def _more(field: dict[str, float], strength: float, stiffness: float) -> dict[str, float]:
    return {
        "soil_strength": field["soil_strength"] + math.log(strength),
        "soil_stiffness": field["soil_stiffness"] + math.log(stiffness),
    }


def split_drive(number: int) -> TwoSoils:
    """A drive in the other simulator over soil that differs from side to side."""
    variant, multiple = _FORMS[number % len(_FORMS)]
    item = Switched(SEED + number, "soil_split", variant, multiple, ALWAYS, 0.0, _structure(number))
    sizes = item.change().parameters
    ratios = (math.exp(-sizes["ln_strength_ratio"]), math.exp(-sizes["ln_stiffness_ratio"]))
    return _other(item, SoilSplit(*ratios))


def changed_drive(number: int) -> TwoSoils:
    """A drive in the other simulator in which the soil changes."""
    item = Switched(SEED + 500 + number, "soil_change", "everything", 5.0, BEGINS, BEGIN, _structure(number))
    sizes = item.change().parameters
    return _other(item, SoilChange(math.exp(sizes["ln_strength"]), math.exp(sizes["ln_stiffness"]), BEGIN))


def _structure(number: int) -> str:
    structures = list(STRUCTURES)
    return structures[number % len(structures)]


def _other(item: Switched, truth: Effect) -> TwoSoils:
    case = Case("development", item.seed, "single", ((item.form, item.multiple),), item.structure, item.seed % 8)
    plant = field_plant(case, item.seed)
    wheel = (plant.wheels.minor_radius, plant.wheels.half_width, float(plant.wheels.major_radius[0]))
    soils = [local_soil(plant.soil, *factors) for factors in truth.soils.values()]

    def at(soil: object, point: WorkingPoint) -> list[float]:
        radius = wheel[0] + wheel[2]
        slide, spin = point.speed * math.tan(point.slip_angle), point.speed / (radius * (1.0 - point.slip))
        sinkage, force = static_wheel(soil, wheel, point.load, point.speed, slide, spin, 0.0)
        return [float(force[4]) / radius, float(force[0]), abs(float(force[1])), sinkage]

    return TwoSoils(
        item.name, OTHER, item.structure, recording_of(item, get_robot(ROBOT)), get_soil("thesis_a1"), truth,
        lambda point: [at(soil, point) for soil in soils],
    )  # fmt: skip


def start_of(drive: TwoSoils) -> Effect:
    """Where a fit begins: no difference, at the true time."""
    return replace(drive.truth, strength=1.0, stiffness=1.0)  # type: ignore[call-arg]
