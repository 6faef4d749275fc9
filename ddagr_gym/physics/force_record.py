"""Wheel forces along a simulated motion, kept so that motions close to it need not evaluate them again.

A sensitivity is the difference between two simulations that hardly differ. The first one is *recorded*: after every
evaluation, forces, sinkages and their derivatives by motion and sinkage are kept, and every decision of the step
control. The second one *follows*: it makes the same decisions and extrapolates the forces from the recorded ones (its
error is of second order in the difference). In a stage of a step it does so with the derivatives by which that step is
implicit: with newer ones its difference to the first could grow without bound near rest. Where a wheel's motion differs
by more than a limit, where its soil or its geometry differs, and in backward Euler steps, forces are evaluated as ever.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel, stack_array
from ddagr_gym.physics.layout import LOAD, SINKAGE, SOIL, STEPPED, WHEEL

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

ENTRY = STEPPED - LOAD
"""Values of a row that an evaluation leaves: kinematics, forces, sinkages, and the wheels' derivatives."""

GROUND = 12 + 36
"""Values of a row that the forces depend on besides: the wheels' geometry and the soils."""

_OTHER_SINKAGE = 0.2
"""Most by which a sinkage on another soil is taken to differ before it is found (ours)."""

IDLE, RECORDS, FOLLOWS, FULL = 0, 1, 2, 3
"""Of a row: does neither; keeps forces and decisions; follows them; has no room left, from where nobody can follow."""

W_STEP, BACKWARD_EULER = 0, 1
"""How a part of a step was made."""


class ForceRecord(NamedTuple):
    """What is kept of N environments; of one of them the arrays have no N in front.

    Attributes:
        entries: (N, E, ENTRY) after each evaluation.
        decisions: (N, D) number of steps of each sample, and of each step the number of its parts and how they were
            made, in the order in which they are taken.
        grounds: (N, samples, GROUND).
        state: (N, 3) what the row does, how many entries and how many decisions have been kept or followed.
        limit: change of a wheel's velocity over its speed up to which forces are extrapolated.
    """

    entries: Array
    decisions: Integers
    grounds: Array
    state: Integers
    limit: float


_MEMORY = 2**30
"""Most room for entries [bytes]; of more environments the last ones do not record (ours)."""

_ROOM = 8
"""Entries for which there is room, per step of the integrator (ours): two are made where steps are not divided."""


def no_record(count: int) -> ForceRecord:
    """For environments that neither record nor follow."""
    return ForceRecord(
        np.zeros((1, 0, 0)), np.zeros((1, 0), dtype=np.int64), np.zeros((1, 0, 0)),
        np.zeros((count, 3), dtype=np.int64), 0.0,
    )  # fmt: skip


def new_record(count: int, samples: int, steps: int, limit: float) -> ForceRecord:
    """Room for the forces of N environments, which they keep as they are advanced.

    Args:
        count: N.
        samples: by which they are advanced.
        steps: of the integrator in a sample, unless it divides them.
        limit: see :class:`ForceRecord`.
    """
    entries = _ROOM * samples * steps
    recorded = min(count, max(_MEMORY // (8 * ENTRY * entries), 1))
    state = np.zeros((count, 3), dtype=np.int64)
    state[:recorded, 0] = RECORDS
    return ForceRecord(
        np.empty((recorded, entries, ENTRY)), np.empty((recorded, 2 * entries + samples), dtype=np.int64),
        np.empty((recorded, samples, GROUND)), state, limit,
    )  # fmt: skip


def to_follow(record: ForceRecord) -> ForceRecord:
    """What was recorded, for environments that follow it from its begin; those without a whole record are idle."""
    state = np.zeros_like(record.state)
    state[:, 0] = np.where(record.state[:, 0] == RECORDS, FOLLOWS, IDLE)
    return record._replace(state=state)


@kernel(inline=True)
def record_of(record: ForceRecord, n: int) -> ForceRecord:
    """That of environment ``n`` out of a batch; of an idle one the arrays mean nothing."""
    k = 0 if record.state[n, 0] == IDLE else n
    return ForceRecord(record.entries[k], record.decisions[k], record.grounds[k], record.state[n], record.limit)


@kernel(inline=True)
def keep_entry(row: Array, record: ForceRecord) -> None:
    """Keep what an evaluation left."""
    k = record.state[1]
    if k >= record.entries.shape[0]:
        record.state[0] = FULL
        return
    for j in range(ENTRY):
        record.entries[k, j] = row[LOAD + j]
    record.state[1] = k + 1


@kernel(inline=True)
def take_entry(row: Array, record: ForceRecord) -> None:
    """Put the next recorded evaluation in a row, whose motion stays its own."""
    k = record.state[1]
    for j in range(ENTRY):
        row[LOAD + j] = record.entries[k, j]
    record.state[1] = k + 1


@kernel(inline=True)
def take_entry_on_other_ground(row: Array, record: ForceRecord) -> None:
    """The same for wheels on another soil: their sinkages stay as many times the recorded ones as they were."""
    own, before = stack_array(4), record.state[1] - 1
    for i in range(4):
        recorded = record.entries[before, SINKAGE - LOAD + i] if before >= 0 else 0.0
        ratio = row[SINKAGE + i] / recorded if recorded > 0.0 else 1.0
        own[i] = min(max(ratio, 1.0 - _OTHER_SINKAGE), 1.0 + _OTHER_SINKAGE)
    take_entry(row, record)
    for i in range(4):
        row[SINKAGE + i] *= own[i]


@kernel(inline=True)
def keep_decision(record: ForceRecord, place: int, decision: int) -> None:
    """Keep a decision at a place counted from the first that has not been kept."""
    k = record.state[2] + place
    if k < record.decisions.shape[0]:
        record.decisions[k] = decision
    else:
        record.state[0] = FULL


@kernel(inline=True)
def decision_at(record: ForceRecord, place: int) -> int:
    """Decision at a place counted from the first that has not been followed."""
    return record.decisions[record.state[2] + place]


@kernel(inline=True)
def keep_ground(row: Array, record: ForceRecord, sample: int) -> None:
    """Keep geometry and soils of the wheels in a sample."""
    for j in range(12):
        record.grounds[sample, j] = row[WHEEL + j]
    for j in range(36):
        record.grounds[sample, 12 + j] = row[SOIL + j]


@kernel(inline=True)
def is_same_ground(row: Array, record: ForceRecord, sample: int) -> bool:
    """Whether geometry and soils of the wheels are those of the recorded sample."""
    same = True
    for j in range(12):
        same &= record.grounds[sample, j] == row[WHEEL + j]
    for j in range(36):
        same &= record.grounds[sample, 12 + j] == row[SOIL + j]
    return same
