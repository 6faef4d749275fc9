"""Trained policies in a campaign: which seeds make one arm, and what a policy's rows were made of."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

_ESTIMATE = "@"
_SUFFIX = ".npz"


def _split(name: str) -> tuple[str, str]:
    """Policy's own name or path, and what follows it: "@" and the estimate that it is told, or nothing."""
    if _ESTIMATE not in name or name.endswith(_SUFFIX):
        return name, ""
    stem, _, estimate = name.rpartition(_ESTIMATE)
    return stem, _ESTIMATE + estimate


def policy_arm(name: str) -> tuple[str, int]:
    """Arm and training seed of a policy: seeds of one training belong to one arm.

    ``ppo_ekf_seed_3``, ``ppo_ekf_3`` and ``runs/ppo_ekf_seed_3/policy.npz`` are run 3 of ``ppo_ekf``, if 3 is the seed
    that the policy's file names.
    """
    from ddagr_gym.policies.shipped import find_policy

    stem, estimate = _split(name)
    seed = int(find_policy(stem).training.get("seed", 0))
    path = Path(stem)
    label = (path.parent.name if path.stem == "policy" else path.stem) if stem.endswith(_SUFFIX) else stem
    found = re.fullmatch(rf"(.+?)[_-](?:seed[_-]?|s)?{seed}", label)
    return (found.group(1) if found else label) + estimate, seed


def policy_version(name: str) -> str:
    """Text that changes when a policy's file or the estimate that it is told does."""
    from ddagr_gym.policies.shipped import policy_file

    stem, estimate = _split(name)
    return hashlib.sha256(policy_file(stem).read_bytes()).hexdigest() + estimate
