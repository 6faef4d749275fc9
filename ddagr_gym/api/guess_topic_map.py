"""``ddagr_gym.guess_topic_map``: a proposal for which topic of a bag holds what."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ddagr_gym.api.nominal import RobotLike, robot_from
from ddagr_gym.api.results import Result, Table
from ddagr_gym.errors import at_least
from ddagr_gym.files import write_text
from ddagr_gym.parameters import Robot
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits

if TYPE_CHECKING:
    from ddagr_gym.recordings.checks.findings import CheckFinding
    from ddagr_gym.recordings.guess.propose import Proposal
    from ddagr_gym.recordings.topic_map import TopicMap

TOPIC_HEADER = ("topic", "type", "messages", "Hz", "frame", "role", "why")


@dataclass(frozen=True, eq=False, repr=False)
class TopicMapGuess(Result):
    """A proposed topic map with its reasons; nothing was imported.

    Attributes:
        proposal: topics with roles and reasons, what is ambiguous, what is missing and what that costs, and findings of
            the checks on the recording that the map gives.
    """

    proposal: Proposal

    @property
    def topic_map(self) -> TopicMap:
        """The proposed map."""
        return self.proposal.topic_map

    @property
    def ambiguous(self) -> tuple[str, ...]:
        """What could as well be otherwise, one sentence each."""
        return self.proposal.ambiguous

    @property
    def missing(self) -> tuple[str, ...]:
        """Roles that nothing fills, with what that costs."""
        return self.proposal.missing

    @property
    def told(self) -> tuple[CheckFinding, ...]:
        """What the checks could tell of the recording that the map gives; suspicious ones are among ``ambiguous``."""
        return tuple(finding for finding in self.proposal.findings if finding.status != "not_testable")

    @property
    def headline(self) -> str:
        """Which topic fills which role."""
        filled = ", ".join(f"{role} is {source.topic}" for role, source in self.topic_map.topics.items())
        return f"{self.proposal.source}: {filled}"

    def tables(self) -> Sequence[Table]:
        """All topics; then what the checks say of the recording that the map gives."""
        from ddagr_gym.reporting.check_text import FINDING_HEADER, finding_row

        rows = [
            (t.name, t.message_type, t.count, f"{t.rate:.3g}" if t.rate else "", t.frame, t.role, t.why)
            for t in self.proposal.topics
        ]
        told = [finding_row(finding) for finding in self.told]
        return [Table(TOPIC_HEADER, rows), Table(FINDING_HEADER, told, "checks of the recording that this map gives")]

    def yaml(self) -> str:
        """The map as YAML, with the reasons as comments."""
        import yaml

        from ddagr_gym.recordings.guess.propose import map_entries

        comments = [f"{role}: {why}" for role, why in self.proposal.reasons.items()]
        comments += [*self.proposal.corrections, *(f"ambiguous: {sentence}" for sentence in self.ambiguous)]
        comments += [f"missing: {sentence}" for sentence in self.missing]
        head = "".join(f"# {comment}\n" for comment in comments)
        return head + yaml.safe_dump(map_entries(self.topic_map), sort_keys=False, allow_unicode=True, width=100)

    def to_yaml(self, path: str | os.PathLike[str]) -> None:
        """Write :meth:`yaml` as a file that ``ddagr import --map`` takes."""
        write_text(Path(path), self.yaml())

    def __str__(self) -> str:
        from ddagr_gym.reporting.check_text import findings_text
        from ddagr_gym.reporting.text_table import format_table

        topics = self.tables()[0]
        lines = [self.proposal.source, format_table(topics.header, topics.rows), ""]
        lines += [f"corrected: {sentence}" for sentence in self.proposal.corrections]
        lines += [f"ambiguous: {sentence}" for sentence in self.ambiguous]
        lines += [f"missing: {sentence}" for sentence in self.missing]
        lines += [f"doubt: {sentence}" for sentence in self.proposal.doubts]
        lines += [f"checks of the recording that this map gives: {findings_text(self.told)}"]
        return "\n".join(lines)


def guess_topic_map(
    path: str | os.PathLike[str],
    robot: RobotLike | None = None,
    *,
    namespace: str = "",
    seed: int = 0,
    maximum_rows: int = DEFAULT_LIMITS.rows,
    maximum_bytes: int = DEFAULT_LIMITS.bytes,
) -> TopicMapGuess:
    """Propose which topic of a bag is the IMU, the wheels, the command and the pose.

    Types of messages say what a topic can be; between several the checks of recordings decide (gravity, the gyro
    against the wheels, the wheels against the command, whether a pose was computed from the wheels), then names,
    frames and rates. Read the reasons before the map is used.

    Args:
        path: ROS bag (.bag, .db3, folder of a ROS 2 bag, each also compressed by zstd), or MCAP.
        robot: that drove: name, YAML file or object. Its wheel radius and track let the checks find exchanged or
            reversed wheels and axes; None leaves that out.
        namespace: of one robot in a bag of several ("/robot1").
        seed: of the resampled intervals.
        maximum_rows: refuse a bag with more messages.
        maximum_bytes: refuse a bag that unpacks to more bytes.

    Returns:
        The proposed map, the reason for each topic, what is ambiguous or missing, and what the checks say.

    Raises:
        InputError: no bag or a damaged one, no messages, no type that can be read, several robots without
            ``namespace``, or neither an IMU nor wheels.

    Examples:
        >>> import ddagr_gym
        >>> guess = ddagr_gym.guess_topic_map("my_bag", robot="husky")
        >>> guess.topic_map.topics["command"].topic, guess.missing
        ('/cmd_vel', ())
        >>> guess.to_yaml("my_topics.yaml")
        >>> drive = ddagr_gym.load_recording("my_bag", "my_topics.yaml")
    """
    from ddagr_gym.recordings.guess.propose import propose
    from ddagr_gym.recordings.schema import RobotGeometry

    at_least(seed=(seed, 0))
    limits = Limits(maximum_rows, maximum_bytes)
    if robot is None or str(robot) == "":
        return TopicMapGuess(propose(Path(path), None, "", limits, namespace, seed))
    name = robot.name if isinstance(robot, Robot) else str(robot)
    return TopicMapGuess(propose(Path(path), RobotGeometry.of(robot_from(robot)), name, limits, namespace, seed))
