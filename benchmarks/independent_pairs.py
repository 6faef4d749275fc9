"""How much two ordinary drives differ in a simulator that shares no code with the package's, driven in other ways.

    python -m benchmarks.independent_pairs [--pairs N] [--workers N] [--cluster ADDRESS] [--summary]

Pairs in which nothing changed, of the open set of :mod:`benchmarks.changed_pairs` (seed 1; half of them with a
structure that no effect of the library has): three drives before and one after, with other manoeuvres on another patch
of the field, on another day. Each is compared as ``ddagr diagnose --before`` does, up to the first fit. From the sizes
of all effects, the moves of parameters and what is left of the channels follow, by maximum likelihood of the t
distributions with which the package judges them (equations (2) of :mod:`ddagr_gym.diagnosis.change.shifts` and (1) of
:mod:`~ddagr_gym.diagnosis.change.channel_rises`),

* the scatter of each effect, in least sizes that matter,
* prior deviations by which drives move each parameter of robot and soil,
* deviations of what is left of each channel,

and the most degrees of freedom with which no more than 5 % of the pairs raise any alarm. Beside them stands the least
change of each effect that this comparison could show if ordinary drives differed by the noise of their readings alone:
the floor for drives of that length. Written are the sizes and a picture (``benchmarks/results/independent_pairs.json``,
``.png``); ``python -m benchmarks.simulated_pairs --summary`` puts them into what the package ships. A run goes on after
the pairs that it finished before.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks import drive_sizes
from benchmarks.changed_pairs.answers import SOIL, recordings_of
from benchmarks.changed_pairs.plan import Pair, plan
from benchmarks.drive_sizes import written_effects, written_sizes
from benchmarks.pair_scatter import DEGREES, MOST, least_scatter, log_density, most_likely, rounded
from ddagr_gym.diagnosis.change.before_drives import GROUND, robot_of_before
from ddagr_gym.diagnosis.change.between_drives import Away, away_from
from ddagr_gym.diagnosis.change.channel_rises import channel_rises
from ddagr_gym.diagnosis.change.drive_fit import moved_parameters
from ddagr_gym.diagnosis.change.drive_scan import scan_drive
from ddagr_gym.diagnosis.change.expected_scatter import ExpectedScatter
from ddagr_gym.diagnosis.change.ordinary import Comparison
from ddagr_gym.diagnosis.change.run import fit_ordinary
from ddagr_gym.diagnosis.change.shifts import LEVEL, family_probability, least_found, single_level
from ddagr_gym.diagnosis.preprocessing.mended_recordings import mend_recordings
from ddagr_gym.diagnosis.wording import title
from ddagr_gym.files import write_text
from ddagr_gym.identification.misfit import channel_misfit
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style
from ddagr_gym.tasks import ResultStore, Task, TaskRunner, run_tasks

Array = NDArray[np.float64]

RESULT = Path(__file__).resolve().parent / "results" / "independent_pairs.json"
COMMAND = "python -m benchmarks.independent_pairs"
SEED = 1
LEAST_MOVE, MOST_MOVE = 1.0, 10.0
"""Of the prior deviations that are tried."""
MANY = 1e6
"""Degrees of freedom of what is known for sure."""
LEAST_RISE, MOST_RISE = 0.1, 3.0
"""Of the deviations of a channel's logarithm that are tried."""


def ordinary_pairs(count: int) -> list[Pair]:
    """The first pairs of the open set in which nothing changed."""
    return [pair for pair in plan(SEED) if not pair.case.effects][:count]


def compared(pair: Pair) -> dict[str, Any]:
    """What the drives of a pair say of every effect, parameter and channel, as JSON has it."""
    robot = get_robot(pair.robot)
    before, after = recordings_of(pair, SEED)
    mended = mend_recordings(after)
    known = robot_of_before(mend_recordings(before), robot, get_soil(SOIL)).seen_by(mended.recordings, GROUND)
    problem, fitted = fit_ordinary(mended, known, GROUND)
    scan = scan_drive(problem, fitted)
    comparison = known.comparison(GROUND)
    return {
        "pair": pair.name,
        "structure": pair.case.structure,
        "effects": written_effects(scan.compared, (scan.scores(), *comparison.drives)),
        "moved": [moved_parameters(problem, fitted), *map(dict, comparison.moved)],
        "misfits": [channel_misfit(problem, fitted), *map(dict, comparison.misfits)],
    }


def _away(item: Mapping[str, Any], scatter: float, known: float) -> Away:
    """Sizes of one candidate in the drive after against those before."""
    here, *others = (written_sizes(drive) for drive in item["drives"])
    k = len(here.value)
    return away_from(here, others, (), scatter**2 * np.eye(k), np.ones(k), ExpectedScatter(degrees=known))


def scatter_of(pairs: Sequence[Mapping[str, Any]], known: float) -> dict[str, float]:
    """Scatter of each effect in least sizes that matter, by maximum likelihood.

    Args:
        pairs: of :func:`compared`.
        known: degrees of freedom of what is expected.
    """
    by_effect: dict[str, list[Mapping[str, Any]]] = {}
    for pair in pairs:
        for item in pair["effects"]:
            by_effect.setdefault(item["effect"], []).append(item)
    found = {}
    for name, items in by_effect.items():
        least = least_scatter(items[0]["has_sizes"])
        found[name] = most_likely(least, MOST, lambda s, items=items: _likelihood(items, s, known))
    return found


def _likelihood(items: Sequence[Mapping[str, Any]], scatter: float, known: float) -> float:
    away = (_away(item, scatter, known) for item in items)
    return sum(log_density(item.value, item.covariance, item.degrees) for item in away)


def moves_of(pairs: Sequence[Mapping[str, Any]], known: float) -> dict[str, float]:
    """Prior deviations by which drives move each parameter of robot and soil, most likely ones; arguments alike."""
    names = [name for name in pairs[0]["moved"][0] if "bias" not in name]

    def density(name: str, move: float) -> float:
        expected = ExpectedScatter(moves={name: move}, degrees=known)
        values = [(pair["moved"][0][name], _comparison(pair, expected)) for pair in pairs]
        return sum(_of_number(value, against.usual_move(name), against.move_degrees) for value, against in values)

    return {name: most_likely(LEAST_MOVE, MOST_MOVE, lambda move, name=name: density(name, move)) for name in names}


def _of_number(value: float, deviation: float, degrees: float) -> float:
    """Logarithm of the density of one number."""
    return log_density(np.array([value]), np.array([[deviation**2]]), degrees)


def rises_of(pairs: Sequence[Mapping[str, Any]], known: float) -> dict[str, float]:
    """Deviation of the logarithm of what is left of each channel, by maximum likelihood; arguments alike."""

    def density(name: str, rise: float) -> float:
        expected = ExpectedScatter(rises={name: rise}, degrees=known)
        found = [channel_rises({name: pair["misfits"][0][name]}, pair["misfits"][1:], expected)[0] for pair in pairs]
        return sum(_of_number(item.distance * item.deviation, item.deviation, item.degrees) for item in found)

    names = pairs[0]["misfits"][0]
    return {name: most_likely(LEAST_RISE, MOST_RISE, lambda rise, name=name: density(name, rise)) for name in names}


def _comparison(pair: Mapping[str, Any], expected: ExpectedScatter) -> Comparison:
    return Comparison((None,) * (len(pair["moved"]) - 1), expected=expected, moved=tuple(pair["moved"][1:]))  # type: ignore[arg-type]


def probabilities(pair: Mapping[str, Any], expected: ExpectedScatter) -> dict[str, float]:
    """Of an ordinary drive to show as much as the drive after: of each effect's worst candidate, parameter and channel.

    Args:
        pair: of :func:`compared`.
        expected: scatter before any data.
    """

    def away(item: Mapping[str, Any]) -> Away:
        usual = least_scatter(item["has_sizes"])
        return _away(item, expected.deviations.get(item["effect"], usual), expected.degrees)

    found = drive_sizes.probabilities(pair, away, _comparison(pair, expected))
    for rise in channel_rises(pair["misfits"][0], pair["misfits"][1:], expected):
        found[rise.channel] = rise.probability
    return found


def alarms(pairs: Sequence[Mapping[str, Any]], expected: ExpectedScatter) -> float:
    """Share of pairs of which anything is out of the ordinary; arguments as of :func:`probabilities`."""
    raised = []
    for pair in pairs:
        raised.append(family_probability(min(probabilities(pair, expected).values()), _tests(pair)) < LEVEL)
    return float(np.mean(raised))


def fitted_expectation(pairs: Sequence[Mapping[str, Any]]) -> ExpectedScatter:
    """Scatter, moves and rises with the most degrees of freedom that keep the level of alarms; argument alike."""
    for degrees in DEGREES:
        expected = ExpectedScatter(
            scatter_of(pairs, degrees), degrees, moves_of(pairs, degrees), rises_of(pairs, degrees)
        )
        if alarms(pairs, expected) <= LEVEL:
            break
    return expected


def crossed_alarms(pairs: Sequence[Mapping[str, Any]]) -> float:
    """Share of alarms of each half of the pairs by what the other half expects; argument alike."""
    halves = [list(pairs[half::2]) for half in (0, 1)]
    found = [alarms(mine, fitted_expectation(other)) for mine, other in zip(halves, reversed(halves), strict=True)]
    return float(np.mean(found))


def least_by_noise(pairs: Sequence[Mapping[str, Any]]) -> dict[str, list[float]]:
    """Least change of every size of each effect, in least sizes that matter, if drives differed by noise alone.

    It passes the limit of all tests with the usual power in half of the pairs; of an effect with several candidates
    the first one counts.

    Args:
        pairs: of :func:`compared`.
    """
    found: dict[str, list[Array]] = {}
    for pair in pairs:
        tests, seen = _tests(pair), set[str]()
        for item in pair["effects"]:
            if item["has_sizes"] and item["effect"] not in seen:
                seen.add(item["effect"])
                found.setdefault(item["effect"], []).append(_least_by_noise(item, tests))
    return {name: rounded(np.median(values, axis=0), 3) for name, values in sorted(found.items())}


def _least_by_noise(item: Mapping[str, Any], tests: int) -> Array:
    here, *others = (np.array(drive["within"]) for drive in item["drives"])
    return least_found(here + np.mean(others, axis=0) / len(others), MANY, single_level(tests))


def _tests(pair: Mapping[str, Any]) -> int:
    return len(pair["effects"]) + len(pair["moved"][0]) + len(pair["misfits"][0])


def draw(pairs: Sequence[Mapping[str, Any]], expected: ExpectedScatter, path: Path) -> None:
    """How probable the sizes, moves and rises of every pair are, against the limit of all of them together."""
    from matplotlib.figure import Figure

    found = [probabilities(pair, expected) for pair in pairs]
    names = list(dict.fromkeys(name for item in found for name in item))[::-1]
    tests = max(map(_tests, pairs))
    with house_style():
        figure = Figure(figsize=(7.5, 1.0 + 0.22 * len(names)), layout="constrained")
        axis = figure.subplots()
        for item in found:
            values = [(value, names.index(name)) for name, value in item.items() if value < 1.0]
            axis.plot(*zip(*values, strict=True), "o", ms=3, color=palette.BLUE, alpha=0.35)
        axis.axvline(-math.expm1(math.log1p(-LEVEL) / tests), color=palette.INK, lw=0.9)
        axis.set_xscale("log")
        axis.set_yticks(range(len(names)), [title(name) for name in names])
        axis.set_xlabel("probability of as much in an ordinary drive (line: an alarm)")
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=110))


def summary(pairs: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """What follows from pairs, as JSON has it."""
    known = list(pairs)
    expected = fitted_expectation(known)
    return {
        "count": len(known),
        "degrees": expected.degrees,
        "deviations": _sorted(expected.deviations),
        "moves": _sorted(expected.moves),
        "rises": _sorted(expected.rises),
        "false_alarms": alarms(known, expected),
        "false_alarms_crossed": crossed_alarms(known),
        "least_by_noise": least_by_noise(known),
    }


def _sorted(values: Mapping[str, float]) -> dict[str, float]:
    return {name: float(f"{value:.3g}") for name, value in sorted(values.items())}


def expectation_of(found: Mapping[str, Any]) -> ExpectedScatter:
    """The expectation of a :func:`summary`."""
    return ExpectedScatter(found["deviations"], found["degrees"], found["moves"], found["rises"])


def main(arguments: Sequence[str] | None = None) -> None:
    """Drive, compare and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=40, help="number of pairs")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--parts", type=Path, default=RESULT.with_suffix(".parts"), help="folder of finished pairs")
    parser.add_argument("--cluster", default="", help="local, or the address of a Ray cluster")
    parser.add_argument("--summary", action="store_true", help="only what follows from the pairs that are written")
    given = parser.parse_args(arguments)
    if given.summary:
        _write(json.loads(RESULT.read_text())["pairs"])
        return
    tasks = [Task(pair.name, compared, (pair,), key=pair.name) for pair in ordinary_pairs(given.pairs)]
    with TaskRunner(given.workers, cluster=given.cluster) as runner:
        pairs = run_tasks(tasks, "pairs", runner, ResultStore(given.parts))
    _write(pairs)


def _write(pairs: Sequence[Mapping[str, Any]]) -> None:
    """Results and picture of pairs."""
    found = summary(pairs)
    body = {"command": COMMAND, "seed": SEED, **found, "pairs": pairs}
    write_text(RESULT, json.dumps(body, separators=(",", ":")) + "\n")
    draw(pairs, expectation_of(found), RESULT.with_suffix(".png"))
    print({name: found[name] for name in ("degrees", "false_alarms", "false_alarms_crossed", "moves", "rises")})


if __name__ == "__main__":
    main()
