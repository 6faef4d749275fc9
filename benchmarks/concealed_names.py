"""Two vocabularies of a diagnosis for what stands between command and wheel, brought together for the scores.

A diagnosis names effects of the library, or parts of the drivetrain that the simulator lacks. A label has effects only.
A part counts as the effect that it stands for; one that stands for another effect than the truth is a wrong name, and
several parts that stand for one effect are one name. Some true effects have a second name that is as right; their
labels say so (``also``, which the form has: ``benchmarks/concealed/forms_drivetrain.py``).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import permutations
from typing import Any, NamedTuple


class Family(NamedTuple):
    """What a part of the drivetrain counts as.

    Attributes:
        effects: of the library, the usual one first.
        reason: why.
    """

    effects: tuple[str, ...]
    reason: str


PART_FAMILIES: dict[str, Family] = {
    "command_delay": Family(("command_delay",), "the same dead time of the commands"),
    "turning_limit": Family(("motor_saturation",), "a ceiling of what the banks are asked for"),
    "command_ramp": Family(
        ("motor_lag", "motor_saturation"),
        "speeds come late after a step; the library's saturation has the same ramp as its limit of acceleration",
    ),
    "mean_ramp": Family(("motor_lag", "motor_saturation"), "the same of the mean of both banks"),
    "turning_ramp": Family(("motor_lag", "motor_saturation"), "the same of how far the banks are apart"),
    "command_filter": Family(("motor_lag",), "its second pole is a filter of the commands"),
    "speed_loop": Family(("motor_lag",), "another rate of the loop is another time constant"),
    "integral": Family(("motor_droop",), "it tells how speed that was lost to a load comes back"),
    "integral_limit": Family(("motor_droop",), "beyond it a load takes speed for good"),
    "load": Family(("motor_droop",), "the ground's torque takes speed, by 1/(J k) in a proportional loop"),
    "torque_limit": Family(("motor_saturation",), "a ceiling of the acceleration"),
    "no_load_speed": Family(("motor_saturation",), "a ceiling of the torque that falls to nothing at a highest speed"),
    "power_limit": Family(("motor_saturation",), "a ceiling of torque times speed"),
    "speed_limit": Family(("motor_saturation",), "the library's limit of speed"),
    "limit_imbalance": Family(("motor_saturation",), "it says that the ceilings of the banks differ"),
    "friction": Family(("motor_droop",), "a torque that takes speed, as the ground's does"),
}
"""By part, as in ``ddagr_gym.diagnosis.answer.drivetrain.PART_TITLES``."""


def accepted(label: Mapping[str, Any]) -> list[frozenset[str]]:
    """Names that are right for each effect of a label; "none" or "unknown" for itself.

    Args:
        label: of a case or pair.
    """
    also = {effect["name"]: effect.get("also", ()) for effect in label.get("effects", ())}
    return [frozenset((name, *also.get(name, ()))) for name in label["verdict"]]


def as_effects(names: Iterable[str], wanted: Iterable[frozenset[str]] = ()) -> list[str]:
    """Names with parts of the drivetrain as the effects that they stand for, each of those once.

    Args:
        names: of effects and parts, "none" or "unknown".
        wanted: right names by effect; a part that stands for several effects counts as one that is wanted.
    """
    said = list(names)
    aims = frozenset().union(*wanted)
    effects = [name for name in said if name not in PART_FAMILIES]
    stood_for = dict.fromkeys(_stood_for(name, aims) for name in said if name in PART_FAMILIES)
    return effects + [name for name in stood_for if name not in effects]


def _stood_for(part: str, wanted: frozenset[str]) -> str:
    effects = PART_FAMILIES[part].effects
    return next((name for name in effects if name in wanted), effects[0])


def rightly_named(label: Mapping[str, Any], names: Sequence[str]) -> bool:
    """Whether every effect has a right name of its own, and no name is of anything else.

    Two names that are both right for one effect may stand together: a loop that yields is late and droops.

    Args:
        label: of a case or pair.
        names: of a verdict.
    """
    wanted = accepted(label)
    said = as_effects(names, wanted)
    if len(set(said)) < len(said) or not frozenset().union(*wanted).issuperset(said):
        return False
    orders = permutations(said, len(wanted))
    return any(all(name in right for name, right in zip(order, wanted, strict=True)) for order in orders)


def any_right(label: Mapping[str, Any], names: Iterable[str]) -> bool:
    """Whether one of the names is right for one of the effects.

    Args:
        label: of a case or pair.
        names: of effects and parts.
    """
    wanted = accepted(label)
    return not frozenset().union(*wanted).isdisjoint(as_effects(names, wanted))


def all_held_possible(label: Mapping[str, Any], sets: Iterable[Iterable[str]]) -> bool:
    """Whether each effect has a right name in some set of names that are held possible.

    Args:
        label: of a case or pair.
        sets: names by finding.
    """
    wanted = accepted(label)
    found = frozenset(name for names in sets for name in as_effects(names, wanted))
    return all(not right.isdisjoint(found) for right in wanted)
