"""Real drives into which a known change was written: does the diagnosis name it, and how large does it find it?

    python -m benchmarks.altered_drives [--output benchmarks/results/altered_drives.json] [--limit N] [--parts DIR]

The open drives of ``shared/recordings`` are ordinary. A copy of each is altered in one thing that goes wrong with
recordings (a clock that is late, a scaled encoder, a turned IMU, a gyro with another sensitivity or sign) and goes
through ``ddagr diagnose --names-only`` with the options of ``answers/run_diagnoses.py`` for real drives. The changes
are arithmetic on the columns of the file and share no code with the effects or the diagnosis. Their sizes are those
that a field engineer meets; they were fixed before the first run and are not tuned to what is found. The last two rows
are gross errors, added when it was known which sizes the diagnosis says it can show in these drives.

Read the figures with three things in mind.

- The controls, in which nothing was changed, are no evidence against false alarms: the bank of Warthog drives that
  ships with the package was made from pieces of these same three drives (``answers/README.md``).
- The drives have delays, biases and a ground of their own, which are not known. Where the control names the effect
  that was written, its size there is added to the truth; where it does not, the size that was written is the truth.
- A diagnosis states the least size that it can show. Cases are scored all together, and those alone whose size
  reaches what the control of their drive states.

Copies lie in a temporary folder while they are diagnosed. Finished cases are kept in the folder of parts with their
options and commit, under a hash of the altered file and of the bank; the same command goes on from there. A part is
not made anew when the diagnosis itself was changed: then remove the folder.
"""

from __future__ import annotations

import argparse
import csv
import gzip
import hashlib
import io
import json
import math
import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.answers.run_diagnoses import REAL_BANK, UNKNOWN_GROUND, Case, InterruptedRunError, diagnose, shared
from benchmarks.concealed_truth import sizes
from benchmarks.score_concealed import in_set, mean, names_of, right, share
from ddagr_gym.physics.effects.registry import effect_kind
from ddagr_gym.recordings.checks.run import check_recording
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.recordings.load import load_recording
from ddagr_gym.reporting import palette
from ddagr_gym.reporting.figures import house_style

Array = NDArray[np.float64]
Table = Mapping[str, Sequence[str]]
"""Columns of a file as text, so that what is not altered stays as it was."""

RESULT = Path(__file__).resolve().parent / "results" / "altered_drives.json"
DRIVES = ("warthog_asphalt", "warthog_grass", "warthog_sand")
ROBOT = "warthog"
OPTIONS = ("--names-only",)

STEPS = 16
"""Of a drive in steps, from its start: 96 s under command, about as long as the drive on grass is (135 s)."""

LATE_POSES = 0.5
"""A pose computer whose clock was never synchronised, or a solution stamped on arrival [s]."""

LATE_SENSORS = 0.3
"""Commands logged on another computer than the sensors, whose clock is ahead [s]."""

SCALE = 1.1
"""A worn or wrong gear, tyre or full scale in a table; of encoders and gyro."""

TURNED = 0.3
"""An IMU fixed by eye to a bracket that is not square to the robot (17 degrees) [rad]."""

TILTED = math.radians(3.0)
"""An IMU on a deck that hangs forward [rad]."""

DOUBLED = 2.0
"""Encoders of which both edges are counted where the driver expects one."""

QUARTER_TURN = math.pi / 2.0
"""An IMU whose axes were taken from the wrong drawing [rad]."""

LIMIT = 1800.0
"""Of one run [s]."""


@dataclass(frozen=True)
class Layout:
    """Names of the columns in one form of file.

    Attributes:
        commands: what the robot was told, the time, and what counts the rows: all that no sensor wrote.
        encoders: which the log repeats between updates.
        pose: likewise, with the mark of a new one.
        accelerometer: x, y, z.
        gyro: x, y, z; "" where the file has none.
    """

    commands: tuple[str, ...]
    encoders: tuple[str, ...]
    pose: tuple[str, ...]
    accelerometer: tuple[str, str, str]
    gyro: tuple[str, str, str]


IN_STEPS = Layout(
    ("seq", "calib_step", "window", "t", "phase", "cmd_left", "cmd_right"), ("enc_left", "enc_right"),
    ("x", "y", "z", "roll", "pitch", "yaw"), ("imu_ax", "imu_ay", "imu_az"), ("", "", "imu_gz"),
)  # fmt: skip
CONTINUOUS = Layout(
    ("t", "calib_state", "calib_step", "cmd_v", "cmd_w"), ("enc_left", "enc_right"),
    ("icp_x", "icp_y", "icp_z", "icp_roll", "icp_pitch", "icp_yaw", "icp_new"), ("acc_x", "acc_y", "acc_z"),
    ("gyro_x", "gyro_y", "gyro_z"),
)  # fmt: skip
JOIN = 0.05
"""Missing between two windows of a step [s]."""


@dataclass(frozen=True)
class Change:
    """What is written into a drive.

    Attributes:
        name: in the result.
        words: in the picture.
        effect: that it is in the library; "none" for nothing.
        truth: its sizes there, by field.
        write: gives the altered columns.
    """

    name: str
    words: str
    effect: str
    truth: Mapping[str, float] = field(default_factory=dict)
    write: Callable[[Table], Table] = lambda table: table


def layout_of(table: Table) -> Layout:
    """Layout of a file by its columns."""
    return IN_STEPS if "seq" in table else CONTINUOUS


def numbers(table: Table, name: str) -> Array:
    """A column as numbers."""
    return np.array([float(text) for text in table[name]])


def texts(values: Array) -> list[str]:
    """Numbers as a file holds them; NaN is an empty field."""
    return ["" if math.isnan(value) else f"{value:.9g}" for value in values]


def step_numbers(table: Table) -> Array:
    """Number of the step of each row; zero in a drive without steps."""
    return numbers(table, "seq") if "seq" in table else np.zeros(len(table["t"]))


def rows_before(table: Table, seconds: float) -> NDArray[np.int64]:
    """Row of each row that many seconds earlier in the same step, -1 where there is none.

    Args:
        table: in the order of time; without steps it is one.
        seconds: a multiple of the log's period, which it meets within jitter.
    """
    step = step_numbers(table)
    clock = numbers(table, "t") + (JOIN * numbers(table, "window") if "window" in table else 0.0)
    found = np.full(len(clock), -1, dtype=np.int64)
    for number in np.unique(step):
        rows = np.flatnonzero(step == number)
        slack = 0.5 * float(np.median(np.diff(clock[rows])))
        before = np.searchsorted(clock[rows], clock[rows] - seconds + slack) - 1
        found[rows] = np.where(before >= 0, rows[np.maximum(before, 0)], -1)
    return found


def late(table: Table, names: Sequence[str], seconds: float) -> Table:
    """Columns as a log writes them whose sources are late.

    Rows before the first late sample of a step repeat that step's first one where the log repeats samples, and are
    empty elsewhere: the diagnosis takes neither for a new sample.

    Args:
        table: of the drive.
        names: of the columns.
        seconds: by which they are late [s].
    """
    layout, before = layout_of(table), rows_before(table, seconds)
    _, first, step = np.unique(step_numbers(table), return_index=True, return_inverse=True)
    altered = dict(table)
    for name in names:
        column = table[name]
        repeated = name not in (*layout.accelerometer, *layout.gyro)
        altered[name] = [
            column[row] if row >= 0 else column[start] if repeated else ""
            for row, start in zip(before, first[step], strict=True)
        ]
    return altered


def late_poses(table: Table) -> Table:
    """Poses of some time ago under the present stamp."""
    return late(table, layout_of(table).pose, LATE_POSES)


def late_sensors(table: Table) -> Table:
    """Everything but the commands late: the robot seems to answer that much later, as with a dead time."""
    return late(table, [name for name in table if name not in layout_of(table).commands], LATE_SENSORS)


def scaled(table: Table, names: Sequence[str], factor: float) -> Table:
    """Columns times a factor."""
    return {**table, **{name: texts(factor * numbers(table, name)) for name in names}}


def turned(table: Table, axes: Array) -> Table:
    """Readings of an IMU in other axes; a gyro axis that the file lacks reads nothing.

    Args:
        table: of the drive.
        axes: of the sensor in the robot's frame, (3, 3), one a column.
    """
    layout, altered = layout_of(table), dict(table)
    for triad in (layout.accelerometer, layout.gyro):
        known = [numbers(table, name) if name else np.zeros(len(table["t"])) for name in triad]
        for name, values in zip(triad, axes.T @ np.stack(known), strict=True):
            if name:
                altered[name] = texts(values)
    return altered


def about_vertical(angle: float) -> Array:
    """Axes turned counter-clockwise [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def nose_down(angle: float) -> Array:
    """Axes pitched about y (REP 103) [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def _yaw_rate(table: Table) -> tuple[str]:
    return (layout_of(table).gyro[2],)


def _both(factor: float) -> dict[str, float]:
    return {"right": factor, "left": factor}


CONTROL = Change("nothing", "nothing (control)", "none")
CHANGES = (
    CONTROL,
    Change("late_poses", f"poses {LATE_POSES:g} s late", "pose_latency", {"latency": LATE_POSES}, late_poses),
    Change(
        "late_sensors", f"sensors {LATE_SENSORS:g} s after commands", "command_delay", {"delay": LATE_SENSORS},
        late_sensors,
    ),
    Change(
        "encoders_scaled", f"encoders times {SCALE:g}", "encoder_scale", _both(SCALE),
        lambda table: scaled(table, layout_of(table).encoders, SCALE),
    ),
    Change(
        "imu_turned", f"IMU turned {TURNED:g} rad", "imu_misalignment", {"yaw": TURNED},
        lambda table: turned(table, about_vertical(TURNED)),
    ),
    Change(
        "imu_tilted", "IMU pitched 3 degrees", "imu_tilt", {"pitch": TILTED},
        lambda table: turned(table, nose_down(TILTED)),
    ),
    Change(
        "gyro_scaled", f"yaw rate times {SCALE:g}", "gyro_scale", {"scale": SCALE},
        lambda table: scaled(table, _yaw_rate(table), SCALE),
    ),
    Change("gyro_reversed", "yaw rate reversed", "gyro_sign", {}, lambda table: scaled(table, _yaw_rate(table), -1.0)),
    Change(
        "encoders_doubled", f"encoders times {DOUBLED:g}", "encoder_scale", _both(DOUBLED),
        lambda table: scaled(table, layout_of(table).encoders, DOUBLED),
    ),
    Change(
        "imu_quarter_turn", "IMU turned 90 degrees", "imu_misalignment", {"yaw": QUARTER_TURN},
        lambda table: turned(table, about_vertical(QUARTER_TURN)),
    ),
)  # fmt: skip


def read_table(path: Path, steps: int = STEPS) -> Table:
    """Columns of a drive; of one in steps the first ones.

    Args:
        path: gzip CSV.
        steps: to keep.
    """
    with gzip.open(path, "rt", newline="") as stream:
        head, *rows = csv.reader(stream)
    if "seq" in head:
        place = head.index("seq")
        rows = [row for row in rows if int(row[place]) < steps]
    return dict(zip(head, map(list, zip(*rows, strict=True)), strict=True))


def packed(table: Table) -> bytes:
    """The file of a table; the same table gives the same bytes."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table)
    writer.writerows(zip(*table.values(), strict=True))
    return gzip.compress(text.getvalue().encode(), mtime=0)


def altered_files(folder: Path, to: Path, limit: int | None) -> Iterator[tuple[str, Change, Path]]:
    """Write the altered drives, all drives of a change after each other.

    Args:
        folder: of the open drives.
        to: where.
        limit: on how many; None for all.
    """
    for number, (change, drive) in enumerate((change, drive) for change in CHANGES for drive in DRIVES):
        if limit is not None and number >= limit:
            return
        content = packed(change.write(read_table(folder / f"{drive}.csv.gz")))
        digest = hashlib.sha256(content + REAL_BANK.read_bytes()).hexdigest()[:12]
        path = to / f"{drive}_{change.name}_{digest}.csv.gz"
        path.write_bytes(content)
        yield drive, change, path


def answer_of(path: Path, parts: Path, threads: int) -> dict[str, Any]:
    """What the diagnosis says of a file, and what its checks suspect; from its part where that is there.

    Args:
        path: of the altered drive.
        parts: folder of finished answers.
        threads: of the simulator.
    """
    arguments = (str(path), "--robot", ROBOT, *UNKNOWN_GROUND, "--thresholds", str(REAL_BANK))
    answer = diagnose(Case(path.name.split(".", 1)[0], arguments, OPTIONS), parts, threads, LIMIT)
    report = check_recording(load_recording(path, None, ROBOT), np.random.default_rng(0))
    return {**answer, "suspects": sorted({name for finding in report.suspicious for name in finding.suspects})}


def scored(drive: str, change: Change, answer: Mapping[str, Any], control: Mapping[str, Any]) -> dict[str, Any]:
    """Entry of one case.

    Args:
        drive: name.
        change: that was written.
        answer: of the altered drive.
        control: answer of the drive as it is.
    """
    label = {"verdict": [change.effect]}
    truth = with_own(change, control)
    return {
        "drive": drive,
        "change": change.name,
        "effect": change.effect,
        "written": dict(change.truth),
        "truth": truth,
        "detectable": detectable(change, control),
        "verdict": answer["verdict"],
        "right": right(label, answer),
        "named": change.effect in answer["verdict"],
        "in_set": change.effect in answer["verdict"] or in_set(label, answer),
        "suspected_by_checks": change.effect in answer["suspects"],
        "suspects_of_checks": answer["suspects"],
        "found": sizes(answer),
        "equivalence": [finding["equivalence_set"] for finding in answer["findings"]],
        "covered": covered(change.effect, truth, answer),
        "complete": answer["complete"],
        "seconds": answer["seconds"],
        "commit": answer["commit"],
        "options": answer["options"],
        **({"failure": answer["failure"]} if "failure" in answer else {}),
    }


def with_own(change: Change, control: Mapping[str, Any]) -> dict[str, float]:
    """Sizes that are to be found: those that were written, and beyond neutral what the control names of its own."""
    own = sizes(control).get(change.effect, {}) if change.effect in control["verdict"] else {}
    return {
        name: value + (own[name]["value"] - _neutral(change.effect, name) if name in own else 0.0)
        for name, value in change.truth.items()
    }


def _neutral(effect: str, name: str) -> float:
    return float(effect_kind(effect).parameter(name).metadata["neutral"])


def detectable(change: Change, control: Mapping[str, Any]) -> bool | None:
    """Whether one of the sizes reaches what the control says it can show; always without a size, None for nothing."""
    if change is CONTROL:
        return None
    limits = (control.get("detectable") or {}).get(change.effect)
    if not change.truth or limits is None:
        return True
    return any(
        limits[name] is not None and abs(value - _neutral(change.effect, name)) >= limits[name]
        for name, value in change.truth.items()
    )


def covered(effect: str, truth: Mapping[str, float], answer: Mapping[str, Any]) -> dict[str, bool]:
    """By field, whether the 90 % interval holds the truth; empty where the effect is not named."""
    found = sizes(answer).get(effect, {}) if effect in answer["verdict"] else {}
    stated = {name: found[name]["interval"] for name in truth if name in found and found[name]["interval"]}
    return {name: low <= truth[name] <= high for name, (low, high) in stated.items()}


def figures(cases: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Shares with their intervals, and the cases that went wrong.

    Args:
        cases: entries of :func:`scored`.
    """
    controls = [case for case in cases if case["change"] == CONTROL.name]
    altered = [case for case in cases if case["change"] != CONTROL.name]
    shown = [case for case in altered if case["detectable"]]
    return {
        "controls_not_none": share([case["verdict"] != ["none"] for case in controls]),
        **{f"{test}_all": share([case[test] for case in altered]) for test in ("right", "named", "in_set")},
        **{f"{test}_detectable": share([case[test] for case in shown]) for test in ("right", "named", "in_set")},
        "noticed_all": share([case["verdict"] != ["none"] for case in altered]),
        "noticed_detectable": share([case["verdict"] != ["none"] for case in shown]),
        "suspected_by_checks_all": share([case["suspected_by_checks"] for case in altered]),
        "wrong_name_all": share([bool(names_of(case)) and not case["in_set"] for case in altered]),
        "sure_of_wrong_name_all": share(
            [bool(names_of(case)) and not case["in_set"] and case["complete"] for case in altered]
        ),
        "coverage": share([held for case in altered for held in case["covered"].values()]),
        "seconds": mean([float(case["seconds"]) for case in cases]),
        "failed_runs": share(["failure" in case for case in cases]),
        "failures": [dict(case) for case in cases if not case["right"]],
    }


def outcome(case: Mapping[str, Any]) -> tuple[str, str]:
    """Colour and words of a case in the picture."""
    if "failure" in case:
        return palette.VERMILLION, "failed"
    said = ", ".join(case["verdict"]).replace("_", " ")
    found = case["found"].get(case["effect"], {}) if case["named"] else {}
    size = ", ".join(f"{found[name]['value']:.2g}" for name in case["truth"] if name in found)
    words = f"{said}\n{size}" if size else said
    if case["right"]:
        return palette.GREEN, words
    if case["in_set"]:
        return palette.SKY_BLUE, words
    if names_of(case):
        return palette.ORANGE, words
    return (palette.PALE_ORANGE if case["verdict"] == ["unknown"] else palette.PALE), words


LEGEND = (
    (palette.GREEN, "right"), (palette.SKY_BLUE, "in the set, or among others"), (palette.ORANGE, "other name"),
    (palette.PALE_ORANGE, "unknown"), (palette.PALE, "none"), (palette.VERMILLION, "failed"),
)  # fmt: skip


def draw(cases: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Grid of changes and drives with what was said, as PNG, all or nothing.

    Args:
        cases: entries of :func:`scored`.
        path: where.
    """
    shown = [change for change in CHANGES if any(case["change"] == change.name for case in cases)]
    rows = [change.name for change in shown]
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(8.2, 1.3 + 0.46 * len(rows)), layout="constrained")
        panel = figure.subplots()
        for case in cases:
            _cell(panel, DRIVES.index(case["drive"]), rows.index(case["change"]), case)
        panel.set_xticks(range(len(DRIVES)), [drive.replace("_", " ") for drive in DRIVES])
        panel.set_yticks(range(len(rows)), [change.words for change in shown])
        panel.set(xlim=(-0.5, len(DRIVES) - 0.5), ylim=(len(rows) - 0.5, -0.5))
        panel.grid(visible=False)
        panel.tick_params(length=0)
        panel.set_title("What was said of real drives into which a change was written; size found, where named")
        _legend(figure)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=130))


def _cell(panel: Any, column: int, row: int, case: Mapping[str, Any]) -> None:
    """One case; a frame where the size reaches what the control says it can show."""
    from matplotlib.patches import Rectangle

    colour, words = outcome(case)
    panel.add_patch(Rectangle((column - 0.48, row - 0.44), 0.96, 0.88, facecolor=colour, alpha=0.65, linewidth=0.0))
    if case["detectable"]:
        panel.add_patch(
            Rectangle((column - 0.48, row - 0.44), 0.96, 0.88, fill=False, edgecolor=palette.INK, linewidth=1.1)
        )
    panel.text(column, row, words, ha="center", va="center", fontsize=7.0)


def _legend(figure: Any) -> None:
    from matplotlib.patches import Patch

    handles = [Patch(facecolor=colour, alpha=0.65, label=words) for colour, words in LEGEND]
    framed = Patch(facecolor="none", edgecolor=palette.INK, label="framed: as large as the diagnosis says it can show")
    figure.legend(handles=[*handles, framed], loc="outside lower center", ncols=4, frameon=False)


def measured(folder: Path, parts: Path, threads: int, limit: int | None) -> list[dict[str, Any]]:
    """Diagnose and score the cases.

    Args:
        folder: of the open drives.
        parts: of finished answers.
        threads: of the simulator.
        limit: on how many; None for all.
    """
    controls: dict[str, dict[str, Any]] = {}
    cases = []
    with tempfile.TemporaryDirectory() as place:
        for drive, change, path in altered_files(folder, Path(place), limit):
            answer = answer_of(path, parts, threads)
            control = controls.setdefault(drive, answer)
            cases.append(scored(drive, change, answer, control))
            said = answer["verdict"] or answer["failure"]
            print(f"{len(cases)} {drive}, {change.words}: {said} ({answer['seconds']:.0f} s)", flush=True)
    return cases


def summary(result: Mapping[str, Any]) -> Iterator[str]:
    """Lines of the figures."""
    for name, entry in result.items():
        if isinstance(entry, dict) and entry.get("value") is not None:
            low, high = entry["interval"]
            yield f"{name:28s} {entry['value']:8.3f}  [{low:.3f}, {high:.3f}]  {entry['count']:4d}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Diagnose the altered drives, write the result and its picture; 2 without the drives, 130 when interrupted."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, default=RESULT, help="JSON; the picture has the same name")
    parser.add_argument(
        "--parts", type=Path, default=None, help="folder of finished cases; beside the output if absent"
    )
    parser.add_argument(
        "--limit", type=int, default=None, help="the first cases only, the three controls before others"
    )
    parser.add_argument("--threads", type=int, default=1, help="of the simulator")
    given = parser.parse_args(arguments)
    if given.threads < 1 or (given.limit is not None and given.limit < 1):
        parser.error("--threads and --limit must be at least 1")
    folder = Path(os.environ.get("DDAGR_RECORDINGS") or shared() / "recordings") / "open"
    if not all((folder / f"{drive}.csv.gz").is_file() for drive in DRIVES):
        print(f"no open drives in {folder}: set DDAGR_SHARED or DDAGR_RECORDINGS", file=sys.stderr)
        return 2
    parts = given.parts or given.output.with_suffix(".parts")
    parts.mkdir(parents=True, exist_ok=True)
    try:
        cases = measured(folder, parts, given.threads, given.limit)
    except (InterruptedRunError, KeyboardInterrupt):
        print(f"interrupted; the same command goes on from {parts}", file=sys.stderr)
        return 130
    bank = hashlib.sha256(REAL_BANK.read_bytes()).hexdigest()
    result = {**figures(cases), "steps": STEPS, "bank_sha256": bank, "cases": cases}
    write_atomically(given.output, lambda to: to.write_text(json.dumps(result, indent=1, allow_nan=False) + "\n"))
    draw(cases, given.output.with_suffix(".png"))
    print("\n".join(summary(result)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
