"""From the candidates of a bag to a proposed topic map, with reasons, evidence, and what is missing."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.checks.arbitration import arbitration_findings
from ddagr_gym.recordings.checks.clock_offsets import clock_offsets
from ddagr_gym.recordings.checks.findings import CheckFinding, Status
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits
from ddagr_gym.recordings.guess.candidates import Contents, contents, rate_of
from ddagr_gym.recordings.guess.choose import Choice, choose_all
from ddagr_gym.recordings.guess.corrections import Correction, corrected
from ddagr_gym.recordings.guess.trials import Trials
from ddagr_gym.recordings.rosbag_reader import open_bag
from ddagr_gym.recordings.schema import Recording, RobotGeometry
from ddagr_gym.recordings.topic_map import ROLE_TYPES, TRANSFORMS, TopicMap, TopicSource

COSTS: Mapping[str, str] = {
    "imu": "`ddagr calibrate` refuses the drive, a diagnosis has wheels and pose alone (no fault of an IMU, no slope), "
    "and rows are the stamps of the wheels",
    "wheels": "`ddagr calibrate` refuses the drive, a diagnosis cannot tell late or weak motors from slip, and the "
    "checks cannot hold gyro and pose against the wheels",
    "command": "`ddagr diagnose`, `calibrate` and `replay` by commands refuse the drive; only `ddagr check` and "
    "`replay` by wheel speeds are left",
    "pose": "the gyro's scale and bias and the travel of the wheels have no witness, forecasts of position and heading "
    "are not judged, and faults of the pose cannot be asked for",
}
"""What cannot be asked without a role."""


@dataclass(frozen=True)
class TopicRow:
    """A topic and what the proposal does with it.

    Attributes:
        name: of the topic.
        message_type: without its package.
        count: of messages.
        rate: messages per second (median) [Hz]; 0 where they were not read.
        frame: of its first message; "" where unknown.
        role: that it fills; "" for none.
        why: the reason, in words.
    """

    name: str
    message_type: str
    count: int
    rate: float
    frame: str
    role: str
    why: str


@dataclass(frozen=True)
class Proposal:
    """A proposed topic map.

    Attributes:
        source: name of the bag.
        topics: all of the bag, in the order of their names.
        topic_map: the proposal.
        reasons: by role that is filled.
        corrections: what the checks changed, one sentence each.
        ambiguous: what could as well be otherwise, one sentence each.
        missing: roles that nothing fills, with what that costs.
        findings: of the checks, on the recording that the map gives.
        doubts: on its values, one sentence each.
    """

    source: str
    topics: tuple[TopicRow, ...]
    topic_map: TopicMap
    reasons: Mapping[str, str]
    corrections: tuple[str, ...]
    ambiguous: tuple[str, ...]
    missing: tuple[str, ...]
    findings: tuple[CheckFinding, ...]
    doubts: tuple[str, ...]


def propose(
    path: Path,
    geometry: RobotGeometry | None = None,
    robot: str = "",
    limits: Limits = DEFAULT_LIMITS,
    namespace: str = "",
    seed: int = 0,
) -> Proposal:
    """Propose which topic of a bag feeds which role.

    Args:
        path: of the bag.
        geometry: robot's; without it scales cannot be checked, and nothing is corrected.
        robot: name or file to write into the map.
        limits: on messages and bytes.
        namespace: of one robot in a bag of several ("/robot1").
        seed: of the resampled intervals.

    Raises:
        InputError: no bag or a damaged one, no messages, no type that can be read, several robots, or neither an IMU
            nor wheels.
    """
    with open_bag(path, limits) as bag:
        found = contents(bag, geometry, limits, namespace)
    first = Trials(found, geometry, limits, seed)
    correction = corrected(first, choose_all(first))
    choices = correction.choices
    topic_map = _map(found, correction, robot, path.name)
    recording = correction.trials.recording(correction.candidates)
    findings = tuple(_findings(correction, recording))
    return Proposal(
        source=path.name,
        topics=tuple(_rows(found, choices)),
        topic_map=topic_map,
        reasons={role: choice.why for role, choice in choices.items() if choice.candidate is not None},
        corrections=correction.sentences,
        ambiguous=tuple(_ambiguous(found, choices, findings)),
        missing=tuple(_missing(choices, geometry)),
        findings=findings,
        doubts=recording.validate() if recording else (),
    )


def _map(found: Contents, correction: Correction, robot: str, name: str) -> TopicMap:
    sources = {r: c.candidate.source for r, c in correction.choices.items() if c.candidate is not None}
    base = next((role for role in ("imu", "wheels") if role in sources), None)
    if base is None:
        said = "; ".join(f"{role}: {correction.choices[role].why}" for role in ("imu", "wheels"))
        raise InputError(f"{name} has neither an IMU nor wheels that can be used ({said}): record them.")
    return TopicMap(
        sources,
        base=base,
        stamps=found.stamps,
        signs=correction.trials.signs,
        robot=robot,
        description=f"proposed by ddagr import --guess for {name}",
        name="guessed",
    )


def _rows(found: Contents, choices: Mapping[str, Choice]) -> Iterator[TopicRow]:
    filled = {c.candidate.topic.name: role for role, c in choices.items() if c.candidate is not None}
    rates = {c.topic.name: rate_of(c.samples) for c in found.candidates}
    for topic in found.topics:
        role = filled.get(topic.name, "")
        why = choices[role].why if role else _why_not(topic.name, topic.message_type, choices)
        yield TopicRow(
            topic.name,
            topic.message_type,
            topic.count,
            rates.get(topic.name, 0.0),
            found.frames.get(topic.name, ""),
            role,
            why,
        )


def _why_not(name: str, message_type: str, choices: Mapping[str, Choice]) -> str:
    for role, choice in choices.items():
        said = [why for label, why in choice.others.items() if label.split(" (", 1)[0] == name]
        if said:
            best = f" ({choice.candidate.label} is better)" if choice.candidate else ""
            return f"not the {role}: {said[0]}{best}"
    if message_type == TRANSFORMS:
        return "transforms between frames"
    known = any(message_type in kinds for kinds in ROLE_TYPES.values())
    return "no sample that can be used" if known else "not read"


def _ambiguous(found: Contents, choices: Mapping[str, Choice], findings: tuple[CheckFinding, ...]) -> Iterator[str]:
    if found.why_receive:
        yield f"stamps: times of receipt are used, because {found.why_receive}"
    for choice in choices.values():
        yield from filter(None, (choice.ambiguous, choice.open_side))
    for finding in findings:
        if finding.status is Status.SUSPICIOUS:
            yield f"the checks speak against {finding.channel}: {finding.meaning} {finding.remedy}".rstrip()


def _missing(choices: Mapping[str, Choice], geometry: RobotGeometry | None) -> Iterator[str]:
    if geometry is None:
        yield (
            "no robot (--robot): its wheel radius and track turn body-speed commands into bank speeds, and let the "
            "checks find exchanged or reversed wheels and axes"
        )
    for role, choice in choices.items():
        if choice.candidate is None:
            yield f"no {role} ({choice.why}): {COSTS[role]}"


def _findings(correction: Correction, recording: Recording | None) -> Iterator[CheckFinding]:
    """Clocks, and with a robot what sources of motion say of each other."""
    if recording is None:
        return
    trials = correction.trials
    yield from clock_offsets(recording, trials.rng())
    if trials.geometry is not None:
        found = trials.arbitration(correction.candidates)
        yield from arbitration_findings(found) if found else ()


def map_entries(topic_map: TopicMap) -> dict[str, Any]:
    """Content of a topic map's YAML file, without what has its default."""
    topics = {role: _changed(source, TopicSource()) for role, source in topic_map.topics.items()}
    rest = _changed(topic_map, TopicMap(topic_map.topics, base=topic_map.base))
    head = {"description": topic_map.description, "base": topic_map.base, "stamps": topic_map.stamps}
    rest = {name: value for name, value in rest.items() if name not in (*head, "name", "topics")}
    return {**head, **rest, "topics": topics}


def _changed(given: Any, default: Any) -> dict[str, Any]:
    pairs = ((item.name, getattr(given, item.name)) for item in fields(given))
    changed = {name: value for name, value in pairs if value != getattr(default, name)}
    return {name: list(value) if isinstance(value, tuple) else value for name, value in changed.items()}
