"""Checkpoints from which a killed training goes on to the bit: model, normalisation, environments, generators.

A checkpoint is a pickle that this program wrote into its own training folder; never load one from elsewhere. What is
published are the files of :mod:`ddagr_gym.policies.archive`, which hold numbers only.
"""

from __future__ import annotations

import copy
import pickle
import random
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecNormalize

from ddagr_gym.envs.turn_state import restore_state, save_state
from ddagr_gym.errors import InputError
from ddagr_gym.files import atomic_path
from ddagr_gym.wrappers.policy_view import PolicyViewVecEnv

_COUNTERS = ("num_timesteps", "_n_updates", "_current_progress_remaining", "_episode_num")
_LAST = ("_last_obs", "_last_episode_starts", "_last_original_obs")
_NORMALISATION = ("obs_rms", "ret_rms", "returns", "old_obs", "old_reward")


def snapshot(model: BaseAlgorithm, normalise: VecNormalize, extra: dict[str, Any]) -> dict[str, Any]:
    """Everything that the rest of a training depends on; ``extra`` is the caller's."""
    view = _view_of(normalise)
    return {
        "parameters": copy.deepcopy(model.get_parameters()),
        # SAC's temperature is a parameter outside of SB3's get_parameters()
        "temperature": copy.deepcopy(getattr(model, "log_ent_coef", None)),
        "counters": {name: getattr(model, name) for name in _COUNTERS},
        "last": {name: copy.deepcopy(getattr(model, name, None)) for name in _LAST},
        "normalisation": {name: copy.deepcopy(getattr(normalise, name)) for name in _NORMALISATION},
        "view": view.state(),
        "environments": save_state(view.venv.env),
        "generators": (random.getstate(), np.random.get_state(), torch.get_rng_state()),  # noqa: NPY002
        "action_generator": copy.deepcopy(model.action_space.np_random.bit_generator.state),
        "replay_buffer": copy.deepcopy(getattr(model, "replay_buffer", None)),
        "extra": copy.deepcopy(extra),
    }


def resume(model: BaseAlgorithm, normalise: VecNormalize, saved: dict[str, Any]) -> dict[str, Any]:
    """Put a fresh model and its environments back to a :func:`snapshot`; gives back ``extra``."""
    view = _view_of(normalise)
    normalise.reset()  # makes what restoring fills
    model.set_parameters(saved["parameters"])
    if saved["temperature"] is not None:
        model.log_ent_coef.data.copy_(saved["temperature"])  # type: ignore[attr-defined]
    for part in ("counters", "last"):
        for name, value in saved[part].items():
            setattr(model, name, copy.deepcopy(value))
    for name, value in saved["normalisation"].items():
        setattr(normalise, name, copy.deepcopy(value))
    view.restore(saved["view"])
    restore_state(view.venv.env, saved["environments"])
    if saved["replay_buffer"] is not None:
        model.replay_buffer = saved["replay_buffer"]  # type: ignore[attr-defined]
    python, numpy_state, torch_state = saved["generators"]
    random.setstate(python)
    np.random.set_state(numpy_state)  # noqa: NPY002
    torch.set_rng_state(torch_state)
    model.action_space.np_random.bit_generator.state = saved["action_generator"]
    extra: dict[str, Any] = copy.deepcopy(saved["extra"])
    return extra


def _view_of(normalise: VecNormalize) -> PolicyViewVecEnv:
    venv: Any = normalise.venv
    while not isinstance(venv, PolicyViewVecEnv):
        venv = venv.venv
    return venv


def write_checkpoint(path: Path, digest: str, saved: dict[str, Any]) -> None:
    """Write whole or not at all; ``digest`` is that of the settings."""
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        pickle.dump({"digest": digest, **saved}, file, protocol=pickle.HIGHEST_PROTOCOL)


def read_checkpoint(path: Path, digest: str) -> dict[str, Any] | None:
    """A checkpoint of this program, or None where there is none.

    Raises:
        InputError: of a training with other settings, or damaged.
    """
    if not path.is_file():
        return None
    try:
        with path.open("rb") as file:
            saved: dict[str, Any] = pickle.load(file)
    except (pickle.UnpicklingError, EOFError, AttributeError) as error:
        raise InputError(f"{path} is not a checkpoint ({error}): remove it to train from the start.") from None
    if saved["digest"] != digest:
        raise InputError(f"{path} is of a training with other settings: choose another folder, or remove it.")
    return saved
