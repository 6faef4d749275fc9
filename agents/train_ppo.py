"""Proximal policy optimisation of a row turn.

    ./ddagr train ppo --config ppo_ekf --seed 0 --output runs

From top to bottom: read the settings, build the batch of environments as the policy sees it, give it to
Stable-Baselines3's PPO, train with checkpoints, and write the policy as plain numbers. Started again after a kill, it
goes on from the last checkpoint and ends with the same bits.
"""

from __future__ import annotations

import math

from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from agents.asymmetric import AsymmetricPolicy
from agents.settings import TrainingSettings


def make_ppo(settings: TrainingSettings, environment: VecNormalize, seed: int) -> PPO:
    """Untrained PPO; its first outputs are near zero, that is, the feed-forward alone."""
    ppo = settings.ppo
    return PPO(
        AsymmetricPolicy,
        environment,
        n_steps=ppo.rollout,
        batch_size=ppo.batch,
        n_epochs=ppo.epochs,
        learning_rate=lambda remaining: ppo.learning_rate * max(remaining, 0.05),
        gamma=ppo.discount,
        gae_lambda=ppo.trace,
        clip_range=ppo.clip,
        ent_coef=ppo.entropy,
        policy_kwargs={
            "net_arch": {"pi": list(ppo.hidden), "vf": list(ppo.hidden)},
            "log_std_init": math.log(ppo.initial_deviation),
        },
        seed=seed,
        device="cpu",
    )
