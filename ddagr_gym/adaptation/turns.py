"""Turns that a controller is tuned on and judged by, each driven once and remembered."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol

import msgspec
import numpy as np
from numpy.typing import NDArray

from ddagr_gym.adaptation.corrected import Corrected
from ddagr_gym.config import dump_config
from ddagr_gym.control.row_turn import SIDES, RowTurn
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.adapted_controller import NODES
from ddagr_gym.evaluation.bundles import Bundle
from ddagr_gym.evaluation.metrics import turn_metrics
from ddagr_gym.evaluation.runs import Controller, drive_turn
from ddagr_gym.files import make_folder, read_json_lines
from ddagr_gym.parameters import Robot

Array = NDArray[np.float64]
Columns = Mapping[str, Array]

_LEAST_TURNED = 0.05  # before and after it the curvature is that of the straights [rad] (ours)


@dataclass(frozen=True)
class DrivenTurn:
    """What one turn came to.

    Attributes:
        number: of the turn.
        side: "left" or "right".
        error: e_R [-]; None where there is no circle.
        success: whether every wheel fits its furrow at the next row.
        lateral: error at the next row's start line [m]; None where it was not reached.
        heading: the same [rad].
        curvature: driven over commanded at the places of a feed-forward [-]; None where the turn was not finished.
    """

    number: int
    side: str
    error: float | None
    success: bool
    lateral: float | None
    heading: float | None
    curvature: tuple[float, ...] | None


def sizes(driven: Sequence[DrivenTurn]) -> Array:
    """|e_R| of turns; 1 where there is no circle."""
    return np.array([1.0 if item.error is None else min(abs(item.error), 1.0) for item in driven])


class Turns(Protocol):
    """Where turns are driven."""

    robot: Robot

    def turn(self, number: int) -> RowTurn:
        """The commanded turn of a number; even numbers to the left."""

    def drive(self, controller: Controller, number: int) -> Columns:
        """Columns of a turn, as ``turn_metrics`` reads them; a number always means the same place and noise."""


class CorrectedTurns:
    """Turns in a corrected simulator; robot, soil and sizes of effects are drawn anew for each.

    Args:
        corrected: the simulator.
        radius: of the turns [m].
        speed: [m/s].
        seed: of all draws.
    """

    def __init__(self, corrected: Corrected, radius: float = 0.8, speed: float = 0.2, seed: int = 0) -> None:
        self.robot, self._corrected, self._seed = corrected.robot, corrected, seed
        self._radius, self._speed = radius, speed

    def turn(self, number: int) -> RowTurn:
        """The commanded turn of a number; even numbers to the left."""
        return RowTurn(radius=self._radius, side=("left", "right")[number % 2], run_in=0.5, speed=self._speed)

    def drive(self, controller: Controller, number: int) -> Columns:
        """Columns of a turn."""
        rng = np.random.default_rng([self._seed, number])
        settings = self._corrected.settings(rng, self._radius, self._speed, self.turn(number).side)
        return drive_turn(controller, settings, int(rng.integers(2**31)), settings.draw(rng)).columns


class MeasuredTurns:
    """Turns with a memory, kept in a file where one is given, so that a stopped adaptation goes on.

    Args:
        turns: where they are driven.
        journal: JSON lines; None for none.
        progress: called when a turn is driven or remembered.

    Raises:
        InputError: the journal holds something else.
    """

    def __init__(self, turns: Turns, journal: Path | None = None, progress: Callable[[], None] = lambda: None) -> None:
        self.turns, self._journal, self._progress = turns, journal, progress
        self._known = {} if journal is None else _read(journal)

    def measure(self, bundle: Bundle, number: int) -> DrivenTurn:
        """A turn by the controller of a bundle."""
        key = f"{_digest(bundle)} {number}"
        if key not in self._known:
            turn = self.turns.turn(number)
            columns = self.turns.drive(bundle.controller(turn), number)
            self._known[key] = judged(columns, turn, self.turns.robot, number)
            if self._journal is not None:
                _append(self._journal, json.dumps({"key": key, "turn": asdict(self._known[key])}))
        self._progress()
        return self._known[key]

    def measure_all(self, bundle: Bundle, numbers: Sequence[int]) -> list[DrivenTurn]:
        """Several turns."""
        return [self.measure(bundle, number) for number in numbers]


def _digest(bundle: Bundle) -> str:
    text = dump_config(bundle.settings) + dump_config(bundle.robot) + dump_config(bundle.soil) + repr(bundle.effects)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _read(journal: Path) -> dict[str, DrivenTurn]:
    """Turns of a journal by their keys; InputError where it holds anything else."""
    if not journal.exists():
        return {}
    fault, remedy = "is no journal of driven turns", "delete it, and they are driven again"
    try:
        return dict(_turn_of(item) for item in read_json_lines(journal, fault, remedy))
    except (KeyError, msgspec.ValidationError) as error:
        raise InputError(f"{journal} {fault} (an entry is absent or wrong: {error}): {remedy}.") from None


def _turn_of(item: Mapping[str, Any]) -> tuple[str, DrivenTurn]:
    """Key and turn of a line."""
    return msgspec.convert(item["key"], str), msgspec.convert(item["turn"], DrivenTurn)


def _append(journal: Path, line: str) -> None:
    """Add a line, after the rest of one that was cut off."""
    make_folder(journal.parent)
    with journal.open("ab+") as file:
        file.seek(max(file.tell() - 1, 0))
        whole = file.read(1) in (b"", b"\n")
        file.write(("" if whole else "\n").encode() + f"{line}\n".encode())


def judged(columns: Columns, turn: RowTurn, robot: Robot, number: int) -> DrivenTurn:
    """What a driven turn came to."""
    metrics = turn_metrics({name: columns[name] for name in columns}, turn, robot)
    leave = metrics.exit
    return DrivenTurn(
        number=number,
        side=turn.side,
        error=metrics.turn.error,
        success=leave is not None and leave.wheels_fit,
        lateral=None if leave is None else leave.lateral_error,
        heading=None if leave is None else leave.heading_error,
        curvature=None if leave is None else _curvatures(columns, turn),
    )


def _curvatures(columns: Columns, turn: RowTurn) -> tuple[float, ...] | None:
    """Driven over commanded curvature around the places of a feed-forward; None where the turn is too short."""
    sign = SIDES[turn.side]
    x, y, yaw = (np.asarray(columns[f"true_{name}"]) for name in ("x", "y", "yaw"))
    course = sign * (yaw + np.arctan2(columns["true_v_y"], np.maximum(columns["true_v_x"], 0.02)))
    way = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    turned = np.maximum.accumulate(sign * (yaw - yaw[0]))
    if turned[-1] < math.pi - 4.0 * _LEAST_TURNED:
        return None
    first = int(np.searchsorted(turned, _LEAST_TURNED))
    rising = turned + 1e-9 * np.arange(len(turned))
    middles = np.pi * (np.arange(NODES + 1) - 0.5) / (NODES - 1)
    edges = np.clip(middles, _LEAST_TURNED, min(math.pi - _LEAST_TURNED, float(turned[-1])))
    s, c = (np.interp(edges, rising[first:], values[first:]) for values in (way, course))
    return tuple(float(v) for v in turn.radius * np.diff(c) / np.maximum(np.diff(s), 1e-3))
