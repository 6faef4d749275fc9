"""Gymnasium environments: thin adapters over the simulator."""

from __future__ import annotations

from typing import Any

__all__ = ["Episode", "Randomisation", "RewardWeights", "TurnEnv", "TurnSettings", "TurnVectorEnv"]

_HOMES = {
    "Episode": "settings",
    "Randomisation": "settings",
    "RewardWeights": "settings",
    "TurnSettings": "settings",
    "TurnEnv": "turn_env",
    "TurnVectorEnv": "turn_vector_env",
}


def __getattr__(name: str) -> Any:
    # Lazy, so that registering the ids on import of the package compiles nothing.
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
