"""Do the filters that know slopes survive a start without standing? Straight drives and arcs at constant commands.

    python -m benchmarks.hard_starts [--episodes 24] [--slopes 0,3,5] [--output FILE]

Episodes of ``DDAGR-Turn-v0`` (seeds 0, 1, ...) in which one action is held for 6.4 s from the first step on, or after
three steps of standing. Slopes point anywhere. An estimate is lost where its velocity is off by more than 0.05 m/s at
the end. ``inertial, law alone`` is the filter without the rule that slip is small until gravity is known (theory:
filter, section 9). Writes ``results/hard_starts.json`` and a picture beside it.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

import gymnasium
import numpy as np
from numpy.typing import NDArray

from ddagr_gym.envs.registration import TURN_ID
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import InertialBatch, InertialModel, LearnedBatch, LearnedModel
from ddagr_gym.evaluation.statistics import wilson_interval
from ddagr_gym.files import atomic_path
from ddagr_gym.parameters import Sensors
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.presets import ddagr
from ddagr_gym.progress import Progress
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

Array = NDArray[np.float64]

RESULT = Path(__file__).parent / "results" / "hard_starts.json"
STEPS = 80
LOST = 0.05
"""Error of the velocity from which on an estimate is lost [m/s]."""

STARTS: dict[str, tuple[int, tuple[float, float]]] = {
    "fast": (0, (0.6, 0.6)),
    "full": (0, (1.0, 1.0)),
    "slow": (0, (0.25, 0.25)),
    "backwards": (0, (-0.25, -0.25)),
    "arc": (0, (0.7, 0.4)),
    "fast, after standing": (3, (0.6, 0.6)),
}
"""Steps of standing, and the action, right and left, that is held afterwards."""


class Estimator(Protocol):
    """A batch of filters."""

    @property
    def states(self) -> Array:
        """(1, ...), velocities first [m/s]."""

    def step(self, commands: Array, readings: Array) -> Array:
        """Go on by commands (1, 2) and readings (1, K, 5)."""


def _law_alone() -> Estimator:
    model = InertialModel.of(ddagr(), Sensors())
    return InertialBatch(replace(model, knowledge=replace(model.knowledge, known_pull=1e3)))


ESTIMATORS: dict[str, Callable[[], Estimator]] = {
    "inertial, law alone": _law_alone,
    "inertial": lambda: InertialBatch(InertialModel.of(ddagr(), Sensors())),
    "learned": lambda: LearnedBatch(LearnedModel.of(ddagr(), Sensors())),
    "learned, pose": lambda: LearnedBatch(LearnedModel.of(ddagr(), Sensors(), "pose")),
    "learned, pose_wide": lambda: LearnedBatch(LearnedModel.of(ddagr(), Sensors(), "pose_wide")),
}


def final_errors(start: str, degrees: float, seed: int) -> dict[str, float]:
    """Size of the velocity's error after one start, by estimator [m/s]."""
    direction = float(np.random.default_rng(seed).uniform(-math.pi, math.pi))
    effects = (Slope(math.radians(degrees), direction),) if degrees else ()
    environment = gymnasium.make(TURN_ID, info_level="full", effects=effects)
    environment.reset(seed=seed)
    own = {name: make() for name, make in ESTIMATORS.items()}
    standing, action = STARTS[start]
    for step in range(standing + STEPS):
        given = np.asarray(action if step >= standing else (0.0, 0.0), dtype=np.float32)
        *_, terminated, truncated, info = environment.step(given)
        for estimator in own.values():
            estimator.step(info["command"][None], info["samples"][None])
        if terminated or truncated:
            break
    environment.close()
    truth = np.array([info["true_v_x"], info["true_v_y"]])
    return {name: float(np.hypot(*(estimator.states[0, :2] - truth))) for name, estimator in own.items()}


def study(slopes: Sequence[float], episodes: int) -> dict[str, Any]:
    """Lost estimates by slope, start and estimator."""
    found: dict[str, Any] = {}
    with Progress(len(slopes) * len(STARTS) * episodes, "driving off") as progress:
        for degrees in slopes:
            found[f"{degrees:g}"] = {}
            for start in STARTS:
                errors = []
                for seed in range(episodes):
                    errors.append(final_errors(start, degrees, seed))
                    progress.advance(1)
                found[f"{degrees:g}"][start] = {name: _summary([one[name] for one in errors]) for name in ESTIMATORS}
    return {"episodes": episodes, "slopes": found}


def _summary(errors: Sequence[float]) -> dict[str, Any]:
    lost = sum(error > LOST for error in errors)
    within = wilson_interval(lost, len(errors))
    return {
        "lost": lost,
        "share": {"value": lost / len(errors), "interval": [round(within.low, 4), round(within.high, 4)]},
        "median_mm_s": round(1e3 * float(np.median(errors)), 2),
        "largest_mm_s": round(1e3 * max(errors), 1),
    }


_COLOURS = dict(
    zip(ESTIMATORS, (palette.GREY, palette.ORANGE, palette.BLUE, palette.VERMILLION, palette.SKY_BLUE), strict=True)
)


def draw(slopes: Mapping[str, Mapping[str, Mapping[str, Any]]], path: Path) -> None:
    """Share of lost estimates with 95 % intervals; a panel a slope, PNG."""
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(9.0, 2.9), layout="constrained")
        panels = figure.subplots(1, len(slopes), sharey=True, squeeze=False)[0]
        for panel, (degrees, starts) in zip(panels, slopes.items(), strict=True):
            for number, (name, colour) in enumerate(_COLOURS.items()):
                for place, found in enumerate(starts.values()):
                    share, at = found[name]["share"], place + 0.16 * (number - 2.0)
                    panel.plot([at] * 2, [100.0 * v for v in share["interval"]], "-", color=colour, lw=1.2)
                    panel.plot(at, 100.0 * share["value"], "o", color=colour, ms=4.5, label="" if place else name)
            panel.set(title=f"slope of {degrees} degrees" if degrees != "0" else "level ground", ylim=(-3, 100))
            panel.set_xticks(range(len(starts)), [start.replace(", ", ",\n") for start in starts], rotation=30)
        panels[0].set(ylabel=f"off by over {LOST:g} m/s [% of starts]")
        panels[0].legend(loc="upper right")
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=130))


def table(result: Mapping[str, Any]) -> str:
    """Markdown: a row a slope and start; lost of the episodes, and the median error."""
    lines = [f"| slope | start | {' | '.join(ESTIMATORS)} |", "|---" * (2 + len(ESTIMATORS)) + "|"]
    for degrees, starts in result["slopes"].items():
        for start, found in starts.items():
            cells = [f"{found[name]['lost']} ({found[name]['median_mm_s']:.0f} mm/s)" for name in ESTIMATORS]
            lines.append(f"| {degrees} | {start} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _slopes(text: str) -> list[float]:
    try:
        slopes = [float(part) for part in text.split(",")]
    except ValueError as error:
        raise InputError(f"slopes is {text!r}: give degrees, separated by commas, as in 0,3,5.") from error
    if not all(0.0 <= degrees <= 15.0 for degrees in slopes):
        raise InputError(f"slopes is {text!r}: give degrees from 0 to 15.")
    return slopes


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=24, help="of each start and slope")
    parser.add_argument("--slopes", default="0,3,5", help="degrees, separated by commas")
    parser.add_argument("--output", type=Path, default=RESULT, help="JSON file; the picture lies beside it")
    given = parser.parse_args(arguments)
    try:
        slopes = _slopes(given.slopes)
        if given.episodes < 1:
            raise InputError(f"episodes is {given.episodes}: give 1 or more.")
    except InputError as error:
        parser.error(str(error))
    result = study(slopes, given.episodes)
    with atomic_path(given.output) as temporary:
        temporary.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    draw(result["slopes"], given.output.with_suffix(".png"))
    print(table(result))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
