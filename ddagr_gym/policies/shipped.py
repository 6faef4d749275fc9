"""The trained policies that come with the package, and policies from files, by name."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.files import shipped_folder
from ddagr_gym.policies.archive import Policy, load_policy
from ddagr_gym.recordings.files import sha256_of

SUFFIX, SEPARATOR = ".npz", "@"
"""Of policies' files, and between a policy's name and the estimate that it receives."""


def policies_dir() -> Path:
    """Folder of the trained policies: ``agents/policies`` of the checkout, else the installed package's."""
    return shipped_folder("policies")


def policy_files() -> dict[str, Path]:
    """Trained policies by name: the selected one of each arm, and every seed, as ``ppo_ekf_seed_3``."""
    folder = policies_dir()
    selected = {file.parent.name: file for file in sorted(folder.glob(f"*/policy{SUFFIX}"))}
    seeds = {f"{file.parents[1].name}_{file.stem}": file for file in sorted(folder.glob(f"*/seeds/seed_*{SUFFIX}"))}
    return selected | seeds


def policy_names() -> tuple[str, ...]:
    """Names of :func:`policy_files`."""
    return tuple(policy_files())


def selected_policies() -> tuple[str, ...]:
    """Names of the selected policy of each arm, without the seeds'."""
    return tuple(name for name, file in policy_files().items() if file.stem == "policy")


def policy_file(name: str) -> Path:
    """File of a trained policy by name, or a path that ends in ``.npz``.

    Raises:
        InputError: no such policy, with the closest names.
    """
    if name.endswith(SUFFIX):
        path = Path(name).expanduser()
        if not path.is_file():
            raise InputError(f"{path}: no such policy file.")
        return path
    files = policy_files()
    if name not in files:
        raise unknown_name("policy", name, files)
    return files[name]


def split_estimate(name: str) -> tuple[str, str]:
    """A policy's name or path, and the estimate that it receives; "live" where none is named."""
    if SEPARATOR not in name or name.endswith(SUFFIX):
        return name, "live"
    stem, _, estimate = name.rpartition(SEPARATOR)
    return stem, estimate


def find_policy(name: str) -> Policy:
    """A trained policy by name or path, read again once its file has changed."""
    file = policy_file(name)
    return _load(file.resolve(), sha256_of(file))


@lru_cache(maxsize=32)
def _load(file: Path, version: str) -> Policy:
    return load_policy(file)
