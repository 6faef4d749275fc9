"""Replay of recordings in both drive modes, and its report."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ddagr_gym.errors import InputError
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.replay_analysis.drive_mode import STEPS, DriveModeResult, ReplaySettings, replay_drive_mode
from ddagr_gym.replay_analysis.prepare import DRIVES, Prepared, prepare, simulated_effects
from ddagr_gym.replay_analysis.report import SCHEMA, SCHEMA_VERSION, ReplayReport, RunReport

SHORTEST_WINDOW = 0.2
"""[s], ours: a time constant of the DDAGR's motors."""
LONGEST_WINDOW = 60.0
"""[s], ours: beyond it a window is a roll-out, which a replay has besides."""


@dataclass(frozen=True, eq=False)
class RunResult:
    """Replay of one recording, or of several together.

    Attributes:
        prepared: recordings as they were replayed.
        drive_modes: one result for each drive mode that the recordings allow.
        report: for the document.
    """

    prepared: Prepared
    drive_modes: tuple[DriveModeResult, ...]
    report: RunReport


def steps(groups: int) -> int:
    """Steps of progress of a replay of so many groups of recordings."""
    return groups * len(DRIVES) * STEPS


DEFAULT_SETTINGS = ReplaySettings()


def replay_run(
    recordings: Sequence[Recording],
    robot: Robot,
    soil: Soil,
    settings: ReplaySettings = DEFAULT_SETTINGS,
    advance: Callable[[int], None] = lambda _: None,
) -> RunResult:
    """Replay recordings of one robot on one ground, driven by wheel speeds and by commands.

    With ``refit``, parameters are fitted first with wheel speeds imposed, where motors do not matter; the fit with
    commands starts from those values.

    Args:
        recordings: one, or several that share one set of parameters; of one sample period.
        robot: nominal robot.
        soil: nominal soil.
        settings: window, refit, effects, threads and seed.
        advance: called with the number of steps done; they sum to ``steps(1)``.

    Raises:
        InputError: nothing can be replayed, with the reason.
    """
    if not SHORTEST_WINDOW <= settings.window <= LONGEST_WINDOW:
        raise InputError(f"the window is {settings.window:g} s: give {SHORTEST_WINDOW:g} to {LONGEST_WINDOW:g} s.")
    before = time.process_time()
    prepared = prepare(recordings, robot, np.random.default_rng(settings.seed), settings.swapped, settings.effects)
    simulated = replace(settings, effects=simulated_effects(settings.effects))
    found: dict[str, DriveModeResult] = {}
    values: dict[str, float] = {}
    for drive_by in reversed(DRIVES):
        replayed = replay_drive_mode(prepared, robot, soil, drive_by, simulated, values, advance)
        if replayed is not None:
            found[drive_by], values = replayed
    if not found:
        names = ", ".join(r.meta.source for r in recordings)
        raise InputError(
            f"{names}: no window of {settings.window:g} s has valid commands or wheel speeds: "
            "give a shorter --window or another recording."
        )
    drive_modes = tuple(found[d] for d in DRIVES if d in found)
    absent = tuple(f"no window of {settings.window:g} s has known {d}." for d in DRIVES if d not in found)
    cpu = time.process_time() - before
    return RunResult(prepared, drive_modes, _run_report(recordings, prepared, drive_modes, absent, cpu))


def _run_report(
    recordings: Sequence[Recording],
    prepared: Prepared,
    drive_modes: Sequence[DriveModeResult],
    absent: Sequence[str],
    cpu: float,
) -> RunReport:
    return RunReport(
        tuple(r.meta.source for r in recordings),
        tuple(r.meta.source_sha256 for r in recordings),
        sum(len(r) for r in recordings),
        float(sum(r.t[b - 1] - r.t[a] for r in recordings for a, b in r.meta.spans)),
        prepared.period,
        "; ".join(dict.fromkeys(split.rule for split in prepared.splits)),
        dict(zip(CHANNELS, prepared.sigma.tolist(), strict=True)),
        tuple(item.pose_lateness for item in prepared.noise),
        tuple(item.pose_jitter for item in prepared.noise),
        (*prepared.notes, *absent),
        tuple(mode.report for mode in drive_modes),
        cpu,
    )


def make_report(runs: Sequence[RunResult], robot: str, soil: str, settings: ReplaySettings) -> ReplayReport:
    """Report of several runs with the same settings; ``robot`` and ``soil`` are names."""
    from ddagr_gym.version import __version__

    effects = tuple({"name": e.name, **e.as_mapping()["parameters"]} for e in settings.effects)
    return ReplayReport(
        SCHEMA, SCHEMA_VERSION, __version__, robot, soil, effects, settings.window, settings.refit, settings.seed,
        tuple(run.report for run in runs),
    )  # fmt: skip
