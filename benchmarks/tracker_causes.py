"""What limits the path tracker B6: it is told the truth in parts, and single things of it are taken back.

    python -m benchmarks.tracker_causes [--plants late,slope_3,slope_5] [--scenarios 10] [--output FILE]

An arm that is told something shows what its estimate costs; an arm without something shows what it is worth. For each
plant and arm: radius error and success as in :mod:`benchmarks.row_turn_plants`, whose scenarios these are; lateral and
heading error at the next row; what failed; the spread of the yaw rate in the turn over the commanded one, which is
large where the loop swings; root mean square errors of the estimated velocities up to the next row. Writes
``results/tracker_causes.json`` and a picture beside it.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from benchmarks.plants_figure import draw
from benchmarks.row_turn_plants import PLANTS, Outcome, compared, driven_on, names_of, scenario
from ddagr_gym.control.row_turn import FURROW_SLACK
from ddagr_gym.control.timing import CONTROL_PERIOD
from ddagr_gym.envs.settings import Episode, TurnSettings
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import DeadReckoning, InertialModel, Reckoned, run_inertial_filter
from ddagr_gym.evaluation.controllers import (
    SETTLING,
    STANDING,
    inertial_model,
    make_path_tracker,
    tracker_gains_by_hand,
)
from ddagr_gym.evaluation.ladder_gains import LadderGains, ladder_gains
from ddagr_gym.evaluation.metrics import turn_metrics
from ddagr_gym.evaluation.runs import Controller, TurnRun, drive_turn
from ddagr_gym.files import atomic_path
from ddagr_gym.frames import wrap_angle
from ddagr_gym.parameters import STANDARD_GRAVITY
from ddagr_gym.physics.effects.slope import Slope

RESULT = Path(__file__).parent / "results" / "tracker_causes.json"
_SELDOM = 10  # samples from balance to balance in the arm "seldom balanced"

Telling = Callable[[Reckoned, Mapping[str, Any], tuple[float, float]], Reckoned]
"""(estimate, the environment's info, angle and direction of the slope) -> estimate with a part of the truth."""


def _motion(at: Reckoned, info: Mapping[str, Any], slope: tuple[float, float]) -> Reckoned:
    return at._replace(v_x=info["true_v_x"], v_y=info["true_v_y"], yaw_rate=info["true_yaw_rate"])


def _pose(at: Reckoned, info: Mapping[str, Any], slope: tuple[float, float]) -> Reckoned:
    return at._replace(x=info["true_x"], y=info["true_y"], yaw=info["true_yaw"])


def _gravity(at: Reckoned, info: Mapping[str, Any], slope: tuple[float, float]) -> Reckoned:
    angle, direction = slope
    pull, behind = STANDARD_GRAVITY * math.sin(angle), info["true_yaw"] - direction
    return at._replace(gravity=(-pull * math.cos(behind), pull * math.sin(behind)))


def _pose_and_motion(at: Reckoned, info: Mapping[str, Any], slope: tuple[float, float]) -> Reckoned:
    return _pose(_motion(at, info, slope), info, slope)


class ToldReckoning(DeadReckoning):
    """Dead reckoning that is told parts of the truth; ``info`` is set before each update.

    Args:
        model: of the filter.
        tell: changes an estimate.
        slope: angle and direction of the ground [rad].
    """

    def __init__(self, model: InertialModel, tell: Telling, slope: tuple[float, float]) -> None:
        self.info: Mapping[str, Any] = {}
        self._tell, self._slope = tell, slope
        super().__init__(model, SETTLING)

    def present(self) -> Reckoned:
        """What is known now, with what was told."""
        at = super().present()
        return self._tell(at, self.info, self._slope) if self.info else at


@dataclass(frozen=True)
class _Informed:
    """A tracker whose estimator sees the environment's info."""

    tracker: Controller
    estimator: ToldReckoning

    def reset(self) -> None:
        self.tracker.reset()

    def __call__(self, observation: ArrayLike, info: Any = None) -> NDArray[np.float32]:
        self.estimator.info = info
        return self.tracker(observation, info)


@dataclass(frozen=True)
class Arm:
    """A tracker.

    Attributes:
        tell: what it is told.
        gains: its gains, from those of B6.
        model: its filter, from that of B6.
        settling: of :class:`DeadReckoning` [s].
    """

    tell: Telling | None = None
    gains: Callable[[LadderGains], LadderGains] = lambda gains: gains
    model: Callable[[InertialModel], InertialModel] = lambda model: model
    settling: float = SETTLING

    def controller(self, settings: TurnSettings, episode: Episode) -> Controller:
        """For one turn."""
        gains, model = self.gains(ladder_gains()), self.model(inertial_model())
        if self.tell is None:
            return make_path_tracker(DeadReckoning(model, self.settling), model.flat, STANDING)(episode.turn, gains)
        grounds = [(item.angle, item.direction) for item in settings.effects if isinstance(item, Slope)]
        estimator = ToldReckoning(model, self.tell, grounds[0] if grounds else (0.0, 0.0))
        return _Informed(make_path_tracker(estimator, model.flat, STANDING)(episode.turn, gains), estimator)


def _balanced(interval: int) -> Callable[[InertialModel], InertialModel]:
    return lambda model: replace(model, knowledge=replace(model.knowledge, balance_interval=interval))


ARMS = {
    "B6": Arm(),
    "gains by hand": Arm(gains=tracker_gains_by_hand),
    "not ahead": Arm(gains=lambda gains: replace(gains, path_tracker_ahead=0.0)),
    "not aligning": Arm(gains=lambda gains: replace(gains, path_tracker_aligning=0.0)),
    "seldom balanced": Arm(model=_balanced(_SELDOM)),
    "velocities integrated": Arm(settling=math.inf),
    "pose at once": Arm(settling=0.0),
    "true gravity": Arm(_gravity),
    "true motion": Arm(_motion),
    "true pose": Arm(_pose),
    "true pose and motion": Arm(_pose_and_motion),
}
"""Trackers by name; the first is B6 itself, the next six lack something of it, the others are told something."""


@dataclass(frozen=True)
class Look:
    """What one turn tells besides its outcome.

    Attributes:
        outcome: radius error and success.
        lateral: size of the lateral error at the next row [m], None where it was not reached.
        heading: of the heading error [rad].
        swing: standard deviation of the yaw rate in the middle of the turn over the commanded yaw rate [-].
        speed_error: root mean square error of v_x up to the next row [m/s].
        side_slip_error: of v_y [m/s].
    """

    outcome: Outcome
    lateral: float | None
    heading: float | None
    swing: float
    speed_error: float
    side_slip_error: float

    @property
    def failure(self) -> str | None:
        """What failed first: the row was not reached, the centre is off it, or only the nose."""
        if self.outcome.success:
            return None
        if self.lateral is None:
            return "row not reached"
        return "lateral" if self.lateral > FURROW_SLACK else "nose"


def look(run: TurnRun, model: InertialModel) -> Look:
    """Of a turn; the errors are those of the filter over its samples."""
    columns, turn = run.columns, run.episode.turn
    found = turn_metrics(columns, turn, run.episode.robot)
    states, _ = run_inertial_filter(model, columns)
    driving = slice(round(STANDING * CONTROL_PERIOD / run.episode.sensors.period), None)
    turned = turn.sign * columns["true_yaw"]
    middle = (turned > math.radians(30.0)) & (turned < math.radians(150.0))
    swing = float(np.std(columns["true_yaw_rate"][middle])) * turn.radius / turn.speed if middle.any() else 0.0
    errors = [states[driving, i] - columns[name][driving] for i, name in enumerate(("true_v_x", "true_v_y"))]
    end = found.exit
    return Look(
        Outcome(found.turn.error, run.success),
        None if end is None else abs(end.lateral_error),
        None if end is None else abs(wrap_angle(end.heading_error)),
        swing,
        *(float(np.sqrt(np.mean(np.square(error)))) for error in errors),
    )


def drive(arm: str, plant: str, number: int) -> Look:
    """One turn."""
    settings, episode, seed = scenario(plant, number)
    chosen = ARMS[arm]
    run = drive_turn(chosen.controller(settings, episode), settings, seed, episode)
    return look(run, chosen.model(inertial_model()))


def _median(values: Sequence[float | None], unit: float) -> float | None:
    known = [value for value in values if value is not None]
    return round(unit * float(np.median(known)), 3) if known else None


def details(looks: Sequence[Look]) -> dict[str, Any]:
    """Medians over turns, and how many failed by what."""
    failures = [item.failure for item in looks if item.failure is not None]
    return {
        "exit_lateral_error_median_mm": _median([item.lateral for item in looks], 1e3),
        "exit_heading_error_median_deg": _median([item.heading for item in looks], 180.0 / math.pi),
        "failures": {name: failures.count(name) for name in ("row not reached", "lateral", "nose")},
        "swing_median": _median([item.swing for item in looks], 1.0),
        "v_x_error_rms_median_mm_s": _median([item.speed_error for item in looks], 1e3),
        "v_y_error_rms_median_mm_s": _median([item.side_slip_error for item in looks], 1e3),
    }


def study(arms: Sequence[str], plants: Sequence[str], scenarios: int) -> dict[str, Any]:
    """Every arm on every plant, the same scenarios."""
    result: dict[str, Any] = {"scenarios": scenarios, "plants": {}}
    for plant, looks in driven_on(plants, arms, scenarios, drive):
        found = compared({name: [item.outcome for item in own] for name, own in looks.items()})
        result["plants"][plant] = {name: found[name] | details(own) for name, own in looks.items()}
    return result


def table(result: Mapping[str, Any]) -> str:
    """Markdown: a row a plant and arm."""
    lines = [
        "| plant | arm | error: median / 95 % / success | at the row [mm, deg] | failed: away, lateral, nose | swing "
        "| v_x, v_y [mm/s] |",
        "|---" * 7 + "|",
    ]
    for plant, found in result["plants"].items():
        for name, own in found.items():
            values = [100.0 * own[key]["value"] for key in ("radius_error_median", "radius_error_p95", "success_rate")]
            lines.append(
                f"| {PLANTS[plant].title} | {name} | {values[0]:.1f} / {values[1]:.1f} / {values[2]:.0f} "
                f"| {own['exit_lateral_error_median_mm']:.0f}, {own['exit_heading_error_median_deg']:.1f} "
                f"| {', '.join(str(count) for count in own['failures'].values())} | {own['swing_median']:.2f} "
                f"| {own['v_x_error_rms_median_mm_s']:.1f}, {own['v_y_error_rms_median_mm_s']:.1f} |"
            )
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plants", default="late,slope_3,slope_5", help="names, separated by commas")
    parser.add_argument("--arms", default=",".join(ARMS), help="names, separated by commas")
    parser.add_argument("--scenarios", type=int, default=10, help="turns of each arm on each plant")
    parser.add_argument("--output", type=Path, default=RESULT, help="JSON file; the picture lies beside it")
    given = parser.parse_args(arguments)
    try:
        plants, arms = names_of(given.plants, list(PLANTS), "plant"), names_of(given.arms, list(ARMS), "arm")
        if given.scenarios < 2:
            raise InputError(f"scenarios is {given.scenarios}: give at least 2.")
    except InputError as error:
        parser.error(str(error))
    result = study(arms, plants, given.scenarios)
    with atomic_path(given.output) as temporary:
        temporary.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    draw(result["plants"], {name: PLANTS[name].title for name in plants}, given.output.with_suffix(".png"))
    print(table(result))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
