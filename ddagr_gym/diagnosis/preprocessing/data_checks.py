"""Step 0: what the recordings say is wrong with themselves, before any physics is looked for."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass

import numpy as np

from ddagr_gym.diagnosis.answer.verdict import DataDoubt
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.physics.effects.command_gain import CommandGain
from ddagr_gym.physics.effects.encoder_scale import EncoderScale
from ddagr_gym.recordings.checks.across import across_runs
from ddagr_gym.recordings.checks.command_gains import GAIN_BALANCE, STRAIGHT_GAIN, command_gains, straight_gain
from ddagr_gym.recordings.checks.findings import CheckFinding, Interval, Status
from ddagr_gym.recordings.checks.run import check_recording
from ddagr_gym.recordings.checks.travel import LEAST_SLIP, drive_share_with_least_slip
from ddagr_gym.recordings.checks.turning import left_over_right
from ddagr_gym.recordings.pose_frames import frames_apart
from ddagr_gym.recordings.schema import Recording

STUCK = "stuck"
"""Family of checks on channels that never change."""

UNLIKE_GAINS = 1.08
"""Right over left bank's gain, or one over it, from which a fit is asked [-] (ours). Three minutes of ordinary drives
reach 1.1: this only asks, and forecasts decide."""

SLOWER = 0.95
"""Gain straight ahead below which both encoders may read too little [-] (ours): 0.97 at least on six ordinary
drives."""

EACH = 1.02
"""Gain of either bank, or one over it, from which both differ from their commands [-] (ours): where one side of three
ordinary drives obeys 1.18 times its commands, the other one is at 1.005 at most."""

FRAMES = "frames"
"""Doubt about the frames of poses."""


def data_doubts(recordings: Sequence[Recording], rng: np.random.Generator) -> tuple[DataDoubt, ...]:
    """All that `ddagr check` finds suspicious.

    Args:
        recordings: at least one, of one robot.
        rng: for the resampled intervals of the checks.
    """
    # each as if it were alone: what is doubted of one must not depend on the others
    reports = [check_recording(recording, deepcopy(rng)) for recording in recordings]
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


@dataclass(frozen=True)
class DoubtedBanks:
    """What a fit is asked of the banks.

    Attributes:
        factors: names of effects whose factor of each bank is fitted.
        common: names of effects that may be what both banks have in common; empty where that is not in doubt.
        held: gain straight ahead with its interval, of every recording that tells it, where that is in doubt.
    """

    factors: tuple[str, ...] = ()
    common: tuple[str, ...] = ()
    held: tuple[tuple[float, Interval], ...] = ()


NO_DOUBT = DoubtedBanks()
"""Banks that do as they are told, and as their encoders say."""


def doubted_banks(recordings: Sequence[Recording], rng: np.random.Generator) -> DoubtedBanks:
    """Effects by which the banks may differ from each other or from their commands, for a fit to decide.

    Scales of the encoders where a turn of one bank's turns the robot otherwise than one of the other's, by the gyro;
    else gains of the commands where one bank settles at another share of them than the other. Where both are faster
    than they were told, either may be it, unless poses speak against one; where they are slower and poses travel
    further than they roll, it is the encoders. Every recording that tells must say so, to one side.

    Args:
        recordings: with faults mended that show in the values.
        rng: of resampled intervals.
    """
    scales = [left_over_right(recording, rng) for recording in recordings]
    if _to_one_side([scale for scale in scales if scale is not None], 1.0):
        return DoubtedBanks((EncoderScale.name,))
    gains = [command_gains(recording, rng) for recording in recordings]
    ratios = [float(item.values[2]) for item in gains if item is not None and item.values[2] > 0.0]
    held = tuple(item for item in map(straight_gain, recordings) if item is not None)
    common = _both_banks(recordings, [gain for gain, _ in held], ratios, rng)
    if common:
        return DoubtedBanks(common[:1], common, held)
    return DoubtedBanks((CommandGain.name,) if _to_one_side(ratios, UNLIKE_GAINS) else ())


def _both_banks(
    recordings: Sequence[Recording], found: Sequence[float], ratios: Sequence[float], rng: np.random.Generator
) -> tuple[str, ...]:
    """What both banks have in common that no drivetrain does, the likelier first; empty where there is nothing.

    Encoders of another scale read as if the wheels slipped, or were pushed; gains of the commands do not. Wheels that
    are slower than they were told have other reasons, unless poses travel further than they roll.

    Args:
        recordings: with faults mended that show in the values.
        found: gains straight ahead, of those that tell it.
        ratios: of the gain of the right bank to that of the left, of those that tell it.
        rng: of resampled intervals.
    """
    unlike = max((max(ratio, 1.0 / ratio) for ratio in ratios), default=1.0)
    if not found or unlike > GAIN_BALANCE.expected[1]:
        return ()
    # the mean of both banks may be above a command because one of them is
    slower, faster = min(found) * 2.0 / (1.0 + unlike), max(found) * 2.0 * unlike / (1.0 + unlike)
    above = min(found) > STRAIGHT_GAIN.expected[1] and slower > EACH
    below = max(found) < SLOWER and faster < 1.0 / EACH
    if not (above or below):
        return ()
    gain, (low, high) = float(np.mean(found)), LEAST_SLIP
    shares = [item for item in (drive_share_with_least_slip(one, rng) for one in recordings) if item is not None]
    encoders = all(low <= share * gain <= high for share in shares)
    commands = all(low <= share <= high for share in shares)
    if above:
        possible = ((EncoderScale.name, encoders or not commands), (CommandGain.name, commands or not encoders))
        return tuple(name for name, is_possible in possible if is_possible)
    pushed = bool(shares) and min(shares) > high
    return (EncoderScale.name,) if pushed and encoders else ()


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
