"""Recordings of candidates on trial, and what the checks of recordings say of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.checks.arbitration import Arbitration, arbitrated
from ddagr_gym.recordings.checks.clock_offsets import (
    LEAST_CORRELATION,
    Offset,
    encoder_offset,
    pose_offset,
    response_offset,
)
from ddagr_gym.recordings.checks.motion_windows import ENCODERS, GYRO, HEADING, POSITION
from ddagr_gym.recordings.checks.turning import GYRO_SCALE, gyro_against_pose
from ddagr_gym.recordings.checks.wheels import wheel_shares
from ddagr_gym.recordings.files import Limits
from ddagr_gym.recordings.guess.candidates import STAND_IN, Candidate, Contents
from ddagr_gym.recordings.schema import Recording, RobotGeometry
from ddagr_gym.recordings.streams import assemble
from ddagr_gym.recordings.topic_map import TopicMap

COPIED = 0.1
"""Share of what the gyro leaves of a heading that the encoders leave of it, below which the heading was computed from
them [-] (ours): a heading of its own shows the slip of a skid-steer robot, which the wheels do not know."""


NO_SLIP = 0.03
"""Share of turning by each bank, less 1, below which a heading knows no slip [-] (ours): skid-steer robots turn by a
half to three quarters of it."""


@dataclass(frozen=True)
class Trials:
    """Makes recordings of candidates.

    Attributes:
        contents: of the bag.
        geometry: of the robot; None where none is named.
        limits: on rows.
        seed: of resampled intervals.
        signs: of channels, as in a topic map.
    """

    contents: Contents
    geometry: RobotGeometry | None
    limits: Limits
    seed: int = 0
    signs: Mapping[str, Literal[1, -1]] = field(default_factory=dict)

    def rng(self) -> np.random.Generator:
        """Generator of a trial: the same one for each, so that their order does not matter."""
        return np.random.default_rng(self.seed)

    def recording(self, candidates: Mapping[str, Candidate | None]) -> Recording | None:
        """Recording of one candidate for each role; None where it has no rows.

        Args:
            candidates: by role; None for roles that are left out.
        """
        chosen = {role: candidate for role, candidate in candidates.items() if candidate is not None}
        base = "imu" if "imu" in chosen else next(iter(chosen), "")
        if not base:
            return None
        sources = {role: candidate.source for role, candidate in chosen.items()}
        topic_map = TopicMap(sources, base=base, signs=self.signs)
        topics = {role: candidate.topic for role, candidate in chosen.items()}
        samples = {role: candidate.samples for role, candidate in chosen.items()}
        try:
            return assemble(self.contents.bag.path, topic_map, topics, samples, self.geometry or STAND_IN, self.limits)
        except InputError:
            return None

    def turning(self, imu: Candidate | None, wheels: Candidate | None) -> Offset | None:
        """How the wheels' difference goes with the gyro."""
        recording = self.recording({"imu": imu, "wheels": wheels}) if imu and wheels else None
        return None if recording is None else encoder_offset(recording, self.rng())

    def response(self, imu: Candidate | None, wheels: Candidate | None, command: Candidate) -> Offset | None:
        """How the wheels go with a command."""
        recording = self.recording({"imu": imu, "wheels": wheels, "command": command}) if wheels else None
        return None if recording is None else response_offset(recording, self.rng())

    def heading(self, imu: Candidate | None, pose: Candidate) -> Offset | None:
        """How a pose's heading goes with the gyro."""
        recording = self.recording({"imu": imu, "pose": pose}) if imu else None
        known = recording is not None and recording.has("pose_yaw", "yaw_rate")
        return pose_offset(recording, self.rng()) if recording is not None and known else None

    def copies_wheels(self, imu: Candidate | None, wheels: Candidate | None, pose: Candidate) -> bool:
        """Whether a pose's heading was computed from the wheels.

        It turns as the wheels do without any slip, which no skid-steer robot does; or it follows them far more closely
        than the gyro; or more closely, and by another angle than the gyro.
        """
        if imu is None or wheels is None:
            return False
        recording = self.recording({"imu": imu, "wheels": wheels, "pose": pose})
        found = None if recording is None else arbitrated(recording, self.rng())
        if recording is None or found is None:
            return False
        if self._turns_without_slip(found):
            return True
        correlation = {frozenset(pair): abs(value) for pair, value in found.turning.correlation.items()}
        by_wheels, by_gyro = (1.0 - correlation.get(frozenset((HEADING, s)), math.nan) for s in (ENCODERS, GYRO))
        return bool(by_wheels < COPIED * by_gyro or (by_wheels < by_gyro and self._turns_otherwise(recording)))

    def _turns_without_slip(self, found: Arbitration) -> bool:
        """Whether the pose turns by what the robot's wheel radius and track make of the encoders."""
        windows = found.windows
        turn, travel = windows.turn[HEADING], windows.forward[POSITION]
        shares = None if self.geometry is None else wheel_shares(windows, ENCODERS, turn, travel, self.rng())
        return shares is not None and bool(np.all(np.abs(shares.values[[0, 2]] - 1.0) < NO_SLIP))

    def _turns_otherwise(self, recording: Recording) -> bool:
        """Whether the gyro turns by another angle than the pose."""
        found = gyro_against_pose(recording, self.rng())
        low, high = (math.nan, math.nan) if found is None else found.intervals[0]
        return low > GYRO_SCALE.expected[1] or high < GYRO_SCALE.expected[0]

    def arbitration(self, candidates: Mapping[str, Candidate | None]) -> Arbitration | None:
        """What the sources of motion say of each other; without a robot only signs and correlations mean anything."""
        recording = self.recording(candidates)
        return None if recording is None else arbitrated(recording, self.rng())


def goes_along(offset: Offset | None) -> bool:
    """Whether two signals have enough in common to say anything."""
    return offset is not None and abs(offset.correlation) >= LEAST_CORRELATION
