"""Readings that belong to other channels than the map says, found before anything is fitted.

What `ddagr check` arbitrates is certain where the majority of independent sources says it: encoders or commands of the
other side, or that count backwards, an IMU upside down, a pose whose heading turns the wrong way. No effect of the
library describes these, and others would borrow their place.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from ddagr_gym.diagnosis.answer.verdict import Estimate
from ddagr_gym.recordings.checks.arbitration import Arbitration, arbitrated, arbitration_findings
from ddagr_gym.recordings.checks.blocks import CONFIDENCE
from ddagr_gym.recordings.checks.findings import CheckFinding, Interval, Status
from ddagr_gym.recordings.checks.imu_findings import mounting_takes
from ddagr_gym.recordings.checks.map_lines import Takes, map_lines
from ddagr_gym.recordings.checks.motion_windows import COMMANDS, COURSE, ENCODERS, HEADING
from ddagr_gym.recordings.checks.wheels import RIGHT_AND_LEFT, wheel_takes, wheels_followed, wheels_of
from ddagr_gym.recordings.schema import Recording

_POSE: Mapping[str, tuple[str, str]] = {
    HEADING: ("heading_reversed", "pose_yaw"),
    COURSE: ("path_mirrored", "pose_y"),
}


@dataclass(frozen=True)
class ChannelFault:
    """One thing that is wrong with a map.

    Attributes:
        name: in a verdict.
        sizes: what its sentence needs: sign of each bank's readings, direction of an IMU's x axis.
        takes: readings that belong to each channel.
        score: by how many standard errors it is beyond doubt.
    """

    name: str
    sizes: Mapping[str, Estimate]
    takes: Takes
    score: float

    @property
    def remedy(self) -> str:
        """What to write into the map."""
        return map_lines(self.takes)


def find_channel_faults(recordings: Sequence[Recording], rng: np.random.Generator) -> tuple[ChannelFault, ...]:
    """Faults that every recording shows which can tell.

    Args:
        recordings: at least one, of one robot and one map; without its geometry nothing is found.
        rng: of the intervals.
    """
    found = _arbitrations(recordings, rng)
    faults: list[ChannelFault] = []
    for source in (ENCODERS, COMMANDS):
        faults += _agreed([item for item in (_wheel_faults(one, source) for one in found) if item is not None])
    faults += _agreed([item for item in (_mounting_faults(one) for one in found) if item is not None])
    faults += _agreed([item for item in (_pose_faults(one) for one in found) if item is not None])
    return tuple(faults)


def contradictions(recordings: Sequence[Recording], rng: np.random.Generator) -> tuple[CheckFinding, ...]:
    """What sources of one motion still say against each other, as `ddagr check` finds it.

    Args:
        recordings: mended.
        rng: of the intervals.
    """
    said = [finding for item in _arbitrations(recordings, rng) for finding in arbitration_findings(item)]
    return tuple(finding for finding in said if finding.status is Status.SUSPICIOUS)


def _arbitrations(recordings: Sequence[Recording], rng: np.random.Generator) -> list[Arbitration]:
    """Of each recording that can tell, as if it were alone."""
    found = (arbitrated(recording, deepcopy(rng)) for recording in recordings)
    return [item for item in found if item is not None]


def _agreed(found: Sequence[tuple[ChannelFault, ...]]) -> tuple[ChannelFault, ...]:
    """Faults on which all recordings that can tell agree, each as sure as the recording that is least sure."""
    if not found or any(_meaning(item) != _meaning(found[0]) for item in found):
        return ()
    return tuple(min(same, key=lambda fault: fault.score) for same in zip(*found, strict=True))


def _meaning(faults: Sequence[ChannelFault]) -> list[tuple[str, Takes]]:
    return [(fault.name, fault.takes) for fault in faults]


def _wheel_faults(found: Arbitration, source: str) -> tuple[ChannelFault, ...] | None:
    """What is wrong with encoders or commands; None where the drive cannot tell."""
    shares, margins = found.wheels[source], slice(0, 4)
    wheels = wheels_of(shares)
    if wheels is None and found.accused(source):
        shares, wheels, margins = found.followed, wheels_followed(found.followed), slice(4, 6)
    if shares is None or wheels is None:
        return None
    takes = wheel_takes(source, wheels)
    if not takes:
        return ()
    moved = any(taken != channel for channel, (taken, _) in takes.items())
    kind = source.removesuffix("s")
    signs = {bank: Estimate(takes.get(f"{kind}_{bank}", ("", 1.0))[1], "-") for bank in RIGHT_AND_LEFT}
    score = min(_score(float(v), i) for v, i in zip(shares.values[margins], shares.intervals[margins], strict=True))
    return (ChannelFault(f"{source}_{'exchanged' if moved else 'reversed'}", signs, takes, score),)


def _mounting_faults(found: Arbitration) -> tuple[ChannelFault, ...] | None:
    """An IMU upside down, which the library has no effect for; None where the drive cannot tell.

    Without gravity the same readings may have two wrong signs, which the library has effects for.
    """
    fit = found.mounting
    if fit is None or not fit.decided or not math.isfinite(fit.errors[2, 2]):
        return None
    best = fit.best
    if not best.upside_down or best.faults > 1:
        return ()
    yaw = Estimate(math.atan2(best.rotation[0, 1], best.rotation[0, 0]), "rad")
    return (ChannelFault("imu_upside_down", {"yaw": yaw}, mounting_takes(best), math.sqrt(max(fit.lead, 0.0))),)


def _pose_faults(found: Arbitration) -> tuple[ChannelFault, ...] | None:
    """A pose that turns the wrong way; None where the drive cannot tell.

    A path alone that is mirrored may have its axes exchanged as well, which no sign mends.
    """
    votes = found.turning
    if not votes.decided or HEADING not in (*votes.majority, *votes.minority):
        return None
    if HEADING in votes.majority or votes.support_interval[HEADING][1] >= 0.0:
        return ()
    faults = []
    for source, (name, channel) in _POSE.items():
        if source in votes.minority:
            score = _score(votes.support[source], votes.support_interval[source])
            faults.append(ChannelFault(name, {"flip": Estimate(1.0, "-")}, {channel: (channel, -1.0)}, score))
    return tuple(faults)


def _score(value: float, interval: Interval) -> float:
    """Standard errors between a value and 0."""
    return float(2 * ndtri((1 + CONFIDENCE) / 2) * abs(value) / (interval[1] - interval[0]))
