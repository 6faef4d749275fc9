"""Step 0: what the recordings say is wrong with themselves, before any physics is looked for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ddagr_gym.diagnosis.answer.verdict import DataDoubt
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.physics.effects.command_gain import CommandGain
from ddagr_gym.physics.effects.encoder_scale import EncoderScale
from ddagr_gym.recordings.checks.across import across_runs
from ddagr_gym.recordings.checks.findings import CheckFinding, Status
from ddagr_gym.recordings.checks.run import check_recording
from ddagr_gym.recordings.checks.travel import command_gains
from ddagr_gym.recordings.checks.turning import left_over_right
from ddagr_gym.recordings.pose_frames import frames_apart
from ddagr_gym.recordings.schema import Recording

STUCK = "stuck"
"""Family of checks on channels that never change."""

UNLIKE_GAINS = 1.08
"""Right over left bank's gain, or one over it, from which a fit is asked [-] (ours). Three minutes of ordinary drives
reach 1.1: this only asks, and forecasts decide."""

FRAMES = "frames"
"""Doubt about the frames of poses."""


def data_doubts(recordings: Sequence[Recording], rng: np.random.Generator) -> tuple[DataDoubt, ...]:
    """All that `ddagr check` finds suspicious.

    Args:
        recordings: at least one, of one robot.
        rng: for the resampled intervals of the checks.
    """
    reports = [check_recording(recording, rng) for recording in recordings]
    found = []
    for report in reports:
        found += [DataDoubt(report.source, "", "schema", sentence) for sentence in report.sentences]
        found += [_doubt(report.source, finding) for finding in report.suspicious]
    found += [_frames_doubt(recording) for recording in recordings if frames_apart(recording)]
    together = across_runs(recordings, reports)
    return (*found, *(_doubt("", finding) for finding in together if finding.status is Status.SUSPICIOUS))


def _frames_doubt(recording: Recording) -> DataDoubt:
    sentence = (
        f"It consists of {len(recording.meta.spans)} stretches whose poses are in frames of their own: the robot would "
        "have jumped between them. Nothing is said of directions and places in the world, and slopes and soil patches "
        "are not tried. Give poses in one frame if there are any."
    )
    return DataDoubt(recording.meta.source, "pose_yaw", FRAMES, sentence)


def _doubt(recording: str, finding: CheckFinding) -> DataDoubt:
    sentence = f"{finding.meaning} {finding.remedy}".strip()
    return DataDoubt(recording, finding.channel, finding.check, sentence, finding.suspects)


def doubted_banks(recordings: Sequence[Recording], rng: np.random.Generator) -> tuple[str, ...]:
    """Names of effects by which the banks may differ, for a fit to decide.

    Scales of the encoders where a turn of one bank's turns the robot otherwise than one of the other's, by the gyro;
    else gains of the commands where one bank settles at another share of them than the other. Every recording that
    tells must say so, to one side.

    Args:
        recordings: with faults mended that show in the values.
        rng: of resampled intervals.
    """
    scales = [left_over_right(recording, rng) for recording in recordings]
    if _to_one_side([scale for scale in scales if scale is not None], 1.0):
        return (EncoderScale.name,)
    gains = [command_gains(recording, rng) for recording in recordings]
    ratios = [float(item.values[2]) for item in gains if item is not None and item.values[2] > 0.0]
    return (CommandGain.name,) if _to_one_side(ratios, UNLIKE_GAINS) else ()


def _to_one_side(ratios: Sequence[float], limit: float) -> bool:
    """Whether there are ratios, and all are above a limit or all below one over it."""
    return bool(ratios) and (min(ratios) > limit or max(ratios) < 1.0 / limit)


def suspects_of(doubts: Sequence[DataDoubt]) -> tuple[str, ...]:
    """Effects that would explain what the checks found, each once."""
    return tuple(dict.fromkeys(name for doubt in doubts for name in doubt.suspects))


def dead_channels(doubts: Sequence[DataDoubt]) -> tuple[str, ...]:
    """Channels which a diagnosis would compare and which never change while the robot drives."""
    stuck = {doubt.channel for doubt in doubts if doubt.finding == STUCK}
    return tuple(name for name in CHANNELS if name in stuck)
