"""Names of trained policies in an evaluation: the arm and training seed of each, and the version of its file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.files import sha256_of


def arm_and_seed(name: str) -> tuple[str, int]:
    """Arm and training seed of a policy. All training seeds of one configuration make one arm.

    If a policy's file names 3 as its seed, ``ppo_ekf_seed_3`` is seed 3 of the arm ``ppo_ekf``, and so are
    ``runs/ppo_ekf/seed_3/policy.npz`` and ``runs/ppo_ekf_seed_3/policy.npz`` of the arm ``runs/ppo_ekf``: files join
    only those of the same folder, never a published policy of the same name.
    """
    from ddagr_gym.policies.shipped import SUFFIX, find_policy, split_estimate

    stem, _ = split_estimate(name)
    seed = int(find_policy(stem).training.get("seed", 0))
    arm = _arm_of_file(Path(stem).expanduser(), seed) if stem.endswith(SUFFIX) else _without_seed(stem, seed)
    return arm + name.removeprefix(stem), seed


def _arm_of_file(file: Path, seed: int) -> str:
    """Folder and name of the training of a policy's file."""
    place = file.parent if file.stem == "policy" else file.with_suffix("")
    if len(place.parts) < 2:  # its folder would have no name
        place = place.absolute()
    if re.fullmatch(rf"(?:seed[_-]?|s)?{seed}", place.name):
        return place.parent.as_posix()
    return (place.parent / _without_seed(place.name, seed)).as_posix()


def _without_seed(label: str, seed: int) -> str:
    found = re.fullmatch(rf"(.+?)[_-](?:seed[_-]?|s)?{seed}", label)
    return found.group(1) if found else label


def one_arm_each(controllers: Sequence[str]) -> None:
    """Refuse policies that would be the same training seed of the same arm: one of them would be lost.

    Raises:
        InputError: with both names.
    """
    from ddagr_gym.policies.controller import is_policy_name

    known: dict[tuple[str, int], str] = {}
    for name in filter(is_policy_name, controllers):
        other = known.setdefault(arm_and_seed(name), name)
        if other != name:
            raise same_seed(other, name, *arm_and_seed(name))


def same_seed(first: str, second: str, arm: str, seed: int) -> InputError:
    """Error for two controllers that are the same training seed of the same arm."""
    return InputError(
        f"{first!r} and {second!r} are both training seed {seed} of {arm!r}: leave one of them out, or keep the files "
        "of each training in a folder of its own."
    )


def policy_version(name: str) -> str:
    """Hash of a policy's file, followed by the estimate that the policy receives."""
    from ddagr_gym.policies.shipped import policy_file, split_estimate

    stem, _ = split_estimate(name)
    return sha256_of(policy_file(stem)) + name.removeprefix(stem)
