"""Registration of the environments with Gymnasium."""

from __future__ import annotations

TURN_ID = "DDAGR-Turn-v0"
TURN_EKF_ID = "DDAGR-Turn-EKF-v0"
"""The same turn with the filter's estimates in the observation."""


def register_environments() -> None:
    """Register all ids; calling it again changes nothing."""
    import gymnasium

    from ddagr_gym.envs.constants import EPISODE_STEPS

    for name, arguments in ((TURN_ID, {}), (TURN_EKF_ID, {"ekf_features": True})):
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point="ddagr_gym.envs.turn_env:TurnEnv",
                vector_entry_point="ddagr_gym.envs.turn_vector_env:TurnVectorEnv",
                max_episode_steps=EPISODE_STEPS,
                kwargs=arguments,
            )
