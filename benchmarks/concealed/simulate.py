"""Make the recordings and the label of one case."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .cases import Case, field_noise, field_plant
from .catalogue import least_size
from .change import Change, Site
from .drive import SUBSTEPS, drive
from .manoeuvres import PAUSE_BETWEEN_RUNS, RUNS, programme
from .plant import Plant
from .sensors import POSITION_NOISE, YAW_NOISE, readings, with_noise
from .streams import stream

NOISE_SCALE = {
    "enc_right": 0.01,
    "enc_left": 0.01,
    "imu_ax": 0.06,
    "imu_ay": 0.06,
    "imu_gz": 0.003,
    "x": POSITION_NOISE,
    "y": POSITION_NOISE,
    "yaw": YAW_NOISE,
}
"""Typical noise of one sample, for the differences in a label."""

Log = dict[str, np.ndarray]


def _start(case: Case, run: str, seed: int) -> np.ndarray:
    rng = stream(seed, case.set_name, case.number, "start", run)
    return np.array([*rng.uniform(-1.0, 1.0, 2), rng.uniform(-np.pi, np.pi)])


def _truth(case: Case, plant: Plant, changes: tuple[Change, ...], run: str, seed: int) -> dict[str, np.ndarray]:
    """Drive one run with the effects that act on commands and plant."""
    commands = np.repeat(_commands(case, run), SUBSTEPS, axis=0)
    for k, change in enumerate(changes):
        if change.command:
            commands = change.command(commands, stream(seed, case.set_name, case.number, "command", run, k))
        if change.plant:
            plant = change.plant(plant)
    return drive(plant, commands, _start(case, run, seed), RUNS.index(run) * PAUSE_BETWEEN_RUNS)


def _commands(case: Case, run: str) -> np.ndarray:
    return programme(run, case.manoeuvres + (0 if case.set_name == "development" else 1000))


def logged_commands(case: Case, commands: np.ndarray) -> np.ndarray:
    """Commands (samples, 2) as the case's logger writes them into the rows."""
    return np.concatenate([np.zeros((1, 2)), commands[:-1]]) if case.command_row == "acting" else commands


def _log(
    case: Case, plant: Plant, changes: tuple[Change, ...], truth: Mapping[str, np.ndarray], run: str, seed: int
) -> Log:
    """What the robot logged of one run."""
    for change in changes:
        plant = change.plant(plant) if change.plant else plant
    effect_rng = stream(seed, case.set_name, case.number, "sensor effect", run)
    noise_rng = stream(seed, case.set_name, case.number, "noise", run)
    clean = readings(truth, plant, logged_commands(case, _commands(case, run)), changes, effect_rng)
    return with_noise(clean, truth, field_noise(case, seed), changes, case.receiver, noise_rng)


def plain_log(
    case: Case, plant: Plant, commands: np.ndarray, start: np.ndarray, run: str, seed: int, clock: float = 0.0
) -> Log:
    """What a robot with a receiver logs of one drive without effects.

    Args:
        case: that noise and logging are of.
        plant: that drives.
        commands: (samples, 2) right, left [rad/s].
        start: x, y [m], yaw [rad].
        run: name of the drive, by which its noise is drawn.
        seed: of the set.
        clock: time since the case's first drive began [s].
    """
    truth = drive(plant, np.repeat(commands, SUBSTEPS, axis=0), start, clock)
    unused = stream(seed, case.set_name, case.number, "unused", run)
    clean = readings(truth, plant, logged_commands(case, commands), (), unused)
    noise = stream(seed, case.set_name, case.number, "noise", run)
    return with_noise(clean, truth, field_noise(case, seed), (), True, noise)


def _differences(with_effects: list[Log], without: list[Log]) -> dict[str, float]:
    """RMS difference per channel to the twin without effects, in units of one sample's noise; largest of the runs."""
    sizes = {}
    for name, scale in NOISE_SCALE.items():
        values = []
        for one, other in zip(with_effects, without, strict=True):
            gap = one[name] - other[name]
            gap = np.arctan2(np.sin(gap), np.cos(gap)) if name == "yaw" else gap
            values.append(np.sqrt(np.mean(gap[np.isfinite(gap)] ** 2)) if np.isfinite(gap).any() else 0.0)
        sizes[name] = round(float(max(values)) / scale, 3)
    return sizes


def effect_labels(case: Case, changes: tuple[Change, ...]) -> list[dict[str, Any]]:
    """What a label says of each effect of a case.

    Args:
        case: with the effects.
        changes: what each does.

    Returns:
        Name, other names that are as right (where there are any), variant, tag, equation, size and parameters of each.
    """
    labels = []
    for (form, multiple), change in zip(case.effects, changes, strict=True):
        label = {"name": form.name, "variant": form.variant, "tag": form.tag, "equation": form.equation}
        size = {"multiple": multiple, "size": multiple * least_size(form)} if form.high > 0 else {}
        also = {"also": list(form.also)} if form.also else {}
        labels.append({**label, **also, **size, "parameters": _plain(change.parameters)})
    return labels


def _plain(value: Any) -> Any:
    """Numbers and containers that JSON can write."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return value.item()
    return value


def simulate_case(case: Case, seed: int) -> tuple[dict[str, Log], dict[str, Any]]:
    """Drive all runs of a case.

    Args:
        case: from :func:`benchmarks.concealed.cases.plan`.
        seed: of the set.

    Returns:
        ({run: {column: (3000,) array}}, label).
    """
    field = field_plant(case, seed)
    bare = [_truth(case, field, (), run, seed) for run in RUNS]
    logs = bare_logs = [_log(case, field, (), truth, run, seed) for truth, run in zip(bare, RUNS, strict=True)]
    changes: tuple[Change, ...] = ()
    if case.effects:
        site, rng = Site(tuple(bare)), stream(seed, case.set_name, case.number, "effect")
        changes = tuple(form.build(multiple * least_size(form), rng, site) for form, multiple in case.effects)
        truths = [_truth(case, field, changes, run, seed) for run in RUNS]
        logs = [_log(case, field, changes, truth, run, seed) for truth, run in zip(truths, RUNS, strict=True)]
    label = {
        "case": case.name,
        "kind": case.kind,
        "verdict": case.verdict,
        "effects": effect_labels(case, changes),
        "structure": case.structure,
        "receiver": case.receiver,
        "manoeuvres": case.manoeuvres,
        "command_row": case.command_row,
        "difference": _differences(logs, bare_logs) if case.effects else {},
    }
    return dict(zip(RUNS, logs, strict=True)), label
