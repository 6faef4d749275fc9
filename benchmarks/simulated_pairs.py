"""How much the sizes of effects differ between two drives in which nothing changed: pairs of simulated ones.

    python -m benchmarks.simulated_pairs [--pairs N] [--summary]

Every pair has a world of its own (:mod:`ddagr_gym.diagnosis.null_bank.structural_variants`: other pressure and shear
laws, speed loops, relief, rough and patchy ground, readings and noise), in which the robot drives twice, and a second
world of another kind in which it drives once; its motors differ from one day to another. One robot and soil are fitted
to the first drive, as ``ddagr diagnose --before`` does, and all three are scanned with them. From the differences
between drives on the same ground and on two grounds equation (1) of
:mod:`ddagr_gym.diagnosis.change.measured_scatter` gives the scatter of each effect, never less than a fifth of the
least size that matters; degrees of freedom are the most with which no more than 5 % of the pairs raise an alarm.

Between drives on one ground :mod:`benchmarks.independent_pairs` counts too: the larger scatter of the two, the fewer
degrees of freedom, and what it alone measures.

Written are the differences and a picture (``benchmarks/results/simulated_pairs.json``, ``.png``) and what the package
ships (``ddagr_gym/data/change_scatter.json``). ``--summary`` only makes the latter two of the former. A run goes on
after the pairs that the file holds.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.independent_pairs import RESULT as INDEPENDENT
from benchmarks.pair_scatter import DEGREES, MOST, least_scatter, log_density, most_likely, rounded
from ddagr_gym.diagnosis.change.before_drives import DAY, WINDOW, JointFit, day_parameters, joint_fit
from ddagr_gym.diagnosis.change.drive_fit import change_problem, change_windows, fit_nominal
from ddagr_gym.diagnosis.change.drive_scan import DriveScan, Priors, scan_drive
from ddagr_gym.diagnosis.change.ground_slope import deviations_of, effects_of
from ddagr_gym.diagnosis.change.measured_scatter import PATH
from ddagr_gym.diagnosis.change.ordinary import Scores, uncertain_parameters
from ddagr_gym.diagnosis.change.shifts import LEVEL, distance_at, family_probability, probability_of, single_level
from ddagr_gym.diagnosis.change.sizes import sizes_of
from ddagr_gym.diagnosis.null_bank.drives import Template, null_recordings
from ddagr_gym.diagnosis.null_bank.standard_drives import standard_template
from ddagr_gym.diagnosis.null_bank.structural_variants import KINDS
from ddagr_gym.diagnosis.preprocessing.mended_recordings import mend_recordings
from ddagr_gym.diagnosis.result.detectable import least_multiple
from ddagr_gym.diagnosis.wording import title
from ddagr_gym.files import write_json
from ddagr_gym.identification.parameters import ModelParameter
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

Array = NDArray[np.float64]

RESULT = Path(__file__).resolve().parent / "results" / "simulated_pairs.json"
SEED = 7
DIGITS = 5
"""Of the differences that are written."""
SAME, OTHER = "same_ground", "other_ground"


@dataclass(frozen=True, eq=False)
class Difference:
    """Sizes of one candidate in two drives, one less the other, in least sizes that matter.

    Attributes:
        pair: number.
        effect: name.
        has_sizes: False for a limit or a sign.
        value: (k,).
        covariance: (k, k) within both drives, and expected of robot and soil.
    """

    pair: int
    effect: str
    has_sizes: bool
    value: Array
    covariance: Array

    @property
    def least(self) -> float:
        """Scatter below which none counts."""
        return least_scatter(self.has_sizes)

    def distance(self, scatter: float) -> float:
        """In standard deviations of all that is expected; of what is there or not none below nothing."""
        if not self.has_sizes and self.value[0] <= 0.0:
            return 0.0
        return math.sqrt(float(self.value @ np.linalg.solve(self._whole(scatter), self.value)))

    def probability(self, scatter: float, degrees: float) -> float:
        """Of such a difference or a larger one."""
        return probability_of(self.has_sizes, self.value, self._whole(scatter), degrees)

    def log_density(self, scatter: float, degrees: float) -> float:
        """Of the multivariate t distribution."""
        return log_density(self.value, self._whole(scatter), degrees)

    def _whole(self, scatter: float) -> Array:
        return np.asarray(self.covariance + 2.0 * scatter**2 * np.eye(len(self.value)))


def drives_of(number: int, robot: Robot, soil: Soil) -> tuple[Recording, Recording, Recording]:
    """Two drives in one world, and one in a world of another kind."""
    rng = np.random.default_rng([SEED, number])
    first, second, third = (standard_template(robot, rng) for _ in range(3))
    chosen = (first.commands[2], second.commands[1 + number % 2], third.commands[1 + (number + 1) % 2])
    here, other = (KINDS[k % len(KINDS)] for k in (number, 3 * number + 5))
    before, after = null_recordings(robot, soil, _driving(first, chosen[:2]), here, rng)
    (elsewhere,) = null_recordings(_another_day(robot, rng), soil, _driving(first, chosen[2:]), other, rng)
    named = [r.with_meta(source=f"pair {number}, {name}") for r, name in ((before, "before"), (after, "after"))]
    return named[0], named[1], elsewhere.with_meta(source=f"pair {number}, elsewhere")


def _driving(template: Template, commands: Sequence[Array]) -> Template:
    count = len(commands)
    return replace(template, commands=tuple(commands), present=template.present[:count], starts=template.starts[:count])


def _another_day(robot: Robot, rng: np.random.Generator) -> Robot:
    return replace(robot, motor_rate=robot.motor_rate * float(np.exp(DAY["motor_rate"] * rng.normal())))


def pair_of(number: int, robot: Robot, soil: Soil) -> dict[str, Any]:
    """Differences of a pair of drives on the same ground, and on two."""
    before, after, elsewhere = drives_of(number, robot, soil)
    joint = joint_fit(mend_recordings([before]), robot, soil, WINDOW, np.random.default_rng(number), 1)
    scans = [_scan(joint, drive) for drive in (before, after, elsewhere)]
    same = _differences(scans[0], scans[1], None)
    wide = _uncertain(joint, None)
    other = _differences(scans[0], scans[2], np.array([p.prior for p in wide]))
    return {"pair": number, "kind": KINDS[number % len(KINDS)], SAME: same, OTHER: other}


def _scan(joint: JointFit, drive: Recording) -> DriveScan:
    windows = change_windows(mend_recordings([drive]).recordings, joint.robot, joint.weighing)
    parameters = _uncertain(joint, joint.same_ground)
    known = effects_of(joint.slope)
    problem = change_problem(joint.robot, joint.soil, windows, parameters, joint.weighing, 1, known)
    return scan_drive(problem, fit_nominal(problem))


def _uncertain(joint: JointFit, soil: Mapping[str, float] | None) -> tuple[ModelParameter, ...]:
    slopes = deviations_of(joint.slope)
    return uncertain_parameters(joint.soil, day_parameters(joint.robot), soil, joint.weighing, 1, slopes)


def _priors(scan: DriveScan, deviations: Array | None) -> Priors | None:
    """Of what may differ between drives, about the values that the fit expects; those of the fit where None."""
    return None if deviations is None else Priors(deviations[scan.free], np.zeros(len(scan.free)))


def _differences(one: DriveScan, two: DriveScan, deviations: Array | None) -> list[dict[str, Any]]:
    """Differences of all candidates that both drives show, as JSON has them."""
    scores: list[Scores] = [scan.scores(_priors(scan, deviations)) for scan in (one, two)]
    found = []
    for item in two.compared:
        if not set(item.keys) <= set(scores[0].keys):
            continue
        first, second = (sizes_of(drive, item.keys, item.ridge) for drive in scores)
        if first is None or second is None:
            continue
        least = np.array([least_multiple(item.candidate, k) for k in range(len(item.keys))])
        covariance = first.within + second.within + first.between + second.between
        found.append(
            {
                "effect": item.name,
                "has_sizes": item.candidate.has_sizes,
                "value": rounded((second.value - first.value) / least, DIGITS),
                "covariance": [rounded(row, DIGITS) for row in covariance / np.outer(least, least)],
            }
        )
    return found


def differences(pairs: Iterable[dict[str, Any]], ground: str) -> list[Difference]:
    """All differences of pairs on the same ground, or on two."""
    return [
        Difference(
            pair["pair"], item["effect"], item["has_sizes"], np.array(item["value"]), np.array(item["covariance"])
        )
        for pair in pairs
        for item in pair[ground]
    ]


def fitted_scatter(found: Sequence[Difference]) -> tuple[dict[str, float], float]:
    """Scatter of each effect by maximum likelihood, and the most degrees of freedom that keep the level of alarms."""
    by_effect: dict[str, list[Difference]] = {}
    for item in found:
        by_effect.setdefault(item.effect, []).append(item)
    for degrees in DEGREES:
        deviations = {name: _best_scatter(items, degrees) for name, items in by_effect.items()}
        if alarms(found, deviations, degrees) <= LEVEL:
            break
    return deviations, degrees


def _best_scatter(items: Sequence[Difference], degrees: float) -> float:
    """Scatter of one effect."""
    return most_likely(items[0].least, MOST, lambda scatter: sum(item.log_density(scatter, degrees) for item in items))


def alarms(found: Sequence[Difference], deviations: dict[str, float], degrees: float) -> float:
    """Share of pairs of which any candidate is out of the ordinary."""
    smallest: dict[int, tuple[float, int]] = {}
    for item in found:
        probability, tests = smallest.get(item.pair, (1.0, 0))
        own = item.probability(deviations.get(item.effect, item.least), degrees)
        smallest[item.pair] = (min(probability, own), tests + 1)
    raised = [family_probability(probability, tests) < LEVEL for probability, tests in smallest.values()]
    return float(np.mean(raised))


def summary(pairs: Sequence[dict[str, Any]], ground: str) -> dict[str, Any]:
    """What the package ships of one kind of pairs; alarms of each half of them with the scatter of the other."""
    found = differences(pairs, ground)
    deviations, degrees = fitted_scatter(found)
    crossed = []
    for half in (0, 1):
        mine = [item for item in found if item.pair % 4 // 2 == half]
        others = fitted_scatter([item for item in found if item.pair % 4 // 2 != half])
        crossed.append(alarms(mine, *others))
    return {
        "degrees": degrees,
        "deviations": {name: float(f"{value:.3g}") for name, value in sorted(deviations.items())},
        "false_alarms": alarms(found, deviations, degrees),
        "false_alarms_crossed": float(np.mean(crossed)),
    }


def draw(pairs: Sequence[dict[str, Any]], shipped: dict[str, Any], path: Path) -> None:
    """Differences of every effect as they were measured, over the deviations that are expected of them."""
    from matplotlib.figure import Figure

    names = sorted(shipped[SAME]["deviations"], key=title, reverse=True)
    with house_style():
        figure = Figure(figsize=(10.0, 1.0 + 0.26 * len(names)), layout="constrained")
        for axis, ground in zip(figure.subplots(1, 2, sharey=True), (SAME, OTHER), strict=True):
            found, deviations = differences(pairs, ground), shipped[ground]["deviations"]
            limit = distance_at(single_level(len(found) // len(pairs)), 1, shipped[ground]["degrees"])
            for item in found:
                distance = item.distance(deviations.get(item.effect, item.least))
                axis.plot(distance, names.index(item.effect), "o", ms=3, color=palette.BLUE, alpha=0.4)
            axis.axvline(limit, color=palette.INK, lw=0.9)
            axis.set_title(f"{ground.replace('_', ' ')}: {shipped[ground]['degrees']:g} degrees of freedom")
            axis.set_yticks(range(len(names)), [title(name) for name in names])
            axis.set_xlabel("difference, in expected deviations (line: limit)")
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=110))


def with_independent(own: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    """What is shipped of drives on one ground, from pairs of both simulators.

    Args:
        own: :func:`summary` of the package's.
        other: of :func:`benchmarks.independent_pairs.summary`.
    """
    names = sorted({*own["deviations"], *other["deviations"]})
    larger = {name: max(item["deviations"].get(name, 0.0) for item in (own, other)) for name in names}
    return {
        **own,
        "degrees": min(own["degrees"], other["degrees"]),
        "deviations": larger,
        "moves": other["moves"],
        "rises": other["rises"],
        "independent_false_alarms": other["false_alarms"],
        "independent_false_alarms_crossed": other["false_alarms_crossed"],
    }


def write_summary(pairs: Sequence[dict[str, Any]]) -> None:
    """Write what the package ships, and the picture."""
    shipped: dict[str, Any] = {
        "command": "python -m benchmarks.simulated_pairs",
        "robot": "ddagr",
        "soil": "thesis_a1",
        "window": WINDOW,
        "pairs": len(pairs),
        **{ground: summary(pairs, ground) for ground in (SAME, OTHER)},
    }
    shipped[SAME] = with_independent(shipped[SAME], json.loads(INDEPENDENT.read_text(encoding="utf-8")))
    write_json(PATH, shipped)
    draw(pairs, shipped, RESULT.with_suffix(".png"))
    for ground in (SAME, OTHER):
        print(ground, {name: shipped[ground][name] for name in ("degrees", "false_alarms", "false_alarms_crossed")})


def main(arguments: Sequence[str] | None = None) -> None:
    """Drive, scan and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=40, help="number of pairs")
    parser.add_argument("--summary", action="store_true", help="only of the pairs that are written already")
    given = parser.parse_args(arguments)
    pairs: list[dict[str, Any]] = json.loads(RESULT.read_text())["pairs"] if RESULT.exists() else []
    robot, soil = get_robot("ddagr"), get_soil("thesis_a1")
    for number in range(len(pairs), 0 if given.summary else given.pairs):
        pairs.append(pair_of(number, robot, soil))
        write_json(RESULT, {"command": "python -m benchmarks.simulated_pairs", "pairs": pairs})
        print(f"pair {number + 1} of {given.pairs}", flush=True)
    write_summary(pairs)


if __name__ == "__main__":
    main()
