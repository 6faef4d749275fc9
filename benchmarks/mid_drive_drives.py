"""Drives in which an effect begins or ends: the concealed benchmark's simulator, switched from one plant to another.

As :mod:`benchmarks.concealed.simulate`, whose forms of effects, fields and noises these are. Before the switch the
effect is absent (or present, where it ends); effects on readings and commands are spliced at that sample.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

from benchmarks.concealed.cases import Case, field_noise, field_plant
from benchmarks.concealed.catalogue import LIBRARY_FORMS, least_size
from benchmarks.concealed.change import Change, Form, Site
from benchmarks.concealed.drive import (
    SAMPLE_PERIOD,
    SETTLING,
    SUBSTEPS,
    TRUTH,
    _new_state,
    _new_work,
    _record,
    drive,
    read_ground,
    substep,
)
from benchmarks.concealed.manoeuvres import programme
from benchmarks.concealed.plant import Plant, settled
from benchmarks.concealed.sensors import COLUMNS, readings, with_noise
from benchmarks.concealed.streams import stream
from ddagr_gym.parameters import Robot
from ddagr_gym.recordings.schema import Recording

Array = np.ndarray

_NAMES = {
    "command_right": "cmd_right", "command_left": "cmd_left", "encoder_right": "enc_right", "encoder_left": "enc_left",
    "specific_force_x": "imu_ax", "specific_force_y": "imu_ay", "yaw_rate": "imu_gz", "pose_x": "x", "pose_y": "y",
    "pose_yaw": "yaw",
}  # fmt: skip
"""Columns of a recording, and of the simulator."""

RUN = "run_3"
"""The programme of spins, weaves, ramps and reversing: what a drive in use is most like."""

ALWAYS, BEGINS, ENDS = "constant", "begins", "ends"


@dataclass(frozen=True)
class Switched:
    """One drive of 60 s with one effect.

    Attributes:
        seed: of field, noise and form.
        effect: name of the verdict.
        variant: form of the effect.
        multiple: size in the least that is meaningful.
        kind: "constant", "begins" or "ends".
        time: at which it begins or ends [s].
        structure: of :data:`benchmarks.concealed.cases.STRUCTURES`.
    """

    seed: int
    effect: str
    variant: str
    multiple: float
    kind: str
    time: float
    structure: str = ""

    @property
    def name(self) -> str:
        """Of the drive."""
        when = "all along" if self.kind == ALWAYS else f"{self.kind} at {self.time:.1f} s"
        return f"{self.effect} {when}, drive {self.seed}"

    @property
    def form(self) -> Form:
        """Of the effect."""
        return next(item for item in LIBRARY_FORMS[self.effect] if item.variant == self.variant)

    def start(self) -> tuple[Array, np.random.Generator]:
        """Pose at the start [m, m, rad], and the random numbers that follow it."""
        rng = stream(self.seed, "mid drive")
        return np.array([*rng.uniform(-1.0, 1.0, 2), rng.uniform(-np.pi, np.pi)]), rng

    def change(self) -> Change:
        """The effect, for a form that looks at no path."""
        return self.form.build(self.multiple * least_size(self.form), self.start()[1], Site(()))


@njit(error_model="numpy", nogil=True)
def _integrate(first: Any, then: Any, switch: int, commands: Array, start: Array, truth: Array) -> Array:
    """As :func:`benchmarks.concealed.drive.drive`, but for the plant from sample ``switch`` on."""
    state, work = _new_state(first, start), _new_work()
    dt = SAMPLE_PERIOD / SUBSTEPS
    rest = np.zeros(2)
    for k in range(-SETTLING, truth.shape[0]):
        plant = first if k < switch else then
        if k >= 0:
            state.mean[:] = state.mean / SUBSTEPS
            _record(plant.body, state, truth[k])
        state.mean[:] = 0.0
        read_ground(plant, state, work.arm, k * SAMPLE_PERIOD)
        for i in range(SUBSTEPS):
            step = k * SUBSTEPS + i
            command = commands[step] if k >= 0 else rest
            substep(plant, state, work, command, step * dt, dt)
    return truth


def driven(first: Plant, then: Plant, switch: int, commands: Array, start: Array) -> dict[str, Array]:
    """As :func:`benchmarks.concealed.drive.drive`, with another plant from a sample on.

    Args:
        first: plant before the switch.
        then: plant from it on, whose state has the same shape.
        switch: sample.
        commands: (samples * substeps, 2) as the motors receive them [rad/s].
        start: pose of the body origin [m, m, rad].
    """
    truth = np.zeros((len(commands) // SUBSTEPS, len(TRUTH)))
    _integrate(settled(first), settled(then), switch, np.ascontiguousarray(commands), start.copy(), truth)
    return {name: truth[:, k] for k, name in enumerate(TRUTH)}


def with_state_of(plant: Plant, bare: Plant) -> Plant:
    """The bare plant with a state of the shape that another one needs: its external forces at no strength, and a map of
    ruts that stiffen nothing."""
    quiet = plant.externals.copy()
    quiet[:, 1:4] = 0.0
    marked = plant.ground.rut_mode == 2 and bare.ground.rut_mode == 0
    ground = bare.ground._replace(rut_mode=2, rut_gain=0.0) if marked else bare.ground
    return bare._replace(ground=ground, externals=np.concatenate([bare.externals, quiet[len(bare.externals) :]]))


def simulate(item: Switched) -> dict[str, Array]:
    """Columns of :data:`benchmarks.concealed.sensors.COLUMNS` of a drive."""
    case = Case("development", item.seed, "single", ((item.form, item.multiple),), item.structure, item.seed % 8)
    bare = field_plant(case, item.seed)
    wanted = programme(RUN, case.manoeuvres)
    commands = np.repeat(wanted, SUBSTEPS, axis=0)
    start, rng = item.start()
    change = item.form.build(item.multiple * least_size(item.form), rng, Site((drive(bare, commands, start),)))
    full = change.plant(bare) if change.plant else bare
    quiet = with_state_of(full, bare)
    switch = -SETTLING if item.kind == ALWAYS else round(item.time / SAMPLE_PERIOD)
    changed = change.command(commands, rng) if change.command else commands
    before, after = ((quiet, commands, ()), (full, changed, (change,)))
    if item.kind == ENDS:
        before, after = after, before
    received = np.where(np.arange(len(commands))[:, None] < switch * SUBSTEPS, before[1], after[1])
    truth = driven(before[0], after[0], switch, received, start)
    return _spliced(case, item, truth, wanted, (before[0], before[2]), (after[0], after[2]), switch)


def _spliced(
    case: Case,
    item: Switched,
    truth: dict[str, Array],
    commands: Array,
    before: tuple[Plant, tuple[Change, ...]],
    after: tuple[Plant, tuple[Change, ...]],
    switch: int,
) -> dict[str, Array]:
    """What the robot logged, with the sensors of one plant before a sample and of another from it on."""
    logs = []
    for plant, changes in (before, after):
        clean = readings(truth, plant, commands, changes, stream(item.seed, "mid drive", "sensor effect"))
        noise = stream(item.seed, "mid drive", "noise")
        logs.append(with_noise(clean, truth, field_noise(case, item.seed), changes, True, noise))
    late = np.arange(len(commands)) >= switch
    return {name: np.where(late, logs[1][name], logs[0][name]) for name in COLUMNS}


def recording_of(item: Switched, robot: Robot) -> Recording:
    """The drive as a recording."""
    return as_recording(simulate(item), robot, item.name)


def as_recording(log: dict[str, Array], robot: Robot, source: str) -> Recording:
    """A log of the simulator as a recording.

    Args:
        log: columns of :data:`benchmarks.concealed.sensors.COLUMNS`.
        robot: that drove.
        source: name of the recording.
    """
    columns = {"t": log["t"]} | {ours: log[theirs] for ours, theirs in _NAMES.items()}
    return Recording.from_columns(columns, robot, source=source)
