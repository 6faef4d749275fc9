"""Which candidate fills each role: by the checks of recordings, names, frames and rates, in this order of weight."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from ddagr_gym.recordings.checks.clock_offsets import Offset
from ddagr_gym.recordings.checks.timing import SLOWEST
from ddagr_gym.recordings.guess.banks import Banks, banks_of, moves
from ddagr_gym.recordings.guess.candidates import WORLDS, Candidate, as_wheels
from ddagr_gym.recordings.guess.names import command_rank, is_inside_sensor, is_measured
from ddagr_gym.recordings.guess.trials import Trials, goes_along
from ddagr_gym.recordings.topic_map import TRANSFORMS


@dataclass(frozen=True)
class Merit:
    """What speaks for a candidate: values in the order of their weight, each with a sentence's part."""

    values: tuple[float, ...]
    words: tuple[str, ...]


@dataclass(frozen=True)
class Choice:
    """Candidate of a role.

    Attributes:
        role: of the topic map.
        candidate: None where none is fit.
        why: what speaks for it, in words; why there is none where it is None.
        others: what speaks against each of the others, by label.
        ambiguous: sentence where another one is as good; "" else.
        banks: of the wheels.
        open_side: sentence where nothing has told yet which of the banks is the right one; "" else.
    """

    role: str
    candidate: Candidate | None
    why: str
    others: Mapping[str, str] = field(default_factory=dict)
    ambiguous: str = ""
    banks: Banks | None = None
    open_side: str = ""


def best_of(
    role: str, merits: Sequence[tuple[Candidate, Merit]], none: str, fit: Callable[[Merit], bool] = lambda _: True
) -> Choice:
    """The candidate with the largest merit.

    Args:
        role: of the topic map.
        merits: of every candidate; the last value (a rate or a count) decides, but does not make the choice clear.
        none: why there is no choice where there are no candidates.
        fit: whether a candidate may be chosen at all.
    """
    ranked = sorted(merits, key=lambda pair: pair[1].values, reverse=True)
    if not ranked:
        return Choice(role, None, none)
    if not fit(ranked[0][1]):
        others = {candidate.label: _weakest(merit) for candidate, merit in ranked}
        return Choice(role, None, "; ".join(f"{label}: {why}" for label, why in others.items()), others)
    (best, merit), rivals = ranked[0], ranked[1:]
    others = {rival.label: _difference(merit, lesser) for rival, lesser in rivals if rival.label != best.label}
    same = [rival.label for rival, lesser in rivals if lesser.values[:-1] == merit.values[:-1]]
    same = [label for label in dict.fromkeys(same) if label != best.label]
    ambiguous = f"{role}: {' and '.join([best.label, *same])} are alike but for {merit.words[-1]}" if same else ""
    why = "; ".join(filter(None, merit.words[:-1])) or "the only one of its kind"
    return Choice(role, best, why, others, ambiguous)


def _difference(best: Merit, other: Merit) -> str:
    """The first thing in which another candidate is behind."""
    pairs = zip(best.values, other.values, other.words, strict=True)
    return next((words for mine, theirs, words in pairs if mine != theirs), "") or "as good"


def _weakest(merit: Merit) -> str:
    return next((words for value, words in zip(merit.values, merit.words, strict=True) if value <= 0), "")


def choose_wheels(trials: Trials) -> Choice:
    """The JointState with the wheels."""
    merits, banks = [], {}
    for candidate in trials.contents.of("wheels"):
        found = banks_of(candidate)
        if found is None:
            continue
        wheels = as_wheels(candidate, found.right, found.left)
        if len(wheels.samples.t) < 2:
            continue
        banks[candidate.label] = found
        merits.append((wheels, _wheel_merit(wheels, found, moves(candidate, found))))
    none = "no JointState has two or more joints with velocities that could be wheels, in one message"
    choice = best_of("wheels", merits, none)
    if choice.candidate is None:
        return choice
    label = choice.candidate.label
    return Choice("wheels", choice.candidate, choice.why, choice.others, choice.ambiguous, banks[label])


def _wheel_merit(wheels: Candidate, banks: Banks, moving: bool) -> Merit:
    return Merit(
        (float(moving), float(banks.by_name), float(wheels.rate >= SLOWEST["encoder"]), wheels.rate),
        ("" if moving else "its wheels never turn", banks.why, "", f"{wheels.rate:.3g} Hz"),
    )


def sided(trials: Trials, wheels: Choice, imu: Choice) -> Choice:
    """Wheels whose sides the gyro decides where their names do not.

    The right wheels are those that turn faster in a turn to the left.
    """
    if wheels.candidate is None or wheels.banks is None or wheels.banks.by_name:
        return wheels
    offset = trials.turning(imu.candidate, wheels.candidate)
    if offset is None or not goes_along(offset):
        return replace(wheels, open_side="wheels: neither names nor turns tell which side is right")
    banks = wheels.banks if offset.correlation > 0 else wheels.banks.exchanged()
    candidate = next(c for c in trials.contents.of("wheels") if c.topic == wheels.candidate.topic)
    why = (
        f"{' and '.join(banks.right)} right, as the gyro says (correlation {abs(offset.correlation):.2f} with the "
        f"difference); {wheels.why}"
    )
    return Choice("wheels", as_wheels(candidate, banks.right, banks.left), why, wheels.others, wheels.ambiguous, banks)


def choose_imu(trials: Trials, wheels: Choice) -> Choice:
    """The IMU on the robot's body."""
    merits = [(imu, _imu_merit(trials, imu, wheels)) for imu in trials.contents.of("imu")]
    return best_of("imu", merits, "no Imu has messages")


def _imu_merit(trials: Trials, imu: Candidate, wheels: Choice) -> Merit:
    recording = trials.recording({"imu": imu})
    doubts = [d for d in recording.validate() if d.startswith("specific_force")] if recording else ["no rows"]
    fast = imu.rate >= SLOWEST["specific_force"]
    offset = trials.turning(imu, wheels.candidate)
    turning = goes_along(offset)
    inside = is_inside_sensor(imu.topic.name)
    frame = imu.source.frame
    return Merit(
        (float(not doubts), float(fast), float(turning), float(not inside), float(bool(frame)), imu.rate),
        (
            doubts[0].rstrip(".") if doubts else "gravity is in z",
            "" if fast else f"only {imu.rate:.3g} Hz",
            _turning_words(offset) if wheels.candidate else "",
            "named like one inside another sensor" if inside else "",
            f"turned from {imu.frame} into {frame} by the transforms" if frame else "",
            f"{imu.rate:.3g} Hz",
        ),
    )


def _turning_words(offset: Offset | None) -> str:
    if offset is None:
        return "too few turns to compare its gyro with the wheels"
    along = "goes" if goes_along(offset) else "does not go"
    return f"its gyro {along} with the wheels' difference (correlation {offset.correlation:.2f})"


def choose_command(trials: Trials, imu: Choice, wheels: Choice) -> Choice:
    """The Twist that the robot obeyed."""
    merits = [(c, _command_merit(trials, c, imu, wheels)) for c in trials.contents.of("command")]
    return best_of("command", merits, "no Twist or TwistStamped has messages", lambda merit: min(merit.values[:2]) > 0)


def _command_merit(trials: Trials, command: Candidate, imu: Choice, wheels: Choice) -> Merit:
    measured = is_measured(command.topic.name)
    offset = trials.response(imu.candidate, wheels.candidate, command)
    late = offset is not None and goes_along(offset) and offset.interval[1] < 0
    correlation = round(20 * max(offset.correlation, 0.0)) / 20 if offset is not None else 0.0
    rank = command_rank(command.topic.name)
    ranks = ("its name is that of a command before a multiplexer", "", "its name is that of a command")
    return Merit(
        (float(not measured), float(not late), correlation, float(rank), float(command.topic.count)),
        (
            "its name is that of a measurement" if measured else "",
            f"it comes {-offset.lag:.2f} s after the wheels: measured, not commanded" if late and offset else "",
            _response_words(offset) if wheels.candidate else "",
            ranks[rank],
            f"{command.topic.count} messages",
        ),
    )


def _response_words(offset: Offset | None) -> str:
    if offset is None:
        return "too few changes to compare it with the wheels"
    if not goes_along(offset):
        return f"the wheels do not follow it (correlation {offset.correlation:.2f})"
    return f"the wheels follow it {offset.lag:.2f} s later (correlation {offset.correlation:.2f})"


def choose_pose(trials: Trials, imu: Choice, wheels: Choice) -> Choice:
    """The pose that knows what the wheels do not."""
    merits = [(c, _pose_merit(trials, c, imu, wheels)) for c in trials.contents.of("pose")]
    return best_of("pose", merits, "no Odometry, pose or fix has messages", lambda merit: merit.values[0] > 0)


def _pose_merit(trials: Trials, pose: Candidate, imu: Choice, wheels: Choice) -> Merit:
    offset = trials.heading(imu.candidate, pose)
    copied = trials.copies_wheels(imu.candidate, wheels.candidate, pose)
    headed = "pose_yaw" in pose.samples.values
    world = next((len(WORLDS) - k for k, name in enumerate(WORLDS) if pose.frame.endswith(name)), 0)
    fast = pose.rate >= SLOWEST["pose"]
    words = f" (correlation {offset.correlation:.2f})" if offset is not None else ""
    return Merit(
        (
            float(not copied), float(headed), float(goes_along(offset)), float(fast), float(world),
            float(pose.topic.message_type != TRANSFORMS), pose.rate,
        ),
        (
            "its heading is computed from the wheels, and says nothing of their slip" if copied else "",
            "" if headed else "it has no heading",
            f"its heading {'goes' if goes_along(offset) else 'does not go'} with the gyro{words}" if headed else "",
            "" if fast else f"only {pose.rate:.3g} Hz",
            f"in the frame {pose.frame}" if pose.frame else "",
            "from the transforms" if pose.topic.message_type == TRANSFORMS else "",
            f"{pose.rate:.3g} Hz",
        ),
    )  # fmt: skip


def choose_all(trials: Trials) -> dict[str, Choice]:
    """Choices by role: wheels and IMU first, which judge the others."""
    wheels = choose_wheels(trials)
    imu = choose_imu(trials, wheels)
    told = sided(trials, wheels, imu)
    if told is not wheels:
        wheels, imu = told, choose_imu(trials, told)
    command = choose_command(trials, imu, wheels)
    pose = choose_pose(trials, imu, wheels)
    return {choice.role: choice for choice in itertools.chain((imu, wheels, command, pose))}
