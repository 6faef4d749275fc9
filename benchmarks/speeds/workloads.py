"""What is driven: the same row turn by three kinds of driver.

row_turn
    The actions of the controller that rolls without slip on a nominal turn, played back: a start from rest, a straight
    and a steady arc. Cheap steps, since the motion changes slowly.
trained_policy
    The same with Gaussian noise of 0.15 (0.3 rad/s) on each action: a policy late in training.
untrained_policy
    Noise of 1 instead, clipped to the action space, on no signal: a policy before training (the default of most
    libraries). Wheels reverse every few steps, the robot creeps; the dearest steps there are.
"""

from __future__ import annotations

import numpy as np

TRAINED_NOISE = 0.15
UNTRAINED_NOISE = 1.0
EPISODES = 8  # different draws of the noise
WORKLOADS = ("row_turn", "trained_policy", "untrained_policy")


def action_tables(seed: int = 0) -> dict[str, np.ndarray]:
    """Actions (EPISODES, steps, 2), float32 in [-1, 1], by workload."""
    turn = _row_turn()
    noise = np.random.default_rng(seed).standard_normal((EPISODES, *turn.shape))
    tables = {
        "row_turn": np.broadcast_to(turn, noise.shape),
        "trained_policy": turn + TRAINED_NOISE * noise,
        "untrained_policy": UNTRAINED_NOISE * noise,
    }
    return {name: np.clip(table, -1.0, 1.0).astype(np.float32) for name, table in tables.items()}


def _row_turn() -> np.ndarray:
    import gymnasium

    from ddagr_gym.control.rolling import RollingWithoutSlip
    from ddagr_gym.envs.constants import EPISODE_STEPS
    from ddagr_gym.presets import get_robot

    env = gymnasium.make("ddagr_gym:DDAGR-Turn-v0", soil="thesis_a1", randomisation=False, side="left")
    controller = RollingWithoutSlip(get_robot("ddagr"))
    observation, _ = env.reset(seed=0)
    actions = []
    for _ in range(EPISODE_STEPS):
        actions.append(controller(observation))
        observation, _, terminated, truncated, _ = env.step(actions[-1])
        if terminated or truncated:
            break
    env.close()
    # drive on where the nominal turn has ended: other soils are slower
    return np.array(actions + [actions[-1]] * (EPISODE_STEPS - len(actions)))
