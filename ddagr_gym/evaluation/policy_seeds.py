"""Names of trained policies in an evaluation: the arm and training seed of each, and the version of its file."""

from __future__ import annotations

import re
from pathlib import Path

from ddagr_gym.recordings.files import sha256_of


def arm_and_seed(name: str) -> tuple[str, int]:
    """Arm and training seed of a policy. All training seeds of one configuration make one arm.

    ``ppo_ekf_seed_3``, ``ppo_ekf_3`` and ``runs/ppo_ekf_seed_3/policy.npz`` are seed 3 of the arm ``ppo_ekf`` if the
    policy's file names 3 as its seed.
    """
    from ddagr_gym.policies.shipped import SUFFIX, find_policy, split_estimate

    stem, _ = split_estimate(name)
    seed = int(find_policy(stem).training.get("seed", 0))
    path = Path(stem)
    label = (path.parent.name if path.stem == "policy" else path.stem) if stem.endswith(SUFFIX) else stem
    found = re.fullmatch(rf"(.+?)[_-](?:seed[_-]?|s)?{seed}", label)
    return (found.group(1) if found else label) + name.removeprefix(stem), seed


def policy_version(name: str) -> str:
    """Hash of a policy's file, followed by the estimate that the policy receives."""
    from ddagr_gym.policies.shipped import policy_file, split_estimate

    stem, _ = split_estimate(name)
    return sha256_of(policy_file(stem)) + name.removeprefix(stem)
