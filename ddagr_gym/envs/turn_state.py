"""Everything that a batch of row turns remembers, so that it can go on exactly where it was."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

from ddagr_gym.envs.ekf_features import EkfFeatureBatch
from ddagr_gym.envs.turn_vector_env import TurnVectorEnv
from ddagr_gym.errors import InputError

_SIMULATOR = ("rows", "effect_parameters", "effect_memory", "field_index", "_fields", "_field_geometry")
_BATCH = ("tasks", "readings", "record", "terms", "commands", "_outer_radius")
_ENVIRONMENT = ("_observations", "_rewards", "_steps", "_ended")


def _arrays(owner: object, names: tuple[str, ...]) -> dict[str, Any]:
    return {name: getattr(owner, name).copy() for name in names}


def _filter_arrays(own: EkfFeatureBatch) -> dict[str, Any]:
    return {name: array.copy() for name, array in own.remembered().items()}


def save_state(env: TurnVectorEnv) -> dict[str, Any]:
    """Arrays, episodes and generator states of a batch that has been reset; later steps do not change it."""
    batch = env.batch
    state = {
        "simulator": _arrays(batch.simulator, _SIMULATOR),
        "batch": _arrays(batch, _BATCH),
        "environment": _arrays(env, _ENVIRONMENT),
        "filter": None if batch.features is None else _filter_arrays(batch.features),
        "episodes": list(batch.episodes),
        "seeds": list(env._seeds),
        "generators": [copy.deepcopy(rng.bit_generator.state) for rng in env._rngs],
    }
    if not env._rngs:
        raise InputError("the batch has not been reset: there is no state to save.")
    return state


def restore_state(env: TurnVectorEnv, state: dict[str, Any]) -> None:
    """Put a batch of the same settings and size back to :func:`save_state`; it goes on to the bit.

    Raises:
        InputError: the state is of a batch of another size, or with other features.
    """
    batch = env.batch
    known = () if state["filter"] is None else tuple(state["filter"])
    wanted = () if batch.features is None else tuple(batch.features.remembered())
    if len(state["episodes"]) != batch.count or known != wanted:
        raise InputError(
            f"the state is of {len(state['episodes'])} environments"
            f"{'' if state['filter'] is None else ' with a filter'}: this batch, or its filter, is not alike."
        )
    # grids may have another shape than those of a new batch: assigned, not copied into
    for name, value in state["simulator"].items():
        setattr(batch.simulator, name, value.copy())
    for owner, part in ((batch, "batch"), (env, "environment")):
        for name, value in state[part].items():
            getattr(owner, name)[...] = value
    if batch.features is not None:
        for name, array in batch.features.remembered().items():
            array[...] = state["filter"][name]
    batch.episodes = list(state["episodes"])
    env._seeds = list(state["seeds"])
    env._rngs = [_generator(item) for item in state["generators"]]


def _generator(state: dict[str, Any]) -> np.random.Generator:
    bits = getattr(np.random, state["bit_generator"])()
    bits.state = copy.deepcopy(state)
    return np.random.Generator(bits)
