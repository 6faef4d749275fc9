"""Drives of worlds in which nothing is missing, with the commands, sampling and noise of real ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.null_bank.ordinary_drives import pieces_of
from ddagr_gym.diagnosis.null_bank.readings import PARTS
from ddagr_gym.diagnosis.null_bank.structural_variants import NullWorld, draw_world
from ddagr_gym.diagnosis.preprocessing.input_requirements import LEAST_MOVING, moving_share
from ddagr_gym.identification.noise import ChannelNoise, noise_from_differences
from ddagr_gym.identification.timing_repair import POSE_CHANNELS
from ddagr_gym.identification.window_model import ideal_sensors
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate

Array = NDArray[np.float64]

_MARGIN = 3.0
"""Ground beyond the straight-line reach of a drive [m] (ours: more than a robot's length)."""

DRIVES = 3
"""Drives of one null run (ours: what one is asked to record for a diagnosis)."""

_FARTHEST = 40.0
"""Farthest place from its start for which ground is drawn [m] (ours: keeps the field of soil small)."""


@dataclass(frozen=True, eq=False)
class Template:
    """What null drives copy of real ones.

    Attributes:
        commands: of each recording, (n, 2) [rad/s].
        period: between samples [s].
        present: of each recording, (n, 8) where a channel has a sample.
        noise: of the channels.
        starts: of each recording, world x, y, yaw.
    """

    commands: tuple[Array, ...]
    period: float
    present: tuple[NDArray[np.bool_], ...]
    noise: tuple[ChannelNoise | None, ...]
    starts: tuple[tuple[float, float, float], ...]


def drawn_pieces(
    recordings: Sequence[Recording], length: float, count: int, seed: int
) -> tuple[tuple[Recording, ...], ...]:
    """Pieces of recordings that each of some null runs copies: three, or all where there are fewer.

    A null run then takes the same time however long the recordings are. Pieces in which the robot is hardly commanded
    to move are left out where there are others.

    Args:
        recordings: of one robot.
        length: of a piece, in time with commands [s]; a recording that is not half as long is one piece.
        count: null runs.
        seed: of the choice.
    """
    pieces = [piece for recording in recordings for piece in (pieces_of(recording, length) or [recording])]
    pieces = [piece for piece in pieces if moving_share(piece) >= LEAST_MOVING] or pieces
    size = min(DRIVES, len(pieces))
    sources = (np.random.default_rng([seed, run, size]) for run in range(count))
    choices = (np.sort(source.choice(len(pieces), size, replace=False)).tolist() for source in sources)
    return tuple(tuple(pieces[k] for k in chosen) for chosen in choices)


def drawn_templates(
    recordings: Sequence[Recording], wheel_radius: float, length: float, count: int, seed: int
) -> tuple[Template, ...]:
    """Templates of null runs that copy pieces of recordings; the noise is that of all of them.

    Args:
        recordings: of one robot and one set of sensors.
        wheel_radius: hub to tread [m].
        length: as of :func:`drawn_pieces`, like the others.
        count: likewise.
        seed: likewise.
    """
    noise = noise_from_differences(recordings, wheel_radius)
    return tuple(template_of(pieces, noise) for pieces in drawn_pieces(recordings, length, count, seed))


def template_of(recordings: Sequence[Recording], noise: Sequence[ChannelNoise | None]) -> Template:
    """Commands, sampling and noise of recordings; commands before the first known one are zero.

    Drives start about the world's origin: there the ground is drawn, and a map's own origin may be far away.
    """
    commands = tuple(np.nan_to_num(np.stack(r.held_commands(), axis=1)) for r in recordings)
    present = tuple(np.stack([np.isfinite(r[name]) for name in CHANNELS], axis=1) for r in recordings)
    return Template(commands, recordings[0].period, present, tuple(noise), _starts(recordings))


def _starts(recordings: Sequence[Recording]) -> tuple[tuple[float, float, float], ...]:
    """First x, y, yaw of each recording, places from their mean; zero where a recording has none."""
    found = np.array([[_first(recording[name]) for name in POSE_CHANNELS] for recording in recordings])
    places = np.ma.masked_invalid(found[:, :2])
    found[:, :2] = places - places.mean(axis=0)
    return tuple((x, y, yaw) for x, y, yaw in np.nan_to_num(found).tolist())


def _first(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(known[0]) if known.size else np.nan


def null_recordings(
    robot: Robot, soil: Soil, template: Template, kind: str, rng: np.random.Generator
) -> tuple[Recording, ...]:
    """Drives of the template's commands in one world of a kind, with noise.

    Args:
        robot: nominal.
        soil: nominal.
        template: what to drive and to read.
        kind: of KINDS.
        rng: source of randomness.
    """
    fastest = max(float(np.abs(c).mean(axis=1).sum()) * template.period for c in template.commands)
    places = max(max(abs(s[0]), abs(s[1])) for s in template.starts)
    reach = min(fastest * robot.wheels[0].outer_radius, _FARTHEST) + places + _MARGIN
    world = draw_world(kind, soil, reach, rng)
    return tuple(_drive(robot, soil, template, world, number, rng) for number in range(len(template.commands)))


def _drive(
    robot: Robot, soil: Soil, template: Template, world: NullWorld, number: int, rng: np.random.Generator
) -> Recording:
    commands = template.commands[number]
    x, y, yaw = template.starts[number]
    tilting = replace(robot, sinkage_tilt=world.tilt)
    parts = simulate(
        tilting, soil, world.reading.commands(commands), sensors=ideal_sensors(template.period / PARTS),
        effects=world.changes, field=world.field, numerics=world.numerics,
        initial_state={"x": x, "y": y, "yaw": yaw},
    )  # fmt: skip
    clean = {name: world.reading.read(name, parts[name]) for name in CHANNELS}
    speed = robot.wheels[0].outer_radius * 0.5 * (np.abs(clean["encoder_right"]) + np.abs(clean["encoder_left"]))
    read = {
        "t": template.period * np.arange(1, len(commands) + 1),
        "command_right": commands[:, 0],
        "command_left": commands[:, 1],
    }
    for k, name in enumerate(CHANNELS):
        found = template.noise[k]
        noisy = clean[name] if found is None else world.reading.noisy(name, clean[name], found, speed, rng)
        read[name] = np.where(template.present[number][:, k], noisy, np.nan)
    return Recording.from_columns(read, robot)
