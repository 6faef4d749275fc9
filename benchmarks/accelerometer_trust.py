"""How far the path tracker B6 may trust its accelerometer: turns with other standard deviations in its filter.

    python -m benchmarks.accelerometer_trust [--turns 20] [--output FILE]

B6's filter takes the accelerometer's noise from the data sheet, 0.031 m/s^2. Here it drives with that, three and ten
times of it, everything else as shipped: on development plants of the package's simulator, whose accelerometer has just
that noise, and on truths of the blind benchmark's simulator (:mod:`benchmarks.adaptation.truths`), whose accelerometer
shakes with the tread and leans with the wheels' sinkages. Seeds are those of development turns; none of the frozen sets
is read. About ten minutes of one core. Writes ``benchmarks/results/accelerometer_trust.json`` and a picture.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchmarks.adaptation.study import TrueTurns, nominal
from benchmarks.adaptation.truths import TRUTHS
from benchmarks.plants_figure import draw
from benchmarks.row_turn_plants import PLANTS, Outcome, scenario, summary
from ddagr_gym.adaptation.turns import judged
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.errors import at_least
from ddagr_gym.evaluation.adapted_tracker import adapted_tracker
from ddagr_gym.evaluation.metrics import turn_metrics
from ddagr_gym.evaluation.runs import Controller, drive_turn
from ddagr_gym.files import write_json
from ddagr_gym.parameters import Sensors
from ddagr_gym.progress import Progress

RESULT = Path(__file__).resolve().parent / "results" / "accelerometer_trust.json"
NOISES = (0.031, 0.1, 0.3)
"""Standard deviations of a sample in the filter [m/s^2]; the first is the data sheet's."""

OWN = ("level", "slope_3", "weaker", "lateral_0.8", "late")
OTHER = ("nothing", "slope", "delay", "patch", "centre", "weak_sideways")


def tracker(turn: RowTurn, noise: float) -> Controller:
    """B6 as shipped but for the accelerometer's noise in its filter [m/s^2]."""
    bundle, sensors = nominal("B6"), Sensors()
    constants = bundle.constants(turn)
    settings = bundle.settings.tracker
    assert settings is not None
    believed = replace(sensors, imu=replace(sensors.imu, accelerometer_noise=noise))
    ratio = constants.track_ratio(turn, bundle.known.robot)
    return adapted_tracker(settings, bundle.known, believed, None, ratio, constants.lead)


def on_own(plant: str, noise: float, number: int) -> Outcome:
    """One turn on a development plant."""
    settings, episode, seed = scenario(plant, number)
    run = drive_turn(tracker(episode.turn, noise), settings, seed, episode)
    return Outcome(turn_metrics(run.columns, episode.turn, episode.robot).turn.error, run.success)


def on_other(truth: str, noise: float, number: int) -> Outcome:
    """One turn in a truth of the blind benchmark's simulator."""
    turns = TrueTurns(TRUTHS[truth])
    turn = turns.turn(number)
    found = judged(turns.drive(tracker(turn, noise), number), turn, turns.robot, number)
    return Outcome(found.error, found.success)


def driven(
    names: Sequence[str], drive: Callable[[str, float, int], Outcome], turns: int, advance: Callable[[], None]
) -> dict[str, dict[str, Any]]:
    """{plant: {noise: summary}}, the same turns for every noise."""
    found: dict[str, dict[str, Any]] = {}
    for name in names:
        found[name] = {}
        for noise in NOISES:
            outcomes = []
            for number in range(turns):
                outcomes.append(drive(name, noise, number))
                advance()
            found[name][f"{noise:g}"] = summary(outcomes)
    return found


def table(result: Mapping[str, Any]) -> str:
    """Markdown: a row a plant, a column a noise; median / 95th percentile of |e_R|, success, all in percent."""
    lines = [
        f"| simulator | plant | {' | '.join(f'{noise:g} m/s²' for noise in NOISES)} |",
        "|---" * (len(NOISES) + 2) + "|",
    ]
    for simulator in ("own", "other"):
        for name, found in result[simulator].items():
            cells = [_cell(found[f"{noise:g}"]) for noise in NOISES]
            lines.append(f"| {SIMULATORS[simulator]} | {titles()[name]} | {' | '.join(cells)} |")
    return "\n".join(lines)


SIMULATORS = {"own": "the package's", "other": "the blind benchmark's"}


def titles() -> dict[str, str]:
    """Of plants and truths."""
    return {name: PLANTS[name].title for name in OWN} | {name: TRUTHS[name].title for name in OTHER}


def _cell(found: Mapping[str, Any]) -> str:
    median, tail, made = (found[key] for key in ("radius_error_median", "radius_error_p95", "success_rate"))
    low, high = made["interval"]
    return (
        f"{100 * median['value']:.1f} / {100 * tail['value']:.1f} / {100 * made['value']:.0f} "
        f"({100 * low:.0f} to {100 * high:.0f})"
    )


def main(words: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--turns", type=int, default=20, help="on each plant by each filter")
    parser.add_argument("--output", type=Path, default=RESULT, help="JSON file; the picture lies beside it")
    given = parser.parse_args(words)
    at_least(**{"--turns": (given.turns, 2)})
    with Progress(len(NOISES) * (len(OWN) + len(OTHER)) * given.turns, "driving") as progress:
        own = driven(OWN, on_own, given.turns, progress.advance)
        other = driven(OTHER, on_other, given.turns, progress.advance)
    result = {"command": "python -m benchmarks.accelerometer_trust", "noises": list(NOISES), "own": own, "other": other}
    write_json(given.output, result)
    named = {f"{noise:g} m/s²": f"{noise:g}" for noise in NOISES}
    shown = {name: {word: found[key] for word, key in named.items()} for name, found in {**own, **other}.items()}
    places = {name: f"{'blind: ' if name in OTHER else ''}{title}" for name, title in titles().items()}
    draw(shown, places, given.output.with_suffix(".png"))
    print(table(result))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
