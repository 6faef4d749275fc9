"""Which parts a calibration finds in simulated robots, whose parts are known.

    python -m benchmarks.simulated_robots [--processes 2] [--parts DIR] [--output FILE]

Six robots differ from the data sheet of the DDAGR by slower motors and a dead time; five of them by one thing more.
Each drives three times for two minutes, on two soils, from several seeds, and is calibrated by few windows. A part that
a robot has is to be kept, one that it lacks is not. Writes the parts and the values beside the true ones, and a picture
(``benchmarks/results/simulated_robots.json``, ``.png``). About 15 minutes of two cores. An interrupted run goes
on after the calibrations in the folder of parts, where the same code made them.
"""

from __future__ import annotations

import argparse
import hashlib
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import ddagr_gym
from ddagr_gym.calibration.parts import PARTS, part_of
from ddagr_gym.calibration.result import Calibration
from ddagr_gym.calibration.run import Outcome, calibrate_drives, calibration_digest
from ddagr_gym.calibration.settings import CalibrationSettings
from ddagr_gym.files import write_json
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style
from ddagr_gym.tasks import ResultStore, Task, TaskRunner, run_tasks

RESULT = Path(__file__).resolve().parent / "results" / "simulated_robots.json"

MOTOR_RATE = 2.5
"""Of the true robots [1/s]; the data sheet has 4.5."""

DELAY = 0.22
"""Of their commands [s]; the data sheet has none."""

STRENGTH = {"field": 1.0, "track": 1.5}
"""Factors on cohesion and tan(phi) of the nominal soil by ground."""

GROUNDS = ("field", "field", "track")
"""Of the drives of one robot."""

RATE = 20.0
"""Of the recordings [Hz]."""

WIDER = 1.1
"""Factor on the track of the robot whose data sheet is wrong about it."""

FEW = CalibrationSettings(fitted=10, compared=6, judged=12)
"""Enough windows for three parameters and two grounds, at a fifth of the cost."""

SEEDS = (0, 10, 20)
"""Added to the numbers of the drives."""

COMMON = frozenset({"speed_loop", "command_delay"})
"""Parts that all of them have."""


@dataclass(frozen=True)
class Case:
    """A robot that is not as its data sheet says.

    Attributes:
        drivetrain: values of what it has besides the common parts.
        wider: whether its track is wider than the data sheet says, which calls it uncertain.
    """

    drivetrain: Mapping[str, float] = field(default_factory=dict)
    wider: bool = False

    @property
    def parts(self) -> frozenset[str]:
        """Names of all parts that differ from the data sheet."""
        parameters = (*self.drivetrain, *(("half_track",) if self.wider else ()))
        return COMMON | {part_of(name).name for name in parameters}

    @property
    def sheet(self) -> Robot:
        """The robot as its data sheet has it."""
        sheet = get_robot("ddagr")
        uncertain = {**sheet.standard_deviations, "half_track": 0.05}
        return replace(sheet, standard_deviations=uncertain) if self.wider else sheet

    @property
    def robot(self) -> Robot:
        """The robot as it is, but for the dead time of its commands, which is an effect."""
        robot = true_robot()
        robot = replace(robot, drivetrain=replace(robot.drivetrain, **self.drivetrain))
        return replace(robot, half_track=WIDER * robot.half_track) if self.wider else robot


CASES = {
    "slower motors, late": Case(),
    "limit of turning": Case({"turning_limit": 0.6}),
    "ramp of each bank": Case({"command_ramp": 1.0}),
    "ramps of mean and turning": Case({"mean_ramp": 1.5, "turning_ramp": 0.6}),
    "filter of commands": Case({"command_filter": 0.5}),
    "wider track": Case(wider=True),
}
"""Robots by what they have besides [rad/s], [rad/s^2], [s]."""


def true_robot() -> Robot:
    """The DDAGR with slower motors."""
    return replace(get_robot("ddagr"), motor_rate=MOTOR_RATE)


def stronger(soil: Soil, factor: float) -> Soil:
    """A soil with cohesion and tan(phi) times a factor."""
    angle = float(np.arctan(factor * np.tan(soil.friction_angle)))
    return replace(soil, cohesion=factor * soil.cohesion, friction_angle=angle)


def steps(
    seed: int | np.random.Generator, seconds: float, longest: float = 5.0, rate: float = RATE
) -> NDArray[np.float64]:
    """(T, 2) bank speed commands, each held for 2 s to the longest time [rad/s].

    Args:
        seed: or the random numbers themselves.
        seconds: of all commands.
        longest: that one is held [s].
        rate: of the commands [Hz].
    """
    rng = np.random.default_rng(seed)
    rows: list[NDArray[np.float64]] = []
    while len(rows) < seconds * rate:
        rows += [rng.uniform(-1.6, 1.6, 2)] * int(rng.uniform(2.0, longest) * rate)
    return np.array(rows[: int(seconds * rate)])


def drive(
    ground: str,
    seed: int,
    seconds: float = 120.0,
    name: str = "",
    robot: Robot | None = None,
    effects: tuple[str, ...] = (),
) -> Recording:
    """A drive of a robot with late commands.

    Args:
        ground: one of :data:`STRENGTH`.
        seed: of commands and noise.
        seconds: of the drive.
        name: source of the recording; by default from ground and seed.
        robot: that of :func:`true_robot` where it is None.
        effects: besides the dead time.
    """
    soil = stronger(get_soil("thesis_a1"), STRENGTH[ground])
    made = ddagr_gym.simulate(
        steps(seed, seconds), robot or true_robot(), soil, [f"command_delay={DELAY}", *effects], rate=RATE,
        pose_rate=5.0, seed=seed,
    )  # fmt: skip
    return made.recording.with_meta(source=name or f"{ground}_{seed}.csv")


def case_drives(case: Case, seed: int = 0) -> list[Recording]:
    """Drives of a robot on the :data:`GROUNDS`.

    Args:
        case: the robot.
        seed: added to the numbers of the drives.
    """
    return [drive(ground, number + seed, robot=case.robot) for number, ground in enumerate(GROUNDS, 1)]


def calibrated_case(case: Case, seed: int = 0) -> Outcome:
    """What those drives say, from the data sheet; arguments as of :func:`case_drives`."""
    soils = {ground: get_soil("thesis_a1") for ground in GROUNDS}
    return calibrate_drives(case_drives(case, seed), GROUNDS, case.sheet, soils, FEW)


def kept_parts(calibration: Calibration) -> frozenset[str]:
    """Names of the parts that a calibration keeps."""
    return frozenset(part.name for part in calibration.parts if part.kept)


def row_of(name: str, seed: int) -> dict[str, Any]:
    """What a calibration says of a robot's drives beside the truth; workers call it by name."""
    case = CASES[name]
    outcome = calibrated_case(case, seed)
    found, kept = outcome.robot, kept_parts(outcome.calibration)
    truth = {"motor_rate": MOTOR_RATE, "command_delay": DELAY, **case.drivetrain}
    said = {key: found.motor_rate if key == "motor_rate" else getattr(found.drivetrain, key) for key in truth}
    if case.wider:
        truth["half_track"], said["half_track"] = case.robot.half_track, found.half_track
    return {
        "robot": name, "seed": seed, "kept": sorted(kept), "false": sorted(kept - case.parts),
        "lacking": sorted(case.parts - kept),
        "relative_errors": {key: said[key] / value - 1.0 for key, value in truth.items()},
        "seconds": outcome.calibration.seconds,
    }  # fmt: skip


def tasks_of(robots: Sequence[str], seeds: Sequence[int]) -> list[Task]:
    """A calibration of every robot from every seed, under keys that change with code, robots and soil."""
    keys = {name: f"{name.replace(', ', '_').replace(' ', '_')}_{_digest(CASES[name])}" for name in robots}
    return [
        Task(f"{name}, seed {seed}", row_of, (name, seed), key=f"{keys[name]}_{seed}")
        for name in robots
        for seed in seeds
    ]


def _digest(case: Case) -> str:
    """Of all that a robot's calibrations depend on but the seed."""
    digest = hashlib.sha256(calibration_digest().encode() + Path(__file__).read_bytes())
    digest.update((Path(ddagr_gym.__file__).parent / "api" / "simulate.py").read_bytes())
    digest.update(repr((case.sheet, case.robot, get_soil("thesis_a1"))).encode())
    return digest.hexdigest()[:16]


def draw(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """How often each part was kept, with what the robots have outlined, as PNG."""
    from matplotlib.figure import Figure

    robots, parts = list(dict.fromkeys(row["robot"] for row in rows)), [part.name for part in PARTS]
    with house_style():
        figure = Figure(figsize=(8.4, 4.2), layout="constrained")
        panel = figure.subplots()
        for down, robot in enumerate(robots):
            mine = [row for row in rows if row["robot"] == robot]
            for across, part in enumerate(parts):
                count = sum(part in row["kept"] for row in mine)
                _draw_cell(panel, across, down, count, len(mine), part in CASES[robot].parts)
        panel.set_xlim(-0.6, len(parts) - 0.4)
        panel.set_ylim(len(robots) - 0.4, -0.6)
        panel.set_xticks(range(len(parts)), [part.title for part in PARTS], rotation=40, ha="right")
        panel.set_yticks(range(len(robots)), robots)
        panel.set_title("Parts kept, of all calibrations; framed: the robot has it", fontsize=10)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=120))


def _draw_cell(panel: Any, across: int, down: int, count: int, of: int, has: bool) -> None:
    from matplotlib.patches import Rectangle

    colour = palette.BLUE if has else palette.ORANGE
    if count:
        corner = (across - 0.4, down - 0.4)
        panel.add_patch(Rectangle(corner, 0.8, 0.8, facecolor=colour, alpha=count / of, edgecolor="none"))
    if has:
        panel.add_patch(Rectangle((across - 0.44, down - 0.44), 0.88, 0.88, fill=False, edgecolor="black"))
    if count or has:
        panel.text(across, down, f"{count}/{of}", ha="center", va="center", fontsize=8)


def main(words: Sequence[str] | None = None) -> int:
    """Simulate, calibrate, compare, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--robots", nargs="+", choices=CASES, default=list(CASES))
    parser.add_argument("--seeds", nargs="+", type=int, default=list(SEEDS))
    parser.add_argument("--parts", type=Path, help="folder of finished calibrations; beside the output if absent")
    parser.add_argument("--output", type=Path, default=RESULT)
    given = parser.parse_args(words)
    tasks = tasks_of(given.robots, given.seeds)
    with TaskRunner(given.processes) as runner:
        rows = run_tasks(tasks, "calibrations", runner, ResultStore(given.parts or given.output.with_suffix(".parts")))
    write_json(given.output, {"command": "python -m benchmarks.simulated_robots", "rows": rows})
    draw(rows, given.output.with_suffix(".png"))
    for row in rows:
        worst = max(abs(error) for error in row["relative_errors"].values())
        print(
            f"{row['robot']}, seed {row['seed']}: {', '.join(row['false']) or 'nothing'} that it lacks, "
            f"without {', '.join(row['lacking']) or 'nothing'} that it has, values within {100.0 * worst:.1f} %"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
