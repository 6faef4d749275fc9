"""How few ordinary drives a calibration needs to be compared with: real drives in which nothing changed.

    python -m benchmarks.few_ordinary_drives CALIBRATION [--parts FOLDER] [--summary]

``CALIBRATION`` and the six ordinary drives of a Warthog are those of :mod:`benchmarks.what_changed`. Every drive, and
every piece of 90 s of it, is fitted and scanned with robot and soil as calibrated without it, and its sizes are
compared with those of every choice of two to five of the other drives, up to the first fit. Counted are comparisons in
which anything is beyond its limit, and beside them the least changes that would be told; both also as they would be if
few drives knew their scatter no better than few drives do (``by few``: 4 + n - 1 degrees of freedom throughout).

Written are figures and a picture (``benchmarks/results/few_ordinary_drives.json``, ``.png``); a run goes on after the
scans in the folder of parts. Half a minute of a core a scan, 39 scans.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.altered_changes import CONTROL
from benchmarks.change_limits import Piece, questions
from benchmarks.drive_sizes import probabilities, written_effects, written_sizes
from benchmarks.pair_scatter import least_scatter
from benchmarks.score_concealed import share
from benchmarks.what_changed import RESULT as CHANGES_RESULT
from benchmarks.what_changed import Drive, answered, drives, parser_of
from ddagr_gym.calibration.ordinary_robot import load_ordinary_robot
from ddagr_gym.diagnosis.change.between_drives import Away, away_from
from ddagr_gym.diagnosis.change.drive_fit import moved_parameters
from ddagr_gym.diagnosis.change.drive_scan import scan_drive
from ddagr_gym.diagnosis.change.expected_scatter import ExpectedScatter
from ddagr_gym.diagnosis.change.measured_scatter import measured_scatter
from ddagr_gym.diagnosis.change.ordinary import Comparison, OrdinaryRobot
from ddagr_gym.diagnosis.change.run import fit_ordinary
from ddagr_gym.diagnosis.change.shifts import LEVEL, family_probability, least_found, single_level
from ddagr_gym.diagnosis.preprocessing.mended_recordings import mend_recordings
from ddagr_gym.diagnosis.wording import title
from ddagr_gym.errors import InputError
from ddagr_gym.files import write_json
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style
from ddagr_gym.reporting.plain_axes import plain_log

Array = NDArray[np.float64]

RESULT = CHANGES_RESULT.with_name("few_ordinary_drives.json")
COMMAND = "python -m benchmarks.few_ordinary_drives"
COUNTS = (2, 3, 4, 5)
"""Numbers of ordinary drives that a drive is compared with."""
NOW, BY_FEW = "as it is", "by few"


def scanned(drive: Drive, ordinary: OrdinaryRobot) -> dict[str, Any]:
    """What a drive and the other ordinary ones say of every effect and parameter, as JSON has it.

    Args:
        drive: or a piece of it.
        ordinary: the robot calibrated with all drives.
    """
    try:
        return {"drive": drive.name, "ground": drive.ground, "verdict": "scanned", **_scan(drive, ordinary)}
    except InputError as error:
        return {"drive": drive.name, "ground": drive.ground, "refused": str(error)}


def _scan(drive: Drive, ordinary: OrdinaryRobot) -> dict[str, Any]:
    mended = mend_recordings([drive.with_change(CONTROL)])
    known = ordinary.without(drive.file).seen_by(mended.recordings, drive.ground)
    problem, fitted = fit_ordinary(mended, known, drive.ground)
    scan, comparison = scan_drive(problem, fitted), known.comparison(drive.ground)
    named = [item for item in scan.compared if item.name not in comparison.unnamed]
    effects = written_effects(named, (scan.scores(), *comparison.drives))
    return {"effects": effects, "moved": [moved_parameters(problem, fitted), *map(dict, comparison.moved)]}


def compared(item: Mapping[str, Any], chosen: Sequence[int], ground: str, rule: str) -> Away:
    """Sizes of one candidate against some of the ordinary drives.

    Args:
        item: an effect of :func:`scanned`.
        chosen: numbers of ordinary drives, from 0.
        ground: "" where it is not known.
        rule: :data:`NOW`, or :data:`BY_FEW`.
    """
    measured = measured_scatter()
    expected = (measured.same_ground if ground else measured.other_ground).of_calibrations
    here, *others = (
        written_sizes(entry, entry["windows"] if rule == NOW else 0.0)
        for entry in (item["drives"][0], *(item["drives"][number + 1] for number in chosen))
    )
    k = len(here.value)
    structure = expected.deviations.get(item["effect"], least_scatter(item["has_sizes"])) ** 2 * np.eye(k)
    return away_from(here, others, (), structure, np.ones(k), expected if rule == NOW else ExpectedScatter())


def surest(scan: Mapping[str, Any], chosen: Sequence[int], rule: str) -> tuple[float, str]:
    """Probability of an ordinary drive to show anything as far away, and what is; arguments as of :func:`compared`."""
    moved = tuple(scan["moved"][number + 1] for number in chosen)
    against = Comparison((None,) * len(chosen), moved=moved)  # type: ignore[arg-type]
    found = probabilities(scan, lambda item: compared(item, chosen, scan["ground"], rule), against)
    name = min(found, key=found.__getitem__)
    return family_probability(found[name], _tests(scan)), name


def least_told(scan: Mapping[str, Any], chosen: Sequence[int], rule: str) -> dict[str, float]:
    """Least change of each effect that would be told, in least sizes that matter; arguments alike."""
    found: dict[str, float] = {}
    for item in scan["effects"]:
        if item["has_sizes"] and item["effect"] not in found:
            away = compared(item, chosen, scan["ground"], rule)
            found[item["effect"]] = float(least_found(away.covariance, away.degrees, single_level(_tests(scan))).max())
    return found


def _tests(scan: Mapping[str, Any]) -> int:
    return len(scan["effects"]) + len(scan["moved"][0])


def figures(scans: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Shares of alarms and least changes by number of drives and rule."""
    known = [scan for scan in scans if "refused" not in scan]
    return {str(count): {rule: _figures(known, count, rule) for rule in (NOW, BY_FEW)} for count in COUNTS}


def _figures(scans: Sequence[Mapping[str, Any]], count: int, rule: str) -> dict[str, Any]:
    said, least = [], dict[str, list[float]]()
    for scan in scans:
        for chosen in combinations(range(len(scan["moved"]) - 1), count):
            probability, name = surest(scan, chosen, rule)
            said.append((probability < LEVEL, scan["drive"], name))
            for effect, size in least_told(scan, chosen, rule).items():
                least.setdefault(effect, []).append(size)
    alarms = sorted({f"{drive}: {name}" for alarm, drive, name in said if alarm})
    return {
        "alarms": share([alarm for alarm, _, _ in said]),
        "of": alarms,
        "least": {name: float(f"{np.median(sizes):.3g}") for name, sizes in sorted(least.items())},
    }


def draw(found: Mapping[str, Any], path: Path) -> None:
    """Least changes by number of drives, with both rules."""
    from matplotlib.figure import Figure

    names = sorted(found[str(COUNTS[-1])][NOW]["least"], key=title, reverse=True)
    with house_style():
        figure = Figure(figsize=(9.0, 1.2 + 0.3 * len(names)), layout="constrained")
        panels = figure.subplots(1, len(COUNTS), sharey=True, sharex=True)
        for panel, count in zip(panels, COUNTS, strict=True):
            for rule, colour in ((BY_FEW, palette.GREY), (NOW, palette.BLUE)):
                sizes = found[str(count)][rule]["least"]
                panel.plot([sizes[name] for name in names], range(len(names)), "o", ms=4, color=colour)
            alarms = found[str(count)][NOW]["alarms"]
            panel.set_title(f"{count} ordinary drives\n{100.0 * alarms['value']:.0f} % alarms", fontsize=9)
            plain_log(panel)
        panels[0].set_yticks(range(len(names)), [title(name) for name in names], fontsize=8)
        figure.supxlabel("least change that would be told, in least sizes that matter (grey: by few)", fontsize=9)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=120))


def main(arguments: Sequence[str] | None = None) -> int:
    """Scan, compare, draw."""
    given = parser_of(__doc__, RESULT).parse_args(arguments)
    try:
        ordinary = load_ordinary_robot(given.calibration)
    except InputError as error:
        print(f"{error}", file=sys.stderr)
        return 2
    asked = ((name, partial(scanned, drive, ordinary)) for name, drive in asked_about())
    scans = answered(asked, given.parts / ordinary.digest[:12], not given.summary)
    found = figures(scans)
    write_json(given.output, {"command": COMMAND, "scans": len(scans), "figures": found})
    draw(found, given.output.with_suffix(".png"))
    for count, rules in found.items():
        print(count, {rule: entry["alarms"] for rule, entry in rules.items()})
    return 0


def asked_about() -> Iterator[tuple[str, Drive]]:
    """All drives, and their pieces, by name."""
    for drive in drives().values():
        yield drive.name.replace("/", "_"), drive
    for question in questions():
        if question.piece is not None:
            yield question.name, Piece(question.drive.name, question.drive.ground, question.piece)


if __name__ == "__main__":
    sys.exit(main())
