"""Drives of a pair, by the concealed benchmark's simulator.

The three drives before are on one patch of the case's field, the one after on another patch of it; between them motors
and sensors change by what a day makes of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.changed_pairs.plan import SET, Pair
from benchmarks.concealed.cases import Case, field_noise, field_plant
from benchmarks.concealed.catalogue import least_size
from benchmarks.concealed.change import Change, Site, with_motors
from benchmarks.concealed.drive import SAMPLE_PERIOD, SETTLING, SUBSTEPS, drive
from benchmarks.concealed.manoeuvres import PAUSE_BETWEEN_RUNS, RUNS, programme
from benchmarks.concealed.plant import Plant
from benchmarks.concealed.sensors import COLUMNS, SensorNoise, readings, with_noise
from benchmarks.concealed.simulate import effect_labels
from benchmarks.concealed.streams import stream
from benchmarks.mid_drive_drives import NAMES, driven, without_externals
from ddagr_gym.parameters import Robot
from ddagr_gym.recordings.schema import Recording

Array = np.ndarray
Log = dict[str, Array]

AFTER = "run_3"
"""The programme of the drive after: anything."""

AFTER_MANOEUVRES = 500
"""Added to the number of the manoeuvre set: the drive after is another one."""

AWAY = 15.0
"""How far the patch of the drive after is from that of those before [m]."""

DAY_MOTORS = 0.02
"""Deviation of the logarithm of the motors' rate from one day to another."""

COMMANDS = 1000
"""Added to the number of a manoeuvre set, as in sealed sets of single drives."""


def _start(pair: Pair, seed: int, run: str, away: float) -> Array:
    rng = stream(seed, SET, pair.case.number, "start", run)
    place = rng.uniform(-1.0, 1.0, 2) + away * np.array([np.cos(1.0), np.sin(1.0)])
    return np.array([*place, rng.uniform(-np.pi, np.pi)])


def _logged_commands(case: Case, commands: Array) -> Array:
    return np.concatenate([np.zeros((1, 2)), commands[:-1]]) if case.command_row == "acting" else commands


def _before(pair: Pair, seed: int, run: str) -> Log:
    """What was logged of a drive before."""
    case, number = pair.case, pair.case.number
    plant, noise = field_plant(case, seed), field_noise(case, seed)
    commands = programme(run, case.manoeuvres + COMMANDS)
    clock = RUNS.index(run) * PAUSE_BETWEEN_RUNS
    truth = drive(plant, np.repeat(commands, SUBSTEPS, axis=0), _start(pair, seed, run, 0.0), clock)
    clean = readings(truth, plant, _logged_commands(case, commands), (), stream(seed, SET, number, "unused", run))
    return with_noise(clean, truth, noise, (), True, stream(seed, SET, number, "noise", run))


def _day(pair: Pair, seed: int) -> tuple[Plant, SensorNoise]:
    """Robot and sensors as they are on the day of the drive after, before anything changed."""
    rng = stream(seed, SET, pair.case.number, "day")
    bare, noise = field_plant(pair.case, seed), field_noise(pair.case, seed)
    faster = float(np.exp(DAY_MOTORS * rng.standard_normal()))
    plant = with_motors(bare, rate_up=bare.motors.rate_up * faster, rate_down=bare.motors.rate_down * faster)
    offsets = tuple(0.006 * rng.standard_normal(2))
    return plant, replace(noise, accelerometer_offset=offsets, gyro_offset=1.5e-4 * float(rng.standard_normal()))


def _after(pair: Pair, seed: int) -> tuple[Log, tuple[Change, ...]]:
    """What was logged of the drive after, and what had changed."""
    case, number = pair.case, pair.case.number
    bare, noise = _day(pair, seed)
    wanted = programme(AFTER, case.manoeuvres + COMMANDS + AFTER_MANOEUVRES)
    commands, start = np.repeat(wanted, SUBSTEPS, axis=0), _start(pair, seed, "after", AWAY)
    site = Site((drive(bare, commands, start),))
    rng = stream(seed, SET, number, "effect")
    changes = tuple(form.build(multiple * least_size(form), rng, site) for form, multiple in case.effects)
    full, changed = bare, commands
    for k, change in enumerate(changes):
        full = change.plant(full) if change.plant else full
        changed = change.command(changed, stream(seed, SET, number, "command", k)) if change.command else changed
    switch = -SETTLING if pair.begins is None else round(pair.begins / SAMPLE_PERIOD)
    first = without_externals(full, bare)
    received = np.where(np.arange(len(commands))[:, None] < switch * SUBSTEPS, commands, changed)
    truth = driven(first, full, switch, received, start)
    logs = []
    for plant, present in ((first, ()), (full, changes)):
        clean = readings(
            truth, plant, _logged_commands(case, wanted), present, stream(seed, SET, number, "sensor effect")
        )
        logs.append(with_noise(clean, truth, noise, present, True, stream(seed, SET, number, "noise", "after")))
    late = np.arange(len(wanted)) >= switch
    return {name: np.where(late, logs[1][name], logs[0][name]) for name in COLUMNS}, changes


def simulate(pair: Pair, seed: int) -> tuple[list[Log], Log, dict[str, Any]]:
    """Logs of the drives before and of the one after, and the label.

    Args:
        pair: of :func:`benchmarks.changed_pairs.plan.plan`.
        seed: of the set.
    """
    before = [_before(pair, seed, run) for run in RUNS]
    after, changes = _after(pair, seed)
    label = {
        "kind": pair.kind,
        "verdict": pair.case.verdict,
        "effects": effect_labels(pair.case, changes),
        "structure": pair.case.structure,
        "manoeuvres": pair.case.manoeuvres,
        "command_row": pair.case.command_row,
        "begins": pair.begins,
    }
    return before, after, label


def recordings_of(logs: Sequence[Log], names: Sequence[str], robot: Robot) -> list[Recording]:
    """Logs as recordings.

    Args:
        logs: of one robot.
        names: of the recordings.
        robot: that drove.
    """
    columns = [{"t": log["t"]} | {ours: log[theirs] for ours, theirs in NAMES.items()} for log in logs]
    return [Recording.from_columns(c, robot, source=name) for c, name in zip(columns, names, strict=True)]
