"""Registration of the environments with Gymnasium."""

from __future__ import annotations

TURN_ID = "DDAGR-Turn-v0"


def register_environments() -> None:
    """Register all ids; calling it again changes nothing."""
    import gymnasium

    from ddagr_gym.envs.constants import EPISODE_STEPS

    if TURN_ID not in gymnasium.registry:
        gymnasium.register(
            TURN_ID,
            entry_point="ddagr_gym.envs.turn_env:TurnEnv",
            vector_entry_point="ddagr_gym.envs.turn_vector_env:TurnVectorEnv",
            max_episode_steps=EPISODE_STEPS,
        )
