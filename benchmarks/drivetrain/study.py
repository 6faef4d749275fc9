"""The study: which parts the drives ask for, their values, forecasts of left-out drives, and what is left."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.drivetrain.fit import Drives, Fit, Problem, Values, fit_drives
from benchmarks.drivetrain.load_conditions import all_tried
from benchmarks.drivetrain.model import STEP, residuals, run
from benchmarks.drivetrain.parameters import ALL, ANTI_WINDUP, LOAD, OWN, ROBOT, USED, parameter_vector
from benchmarks.drivetrain.scores import compare, held_out, residual_tables, shares_of_square, size
from benchmarks.drivetrain.single_commands import summary
from benchmarks.drivetrain.stretches import Stretch, find_stretches
from benchmarks.drivetrain.timing import imu_timing
from ddagr_gym.recordings.load import load_recording
from ddagr_gym.recordings.schema import Recording

Progress = Callable[[str], None]

FILES = {
    "asphalt": "open/warthog_asphalt",
    "asphalt 2": "concealed/warthog_2",
    "gravel": "concealed/warthog_4",
    "sand": "open/warthog_sand",
    "sand 2": "concealed/warthog_5",
}
"""Ordinary drives of one robot in the steps layout; the gyro of the one on gravel is reversed."""
REVERSED_GYRO = ("gravel",)
GRASS = "open/warthog_grass"
"""A short drive at a sixth of the speed: forecast, not fitted."""
HUSKY = "concealed/husky_1"
"""Another robot: the model runs on it; nothing was chosen by it."""
TWINS = {"asphalt": "asphalt 2", "asphalt 2": "asphalt", "sand": "sand 2", "sand 2": "sand"}
"""Drives on the same ground."""

WINDUP = "within_limit"
WITHOUT: Mapping[str, tuple[str, ...]] = {
    "delay": ("delay",),
    "ramp of the mean": ("mean_ramp",),
    "ramp of the turning": ("turning_ramp",),
    "limit of the turning": ("turning_limit",),
    "top speed": ("top_speed",),
    "integral part": ("integral",),
    "power limit": ("power",),
    "left weaker than right": ("asymmetry",),
    "viscous friction": ("viscous",),
    "rolling load": ("rolling_load",),
    "turning load": ("turning_load", "turning_speed"),
}
"""Parts of the model and the parameters that go with them."""
WITH: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "later starts from rest": (("start_delay",), ()),
    "gain": (("gain",), ()),
    "lag": (("lag",), ()),
    "lag for both ramps": (("lag",), ("mean_ramp", "turning_ramp")),
    "ramp of each bank": (("ramp",), ()),
    "ramp of each bank for both ramps": (("ramp",), ("mean_ramp", "turning_ramp")),
    "dead band": (("dead_band",), ()),
    "other ramps when slowing": (("slowing_ramp",), ()),
    "limit of the integral part": (("integral_limit",), ()),
    "inertia in turning": (("yaw_inertia",), ()),
    "constant torque limit": (("torque_limit",), ()),
    "speed line for power limit": (("stall_torque", "no_load_speed"), ("power",)),
    "speed line for power limit and top speed": (("stall_torque", "no_load_speed"), ("power", "top_speed")),
    "power limit shared by the banks": (("coupling",), ()),
    "readings averaged": (("averaging",), ()),
    "wheels apart from the vehicle": (("traction", "slip_speed"), ()),
}
"""Parts that were tried: parameters that come and those that go."""
EXAMPLES = (("asphalt", 9), ("asphalt", 25), ("asphalt 2", 43), ("gravel", 11), ("sand", 9), ("sand", 109))
"""Drives and numbers of commands in the figure, odd ones: a turn that creeps to its speed, the left bank at its limit,
a turn from straight driving, a start to top speed, one bank reversed on sand, a turn reversed on sand."""


def read_drive(folder: Path, name: str, robot: str = "warthog") -> Recording:
    """One of the recordings.

    Raises:
        InputError: it is not there.
    """
    return load_recording(folder / f"{name}.csv.gz", None, robot)


def _folds(drives: Drives, shared: tuple[str, ...], own: tuple[str, ...], windup: str, start: Any) -> list[Fit]:
    problems = [Problem(drives, shared, own, windup=windup, parity=parity) for parity in (0, 1)]
    return [fit_drives(problem, start) for problem in problems]


def _changed(used: tuple[str, ...], come: tuple[str, ...], go: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(name for name in used if name not in go) + come


def parts_table(drives: Drives, base: list[Fit], progress: Progress) -> dict[str, Any]:
    """Held-out loss without each part, with each part that was tried, and with other forms of the anti-windup."""
    left = held_out(base)
    start = base[0].values
    table: dict[str, Any] = {"without": {}, "with": {}, "anti_windup": {}}

    def enter(kind: str, name: str, folds: list[Fit], parameters: tuple[str, ...]) -> None:
        first = next(iter(drives))
        values = {p: [fold.values[first][p] for fold in folds] for p in parameters if p in folds[0].values[first]}
        table[kind][name] = compare(drives, left, held_out(folds)) | {"values": values}
        progress(f"{kind} {name}: {table[kind][name]['loss_change']:+.1f}")

    for name, go in WITHOUT.items():
        shared, own = _changed(USED, (), go), _changed(OWN, (), go)
        enter("without", name, _folds(drives, shared, own, WINDUP, start), ())
    for name, (come, go) in WITH.items():
        shared = _changed(USED, tuple(c for c in come if c in ROBOT), go)
        own = _changed(OWN, tuple(c for c in come if c in LOAD), ())
        enter("with", name, _folds(drives, shared, own, WINDUP, start), come)
    for windup in ANTI_WINDUP:
        if windup != WINDUP:
            enter("anti_windup", windup, _folds(drives, USED, OWN, windup, start), ())
    return table


def values_by_drive(drives: Drives, fit: Fit) -> dict[str, Any]:
    """Each parameter of the robot fitted to one drive alone, with its load, all else as of the joint fit."""
    table: dict[str, Any] = {}
    for name in USED:
        rows = {}
        for drive, stretches in drives.items():
            fixed = {drive: {n: fit.values[drive][n] for n in USED if n != name}}
            single = fit_drives(
                Problem({drive: stretches}, (name,), fixed=fixed, windup=WINDUP, parity=None), fit.values
            )
            value, deviation = single.values[drive][name], next(iter(single.deviations.values()))
            rows[drive] = {"value": value, "deviation": deviation * (value if ALL[name].positive else 1.0)}
        values = np.array([row["value"] for row in rows.values()])
        within = float(np.mean([row["deviation"] ** 2 for row in rows.values()]))
        between = max(float(values.var(ddof=1)) - within, 0.0) ** 0.5
        table[name] = {"drives": rows, "mean": float(values.mean()), "between_drives": between, "unit": ALL[name].unit}
    return table


def left_out_drives(drives: Drives, start: Mapping[str, Values], progress: Progress) -> dict[str, Any]:
    """Forecast of each drive by the robot of the others, with the load of its twin and with its own even steps'."""
    table = {}
    for drive, stretches in drives.items():
        others = {name: found for name, found in drives.items() if name != drive}
        fit = fit_drives(Problem(others, windup=WINDUP, parity=None), start)
        first = next(iter(others))
        robot = {name: fit.values[first][name] for name in USED}
        row = {"own_load": own_load_forecast(drive, stretches, robot, start)}
        if drive in TWINS:
            row["load_of_other_drive"] = size(residuals(dict(fit.values[TWINS[drive]]), stretches, WINDUP))
        table[drive] = row
        progress(f"left out {drive}: {row}")
    return table


def own_load_forecast(
    drive: str, stretches: list[Stretch], robot: Values, start: Mapping[str, Values]
) -> dict[str, float]:
    """Residual on a drive's odd steps, with the robot given and the load fitted on its even steps."""
    problem = Problem({drive: stretches}, (), fixed={drive: robot}, windup=WINDUP)
    fit = fit_drives(problem, start)
    return size(fit.residuals[drive][~fit.fitted[drive]])


def _as_they_are(stretches: list[Stretch]) -> dict[str, float]:
    """Residual of the commands themselves."""
    return size(np.concatenate([s.value - s.events[s.step - s.first, s.bank] for s in stretches]))


def examples(drives: Drives, fit: Fit) -> list[dict[str, Any]]:
    """Commands, readings and model of the steps in the figure, none of which the fit has seen."""
    found = []
    for drive, wanted in EXAMPLES:
        for stretch in drives[drive]:
            event = wanted - stretch.first
            if not 0 <= event < len(stretch.times):
                continue
            start = stretch.times[event]
            motion = run(parameter_vector(fit.values[drive]), stretch, ANTI_WINDUP[WINDUP])
            t = STEP * np.arange(len(motion)) - start
            keep = (t > -0.5) & (t < 6.1)
            mine = (stretch.time - start > -0.5) & (stretch.time - start < 6.1)
            before = stretch.command_before(event)
            found.append({
                "drive": drive, "before": before.tolist(), "command": stretch.events[event].tolist(),
                "model_t": t[keep][::2].round(3).tolist(), "model": motion[keep][::2, :2].round(3).tolist(),
                "t": (stretch.time[mine] - start).round(3).tolist(), "bank": stretch.bank[mine].tolist(),
                "reading": stretch.value[mine].round(3).tolist(),
            })  # fmt: skip
    return found


def run_study(folder: Path, progress: Progress = lambda line: None) -> dict[str, Any]:
    """The whole study as a JSON document.

    Args:
        folder: recordings, with ``open/`` and ``concealed/``.
        progress: called with a line after every part.
    """
    recordings = {name: read_drive(folder, file) for name, file in FILES.items()}
    drives = {name: find_stretches(recording) for name, recording in recordings.items()}
    whole = fit_drives(Problem(drives, windup=WINDUP, parity=None), starts=2)
    progress(f"joint fit: cost {whole.cost:.1f}")
    folds = _folds(drives, USED, OWN, WINDUP, whole.values)
    left = held_out(folds)
    tables = {d: residual_tables(drives[d], left[d], whole.values[d], WINDUP) for d in drives}
    first = next(iter(drives))
    robot = {name: whole.values[first][name] for name in USED}
    grass = find_stretches(read_drive(folder, GRASS))
    return {
        "drives": {d: {"file": FILES[d], "commands": s[-1].first + len(s[-1].times), "stretches": len(s)}
                   for d, s in drives.items()},
        "robot": {
            entry.name: {"value": robot[entry.name], "unit": ALL[entry.name].unit,
                         "deviation": deviation * (robot[entry.name] if ALL[entry.name].positive else 1.0)}
            for entry, deviation in whole.deviations.items() if entry.drive is None
        },
        "loads": {d: {name: whole.values[d][name] for name in OWN} for d in drives},
        "by_drive": values_by_drive(drives, whole),
        "held_out": {d: size(left[d]) | {"command_as_it_is": _as_they_are(drives[d])} for d in drives},
        "residuals": tables,
        "share_of_square_between_0.2_and_1.5_s": {
            d: shares_of_square(table["since_change"], 0.2, 1.5) for d, table in tables.items()
        },
        "left_out": left_out_drives(drives, whole.values, progress),
        "grass": own_load_forecast("grass", grass, robot, {"grass": whole.values["gravel"]}),
        "husky": husky(folder),
        "timing": {d: imu_timing(r, -1.0 if d in REVERSED_GYRO else 1.0) for d, r in recordings.items()},
        "single_commands": {d: summary(drives[d], whole.values[d], WINDUP) for d in drives},
        "load_conditions": all_tried(drives, whole.values, WINDUP),
        "parts": parts_table(drives, folds, progress),
        "examples": examples(drives, folds[0]),
    }  # fmt: skip


def husky(folder: Path) -> dict[str, Any]:
    """The same model on another robot: fitted on even steps, scored on odd ones."""
    stretches = find_stretches(read_drive(folder, HUSKY, "husky"))
    fit = fit_drives(Problem({"husky": stretches}, windup=WINDUP))
    return size(fit.residuals["husky"][~fit.fitted["husky"]]) | {"values": dict(fit.values["husky"])}
