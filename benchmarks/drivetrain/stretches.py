"""From a recording to what the model needs: commands as events, encoder readings with their own times.

A stretch is driven without a break that the model would have to guess. In the steps layout consecutive steps are one
stretch where both encoders go on from where they were: what the integral part holds at a step's start is then known.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.continued import first_and_last, goes_on
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

BANKS = ("right", "left")
GOES_ON = 1.5
"""Change of both encoders over a break below which the drive went on [rad/s]: readings of a steady speed scatter by
half of it on sand, where a stop in between changes most of them by several."""
AT_ONCE = 3
"""Rows within which the first change of command comes if the command before it belongs to the same drive."""
SHORTEST = 1.0
"""[s]; a shorter piece holds no answer to a command."""


@dataclass(frozen=True)
class Stretch:
    """A piece of a drive.

    Attributes:
        times: of the commands (m,), from 0 [s].
        events: commands (m, 2) right, left [rad/s].
        known: whether the first command was in force before the stretch; else the speeds at its start were.
        speeds: bank speeds (2,) at the start [rad/s].
        duration: [s].
        time: of the readings (n,) [s].
        bank: of the readings (n,), 0 right, 1 left.
        value: readings (n,) [rad/s].
        step: number (n,) of the command that is in force, counted over the drive.
        since: time (n,) since that command [s].
        first: number of the first command.
    """

    times: Array
    events: Array
    known: bool
    speeds: Array
    duration: float
    time: Array
    bank: Rows
    value: Array
    step: Rows
    since: Array
    first: int = 0

    def command_before(self, number: int) -> Array:
        """Command (2,) before one of these, counted from 0; before an unknown one, the speeds at the start [rad/s]."""
        if number:
            return np.asarray(self.events[number - 1])
        return np.asarray(self.events[0] if self.known else self.speeds)


@dataclass(frozen=True)
class _Piece:
    """Rows of a recording that hang together: time from 0 (n,), commands (n, 2), encoders (n, 2) with NaN."""

    t: Array
    commands: Array
    encoders: Array

    def ends(self) -> tuple[Array, Array]:
        """First and last reading (2,) of both encoders; NaN where there is none."""
        return first_and_last(self.encoders)


def find_stretches(recording: Recording) -> list[Stretch]:
    """Stretches of a drive, in order.

    Raises:
        InputError: no commands or no encoders, or nothing long enough.
    """
    needed = [f"{kind}_{bank}" for kind in ("command", "encoder") for bank in BANKS]
    missing = [name for name in needed if not recording.has(name)]
    if missing:
        raise InputError(f"{recording.meta.source} has no {' and no '.join(missing)}: the drivetrain needs them.")
    found: list[Stretch] = []
    for piece in _joined(list(_pieces(recording)), recording.period):
        if np.isfinite(piece.ends()[0]).all():
            stretch = _stretch(piece)
            first = found[-1].first + len(found[-1].times) if found else 0
            found.append(replace(stretch, step=stretch.step + first, first=first))
    if not found:
        raise InputError(f"{recording.meta.source} has no {SHORTEST:g} s of commands and encoder readings in a row.")
    return found


def _pieces(recording: Recording) -> Iterator[_Piece]:
    commands = np.stack(recording.held_commands(), axis=1)
    encoders = np.stack([recording[f"encoder_{bank}"] for bank in BANKS], axis=1)
    usable = np.isfinite(commands).all(axis=1)
    for span in recording.spans():
        edges = np.flatnonzero(np.diff(np.concatenate([[False], usable[span], [False]]).astype(int)))
        for start, stop in edges.reshape(-1, 2) + span.start:
            t = recording.t[start:stop] - recording.t[start]
            if t[-1] >= SHORTEST:
                yield _Piece(t, commands[start:stop], encoders[start:stop])


def _goes_on(before: _Piece, after: _Piece) -> bool:
    return goes_on((before.commands, after.commands), (before.encoders, after.encoders), GOES_ON)


def _joined(pieces: list[_Piece], period: float) -> Iterator[_Piece]:
    """Pieces that go on from each other as one; a sample is missing at the join, as at those within steps."""
    whole: _Piece | None = None
    last = None
    for piece in pieces:
        if whole is not None and last is not None and _goes_on(last, piece):
            shifted = whole.t[-1] + 2.0 * period + piece.t
            whole = _Piece(
                np.concatenate([whole.t, shifted]),
                np.concatenate([whole.commands, piece.commands]),
                np.concatenate([whole.encoders, piece.encoders]),
            )
        else:
            if whole is not None:
                yield whole
            whole = piece
        last = piece
    if whole is not None:
        yield whole


def _stretch(piece: _Piece) -> Stretch:
    changed = np.flatnonzero((np.diff(piece.commands, axis=0) != 0.0).any(axis=1)) + 1
    rows = np.concatenate([[0], changed])
    read = [np.flatnonzero(np.isfinite(column)) for column in piece.encoders.T]
    at = np.concatenate(read)
    bank = np.repeat([0, 1], [len(r) for r in read])
    step = np.searchsorted(rows, at, side="right") - 1
    return Stretch(
        piece.t[rows], np.ascontiguousarray(piece.commands[rows]), bool(len(changed) and changed[0] < AT_ONCE),
        piece.ends()[0], float(piece.t[-1]), piece.t[at], bank, piece.encoders[at, bank], step,
        piece.t[at] - piece.t[rows[step]],
    )  # fmt: skip
