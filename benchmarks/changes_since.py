"""Changes written into simulated drives, and pairs in which nothing changed: what ``ddagr diagnose --before`` says.

    python -m benchmarks.changes_since [--summary]

A change is written into one drive of 60 s, on another day than the drive before it: soil and motors differ a little.
Nulls are pairs of structurally different worlds (:mod:`benchmarks.simulated_pairs`, of numbers that the shipped scatter
was not measured with), on the same ground and on two grounds; and pairs with something that the nominal robot lacks
before as after, such as a slope of the field, driven in another way each time. Written are the answers and a picture
(``benchmarks/results/changes_since.json``, ``.png``); a run goes on after the cases that the file holds.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import ddagr_gym
from benchmarks.simulated_pairs import drives_of
from benchmarks.simulated_robots import steps, stronger
from ddagr_gym.diagnosis.answer.verdict import NONE, Diagnosis
from ddagr_gym.diagnosis.change.run import what_changed_since
from ddagr_gym.files import write_json
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

RESULT = Path(__file__).resolve().parent / "results" / "changes_since.json"
SEED = 11
RATE = 25.0
SECONDS = 60.0
SOIL, MOTORS = 0.03, 0.03
"""Deviations of the logarithms of the soil's strength and of the motors' rate from day to day."""

CHANGES = (
    ("gyro_bias=0.02", "gyro_bias", "bias", 0.02),
    ("gyro_bias=0.008", "gyro_bias", "bias", 0.008),
    ("encoder_scale=1.08", "encoder_scale", "right", 0.08),
    ("encoder_scale=1.03", "encoder_scale", "right", 0.03),
    ("imu_misalignment=0.25", "imu_misalignment", "yaw", 0.25),
    ("motor_lag=0.15", "motor_lag", "lag", 0.15),
    ("command_delay=0.15", "command_delay", "delay", 0.15),
    ("payload=25", "payload", "mass", 25.0),
    ("payload=60", "payload", "mass", 60.0),
    ("soil_change=0.6", "soil_change", "strength", -0.4),
)
"""As it is written, its name, its size, and how far that is from neutral."""

NULLS = range(100, 103)
"""Numbers of pairs in which nothing changed."""

COMMON = (
    "slope=0.06,direction=0.8",
    "slope=0.04,direction=2.5",
    "slope=0.1,direction=-1",
    "towed_drag=150",
    "payload=30",
    "centre_of_mass_offset=0.1",
    "multipass=1",
    "lateral_bulldozing=4",
    "soil_split=0.7",
    "viscous_drag=100",
    "command_delay=0.15",
    "imu_misalignment=0.2",
    "encoder_scale=1.05",
)
"""What the nominal robot or its ground lacks before as after."""

FIRST_COMMON = 200
"""Number of the first of these pairs."""


@dataclass(frozen=True, eq=False)
class Case:
    """Drives to compare, and what changed.

    Attributes:
        name: of the case.
        same_ground: whether both are on one ground.
        drives: gives the drive before and the one after.
        truth: name of the effect; "none" where nothing changed.
        field: of its size.
        size: distance from neutral.
    """

    name: str
    same_ground: bool
    drives: Callable[[], tuple[Recording, Recording]]
    truth: str = NONE
    field: str = ""
    size: float = 0.0


def drive(seed: int, effect: str = "", seconds: float = SECONDS) -> Recording:
    """A drive on a day of its own: commands held for 2 to 4 s, soil and motors that differ a little.

    Args:
        seed: of everything random.
        effect: that acts in it, as ``ddagr simulate --effect`` takes it.
        seconds: that it lasts.
    """
    rng = np.random.default_rng([SEED, seed])
    robot, soil = get_robot("ddagr"), get_soil("thesis_a1")
    robot = replace(robot, motor_rate=robot.motor_rate * float(np.exp(MOTORS * rng.normal())))
    soil = stronger(soil, float(np.exp(SOIL * rng.normal())))
    commands = steps(rng, seconds, 4.0, RATE)
    effects = (effect,) if effect else ()
    made = ddagr_gym.simulate(commands, robot, soil, effects, rate=RATE, pose_rate=5.0, seed=seed)
    return made.recording.with_meta(source=f"drive_{seed}")


def _changed(number: int, effect: str) -> tuple[Recording, Recording]:
    return drive(2 * number), drive(2 * number + 1, effect)


def _in_both(number: int, effect: str) -> tuple[Recording, Recording]:
    return drive(2 * number, effect), drive(2 * number + 1, effect)


def _ordinary(number: int, same_ground: bool) -> tuple[Recording, Recording]:
    before, after, elsewhere = drives_of(number, get_robot("ddagr"), get_soil("thesis_a1"))
    return before, after if same_ground else elsewhere


def cases() -> list[Case]:
    """All cases in their order."""
    changes = [
        Case(effect, True, partial(_changed, number, effect), name, field, size)
        for number, (effect, name, field, size) in enumerate(CHANGES)
    ]
    nulls = [
        Case(
            f"nothing, pair {number}, {'same ground' if same else 'two grounds'}",
            same,
            partial(_ordinary, number, same),
        )
        for number in NULLS
        for same in (True, False)
    ]
    common = [
        Case(f"before and after: {effect}", True, partial(_in_both, FIRST_COMMON + number, effect))
        for number, effect in enumerate(COMMON)
    ]
    return [*changes, *nulls, *common]


def answer(case: Case) -> dict[str, Any]:
    """What is said of a case, as JSON has it."""
    before, after = case.drives()
    robot, soil = get_robot("ddagr"), get_soil("thesis_a1")
    diagnosis = what_changed_since([after], [before], robot, soil, same_ground=case.same_ground)[0].diagnosis
    return {"case": case.name, "truth": case.truth, "size": case.size, **_said(diagnosis, case)}


def _said(diagnosis: Diagnosis, case: Case) -> dict[str, Any]:
    change = diagnosis.change
    if change is None or change.certificate is None:
        raise ValueError("drives from before come with a certificate")
    sizes = {item.effect: item.sizes for item in change.shifts}
    named = {finding.name: finding.parameters for finding in diagnosis.findings}
    interval = named[case.truth][case.field].interval if case.truth in named else None
    neutral = 1.0 if case.truth in ("encoder_scale", "soil_change") else 0.0
    return {
        "verdict": list(diagnosis.verdict),
        "complete": diagnosis.complete,
        "in_set": any(case.truth in finding.equivalence_set for finding in diagnosis.findings),
        "interval": None if interval is None else [end - neutral for end in interval],
        "least_detectable": sizes[case.truth][case.field].least_detectable if case.truth in sizes else None,
        "largest": max(item.distance / item.limit for item in change.shifts),
        "windows": change.certificate.windows,
        "as_well": change.certificate.as_well,
        "as_well_without": change.certificate.as_well_without,
        "seconds": round(diagnosis.seconds, 1),
    }


def draw(answers: Sequence[dict[str, Any]], path: Path) -> None:
    """Truth, least detectable change and interval of each change; largest shift over its limit of each null."""
    from matplotlib.figure import Figure

    changes = [item for item in reversed(answers) if item["truth"] != NONE]
    nulls = [item for item in reversed(answers) if item["truth"] == NONE]
    with house_style():
        figure = Figure(figsize=(10.0, 0.8 + 0.34 * max(len(changes), len(nulls))), layout="constrained")
        left, right = figure.subplots(1, 2)
        for place, item in enumerate(changes):
            size = item["size"]
            left.plot(1.0, place, "|", ms=14, color=palette.INK)
            if item["least_detectable"] is not None:
                left.plot(item["least_detectable"] / abs(size), place, "x", color=palette.GREY)
            if item["interval"] is not None:
                ends = [end / size for end in item["interval"]]
                left.plot(ends, [place, place], color=palette.BLUE, lw=4.0, alpha=0.6)
        left.set_yticks(range(len(changes)), [_label(item) for item in changes])
        left.set_xlabel("over the true change: interval (bar), least detectable (cross)")
        for place, item in enumerate(nulls):
            colour = palette.BLUE if item["verdict"] == [NONE] else palette.VERMILLION
            right.barh(place, item["largest"], 0.6, color=colour)
        right.axvline(1.0, color=palette.INK, lw=0.9)
        right.set_yticks(range(len(nulls)), [item["case"] for item in nulls])
        right.set_xlabel("nothing changed: largest shift over its limit")
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=110))


def _label(item: dict[str, Any]) -> str:
    right = item["verdict"] == [item["truth"]]
    return item["case"] if right else f"{item['case']}: {', '.join(item['verdict'])}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Drive, compare and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--summary", action="store_true", help="only the picture of the cases that are written already")
    given = parser.parse_args(arguments)
    answers: list[dict[str, Any]] = json.loads(RESULT.read_text())["cases"] if RESULT.exists() else []
    for case in cases()[len(answers) :] if not given.summary else []:
        answers.append(answer(case))
        write_json(RESULT, {"command": "python -m benchmarks.changes_since", "cases": answers})
        print(case.name, answers[-1]["verdict"], flush=True)
    draw(answers, RESULT.with_suffix(".png"))


if __name__ == "__main__":
    main()
