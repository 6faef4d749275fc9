"""Drives of a pair, by the concealed benchmark's simulator.

The three drives before are on one patch of the case's field, the one after on another patch of it; between them motors
and sensors change by what a day makes of them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.changed_pairs.plan import Pair
from benchmarks.changed_pairs.robots import simulated_robot
from benchmarks.concealed.cases import field_noise, field_plant
from benchmarks.concealed.catalogue import least_size
from benchmarks.concealed.change import Change, Site, with_motors
from benchmarks.concealed.drive import SAMPLE_PERIOD, SETTLING, SUBSTEPS, drive
from benchmarks.concealed.manoeuvres import PAUSE_BETWEEN_RUNS, RUNS, programme
from benchmarks.concealed.plant import Plant
from benchmarks.concealed.sensors import COLUMNS, SensorNoise, readings, with_noise
from benchmarks.concealed.simulate import effect_labels, logged_commands, plain_log
from benchmarks.concealed.streams import stream
from benchmarks.mid_drive_drives import driven, with_state_of

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
    rng = stream(seed, pair.case.set_name, pair.case.number, "start", run)
    place = rng.uniform(-1.0, 1.0, 2) + away * np.array([np.cos(1.0), np.sin(1.0)])
    return np.array([*place, rng.uniform(-np.pi, np.pi)])


def _plant(pair: Pair, seed: int) -> Plant:
    """The pair's robot on its field, as it was in the drives before."""
    return simulated_robot(pair.robot).put_into(field_plant(pair.case, seed))


def _before(pair: Pair, seed: int, run: str) -> Log:
    """What was logged of a drive before."""
    commands = programme(run, pair.case.manoeuvres + COMMANDS)
    clock = RUNS.index(run) * PAUSE_BETWEEN_RUNS
    return plain_log(pair.case, _plant(pair, seed), commands, _start(pair, seed, run, 0.0), run, seed, clock)


def _day(pair: Pair, seed: int) -> tuple[Plant, SensorNoise]:
    """Robot and sensors as they are on the day of the drive after, before anything changed."""
    rng = stream(seed, pair.case.set_name, pair.case.number, "day")
    bare, noise = _plant(pair, seed), field_noise(pair.case, seed)
    faster = float(np.exp(DAY_MOTORS * rng.standard_normal()))
    plant = with_motors(bare, rate_up=bare.motors.rate_up * faster, rate_down=bare.motors.rate_down * faster)
    offsets = tuple(0.006 * rng.standard_normal(2))
    return plant, replace(noise, accelerometer_offset=offsets, gyro_offset=1.5e-4 * float(rng.standard_normal()))


def _asked(pair: Pair, seed: int) -> tuple[Array, Array]:
    """Commands (samples, 2) of the drive after, and where it starts."""
    commands = programme(AFTER, pair.case.manoeuvres + COMMANDS + AFTER_MANOEUVRES)
    return commands, _start(pair, seed, "after", AWAY)


def _changes(pair: Pair, seed: int) -> tuple[Change, ...]:
    """What had changed; forms look at the path of the drive after without them."""
    if not pair.case.effects:
        return ()
    commands, start = _asked(pair, seed)
    site = Site((drive(_day(pair, seed)[0], np.repeat(commands, SUBSTEPS, axis=0), start),))
    rng = stream(seed, pair.case.set_name, pair.case.number, "effect")
    return tuple(form.build(multiple * least_size(form), rng, site) for form, multiple in pair.case.effects)


def _after(pair: Pair, seed: int) -> Log:
    """What was logged of the drive after."""
    case, name, number = pair.case, pair.case.set_name, pair.case.number
    (bare, noise), changes = _day(pair, seed), _changes(pair, seed)
    wanted, start = _asked(pair, seed)
    commands = np.repeat(wanted, SUBSTEPS, axis=0)
    full, changed = bare, commands
    for k, change in enumerate(changes):
        full = change.plant(full) if change.plant else full
        changed = change.command(changed, stream(seed, name, number, "command", k)) if change.command else changed
    switch = -SETTLING if pair.begins is None else round(pair.begins / SAMPLE_PERIOD)
    first = with_state_of(full, bare)
    received = np.where(np.arange(len(commands))[:, None] < switch * SUBSTEPS, commands, changed)
    truth = driven(first, full, switch, received, start)
    present: tuple[tuple[Plant, tuple[Change, ...]], ...] = ((first, ()), (full, changes))
    logs = []
    for plant, there in present:
        sensors = stream(seed, name, number, "sensor effect")
        clean = readings(truth, plant, logged_commands(case, wanted), there, sensors)
        logs.append(with_noise(clean, truth, noise, there, True, stream(seed, name, number, "noise", "after")))
    late = np.arange(len(wanted)) >= switch
    return {column: np.where(late, logs[1][column], logs[0][column]) for column in COLUMNS}


def label_of(pair: Pair, seed: int) -> dict[str, Any]:
    """The right answer, without the drives.

    Args:
        pair: of :func:`benchmarks.changed_pairs.plan.plan`.
        seed: of the set.
    """
    return {
        "kind": pair.kind,
        "verdict": pair.case.verdict,
        "effects": effect_labels(pair.case, _changes(pair, seed)),
        "structure": pair.case.structure,
        "manoeuvres": pair.case.manoeuvres,
        "command_row": pair.case.command_row,
        "begins": pair.begins,
    }


def simulate(pair: Pair, seed: int) -> tuple[list[Log], Log]:
    """Logs of the drives before and of the one after.

    Args:
        pair: of :func:`benchmarks.changed_pairs.plan.plan`.
        seed: of the set.
    """
    return [_before(pair, seed, run) for run in RUNS], _after(pair, seed)
