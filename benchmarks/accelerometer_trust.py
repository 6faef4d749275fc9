"""How far the path tracker B6 may trust its accelerometer: turns with what its filter may believe of the noise.

    python -m benchmarks.accelerometer_trust [--field 4] [--turns 12] [--output FILE]

B6's filter takes the accelerometer's noise at rest from the data sheet, 0.031 m/s^2, and learns on the way how much
more the robot's shaking adds (theory: filter, eq. (13d)). Here it drives so, without learning, and with three and ten
times the data sheet's noise without learning: on development plants of the package's simulator, whose accelerometer has
just the noise of the data sheet, and on all truths of the blind benchmark's simulator
(:mod:`benchmarks.adaptation.truths`), whose accelerometer shakes with the tread and leans with the wheels' sinkages.
A field is a soil with its places and its sensors' noise. Learning was built on the package's development plants and on
field 1, and looked at on field 2. Field 4 had not been driven by anything when this rule was written: learning stays in
B6 if it makes more turns of field 4, all truths together, than B6 without, and if on S1b
(:mod:`benchmarks.second_sets`) it makes 99 % and is not surely less close than B4.
About fifteen minutes of one core. Writes ``benchmarks/results/accelerometer_trust.json`` and a picture.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.adaptation.study import TrueTurns, nominal
from benchmarks.adaptation.truths import TRUTHS
from benchmarks.plants_figure import draw
from benchmarks.row_turn_plants import PLANTS, Outcome, cell, driven_on, scenario, summary
from ddagr_gym.adaptation.turns import judged
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.errors import at_least
from ddagr_gym.evaluation.adapted_tracker import adapted_tracker
from ddagr_gym.evaluation.metrics import turn_metrics
from ddagr_gym.evaluation.runs import Controller, drive_turn
from ddagr_gym.files import write_json
from ddagr_gym.parameters import Sensors

RESULT = Path(__file__).resolve().parent / "results" / "accelerometer_trust.json"
STATED = Sensors().imu.accelerometer_noise
ARMS = {
    "learnt": (STATED, True),
    "as stated": (STATED, False),
    "0.1 m/s²": (0.1, False),
    "0.3 m/s²": (0.3, False),
}
"""Standard deviation of a sample at rest in the filter [m/s^2], and whether vibration is learnt."""

_NEXT_TO_NONE = 1e-9  # vibration [1/s]: one that is stated, however small, is not learnt

OWN = ("level", "slope_3", "weaker", "lateral_0.8", "late")


def tracker(turn: RowTurn, arm: str) -> Controller:
    """B6 as shipped but for what its filter believes of the accelerometer."""
    noise, learns = ARMS[arm]
    bundle, sensors = nominal("B6"), Sensors()
    constants = bundle.constants(turn)
    settings = bundle.settings.tracker
    assert settings is not None
    imu = replace(sensors.imu, accelerometer_noise=noise, accelerometer_vibration=0.0 if learns else _NEXT_TO_NONE)
    believed = replace(sensors, imu=imu)
    ratio = constants.track_ratio(turn, bundle.known.robot)
    return adapted_tracker(settings, bundle.known, believed, None, ratio, constants.lead)


def on_own(arm: str, plant: str, number: int) -> Outcome:
    """One turn on a development plant."""
    settings, episode, seed = scenario(plant, number)
    run = drive_turn(tracker(episode.turn, arm), settings, seed, episode)
    return Outcome(turn_metrics(run.columns, episode.turn, episode.robot).turn.error, run.success)


def on_other(field: int, arm: str, truth: str, number: int) -> Outcome:
    """One turn in a truth of the blind benchmark's simulator."""
    turns = TrueTurns(TRUTHS[truth], field)
    turn = turns.turn(number)
    found = judged(turns.drive(tracker(turn, arm), number), turn, turns.robot, number)
    return Outcome(found.error, found.success)


def summaries(found: Mapping[str, Mapping[str, Sequence[Outcome]]]) -> dict[str, dict[str, dict[str, Any]]]:
    """{plant: {arm: summary}}, and of all plants together under ``all``."""
    together = {arm: [item for own in found.values() for item in own[arm]] for arm in ARMS}
    return {
        name: {arm: summary(items) for arm, items in own.items()} for name, own in (*found.items(), ("all", together))
    }


def table(result: Mapping[str, Any]) -> str:
    """Markdown: a row a plant, a column an arm; median / 95th percentile of |e_R|, success, all in percent."""
    lines = [f"| simulator | plant | {' | '.join(ARMS)} |", "|---" * (len(ARMS) + 2) + "|"]
    for simulator in SIMULATORS:
        for name, found in result[simulator].items():
            title = titles().get(name, "**all together**")
            lines.append(f"| {SIMULATORS[simulator]} | {title} | {' | '.join(cell(found[arm]) for arm in ARMS)} |")
    return "\n".join(lines)


SIMULATORS = {"own": "the package's", "other": "the blind benchmark's"}


def titles() -> dict[str, str]:
    """Of plants and truths."""
    return {name: PLANTS[name].title for name in OWN} | {name: truth.title for name, truth in TRUTHS.items()}


def main(words: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--field", type=int, default=4, help="of the blind benchmark's simulator")
    parser.add_argument("--turns", type=int, default=12, help="on each plant by each filter")
    parser.add_argument("--output", type=Path, default=RESULT, help="JSON file; the picture lies beside it")
    given = parser.parse_args(words)
    at_least(**{"--turns": (given.turns, 2), "--field": (given.field, 1)})
    own = dict(driven_on(OWN, tuple(ARMS), given.turns, on_own))
    other = dict(driven_on(tuple(TRUTHS), tuple(ARMS), given.turns, partial(on_other, given.field)))
    result = {
        "command": "python -m benchmarks.accelerometer_trust", "field": given.field,
        "own": summaries(own), "other": summaries(other),
    }  # fmt: skip
    write_json(given.output, result)
    places = {name: f"{'blind: ' if name in TRUTHS else ''}{title}" for name, title in titles().items()}
    shown = {name: found for part in SIMULATORS for name, found in result[part].items() if name != "all"}
    draw(shown, places, given.output.with_suffix(".png"))
    print(table(result))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
