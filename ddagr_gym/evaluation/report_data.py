"""What the page of an evaluation shows, as plain data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.evaluation.metrics import TurnStatus

Array = NDArray[np.float64]
Row = Mapping[str, Any]

_COMPLETE = TurnStatus.COMPLETE.name

PREFERRED_SETS = ("S1", "V", "S0")
"""The first of these that was driven answers the page's question."""


@dataclass(frozen=True)
class Arm:
    """A controller, or all training seeds of one policy.

    Attributes:
        name: in rows and summary.
        title: what it is, in a phrase.
        deployable: whether it does without the true state.
        learned: whether it was trained.
        versions: what the files of its training seeds hash to; none where it was not trained.
    """

    name: str
    title: str
    deployable: bool = True
    learned: bool = False
    versions: tuple[str, ...] = ()

    @property
    def ablation(self) -> bool:
        """Whether it is a policy whose estimates are replaced by others than in training, to see what that changes."""
        return "@" in self.name.rsplit("/", 1)[-1]


@dataclass(frozen=True)
class SetNote:
    """A scenario set.

    Attributes:
        name: of the set.
        description: one line.
        scenarios: how many it holds.
        driven: how many of them were driven.
        sha256: of its content.
    """

    name: str
    description: str
    scenarios: int
    driven: int
    sha256: str


@dataclass(frozen=True, eq=False)
class ShownDrive:
    """A scenario that was driven again for a picture.

    Attributes:
        arm: whose drive it is.
        set_name: of the scenario.
        number: of the scenario.
        turn: the commanded manoeuvre.
        path: true positions (N, 2) [m].
        radius_error: e_R [-]; None where it is undefined.
        success: whether the wheels fit their furrow.
        estimate: estimated positions (N, 2) [m] at the same instants; None without the filter.
        estimate_error: distance between the two at the end over the path's length [-]; None likewise.
    """

    arm: str
    set_name: str
    number: int
    turn: RowTurn
    path: Array
    radius_error: float | None
    success: bool
    estimate: Array | None = None
    estimate_error: float | None = None


@dataclass(frozen=True)
class Film:
    """A video beside the page.

    Attributes:
        file: relative to the page.
        title: what it shows.
        command: that makes it again.
        poster: JPEG of one picture of it.
    """

    file: PurePosixPath
    title: str
    command: str
    poster: bytes = b""


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Everything that the page shows.

    Attributes:
        rows: one an episode, of :func:`ddagr_gym.evaluation.campaign.run_campaign`.
        summary: of :func:`ddagr_gym.evaluation.summary.summaries`.
        arms: in the order of the tables; every arm of ``summary``.
        sets: that were driven.
        headline: arm that the claims name.
        claims: :class:`ddagr_gym.evaluation.claims.CheckedClaim` as mappings; empty where none was decided.
        over_headline: probability of a smaller |e_R| than the headline's by learned arm, on the judged set; ablations
            of the headline are compared with its same training seeds.
        headline_alone: summary of the headline on the judged set by those seeds alone, by what to call it.
        drives: for pictures of paths.
        tracked: drives with the filter's estimate.
        films: videos.
        infeasible: soils of the scenarios that no upper bound makes, one mapping each.
        sources: name and value of what everything was made of.
        note: a sentence on what is left out, "" for nothing.
    """

    rows: Sequence[Row]
    summary: Mapping[str, Mapping[str, Mapping[str, Any]]]
    arms: Sequence[Arm]
    sets: Sequence[SetNote]
    headline: str = ""
    claims: Sequence[Mapping[str, Any]] = ()
    over_headline: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    headline_alone: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    drives: Sequence[ShownDrive] = ()
    tracked: Sequence[ShownDrive] = ()
    films: Sequence[Film] = ()
    infeasible: Sequence[Mapping[str, Any]] = ()
    sources: Sequence[tuple[str, str]] = ()
    note: str = ""

    @property
    def judged(self) -> str:
        """Set by which the first table answers."""
        return judged_set([item.name for item in self.sets])

    def metrics(self, arm: str, set_name: str) -> Mapping[str, Any]:
        """Summary of an arm on a set; empty where it was not driven or no scenario is feasible."""
        return self.summary.get(arm, {}).get(set_name, {})

    def rows_of(self, arm: str, set_name: str, feasible: bool = True) -> list[Row]:
        """Episodes of an arm on a set, without infeasible scenarios unless they are asked for."""
        mine = self._grouped.get((arm, set_name), [])
        return [row for row in mine if row["feasible"]] if feasible else list(mine)

    @cached_property
    def _grouped(self) -> dict[tuple[str, str], list[Row]]:
        """Episodes by arm and set: the figures ask for them often."""
        groups: dict[tuple[str, str], list[Row]] = {}
        for row in self.rows:
            groups.setdefault((arm_name(row), row["set"]), []).append(row)
        return groups


def judged_set(names: Sequence[str]) -> str:
    """In range where that was driven, else validation, nominal, or the first of ``names``."""
    return next((name for name in PREFERRED_SETS if name in names), names[0])


def arm_name(row: Row) -> str:
    """Arm of an episode: its controller where there is none."""
    return str(row.get("arm", row["controller"]))


def size_of(row: Row) -> float:
    """|e_R| of an episode, infinite where the radius is undefined or comes from a part of the turn only."""
    error = row["radius_error"]
    whole = row.get("status", _COMPLETE) == _COMPLETE
    return abs(float(error)) if whole and error is not None else float("inf")


def badness(row: Row) -> tuple[bool, float]:
    """Order of episodes from good to bad: failures last, then by |e_R|."""
    return (not row["success"], size_of(row))


def best_arm(evaluation: Evaluation) -> Arm | None:
    """Deployable arm with the smallest median |e_R| on the judged set, ablations apart; None if nothing is feasible."""
    ranked = [
        (value, place, arm)
        for place, arm in enumerate(evaluation.arms)
        if arm.deployable
        and not arm.ablation
        and (value := _median(evaluation.metrics(arm.name, evaluation.judged))) is not None
    ]
    return min(ranked)[2] if ranked else None


def _median(metrics: Mapping[str, Any]) -> float | None:
    found = metrics.get("radius_error_median")
    return None if found is None else found["value"]


def replay_name(row: Row) -> str:
    """What ``ddagr evaluate --replay`` takes for an episode."""
    return f"{row['controller']}:{row['set']}:{row['number']}"


def display_name(arm: str) -> str:
    """An arm's name short enough for an axis: of a path its last folder and name are left."""
    return "/".join(arm.split("/")[-2:])
