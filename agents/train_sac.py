"""Soft actor-critic on a row turn: the sample-efficient arm.

    ./ddagr train sac --config sac_ekf --seed 0 --output runs

Built as ``train_ppo.py``. A step of SAC is dear (networks of three critics' worth of gradients per sample), so that it
sees a tenth of PPO's control steps in the same time.
"""

from __future__ import annotations

from stable_baselines3 import SAC
from stable_baselines3.common.vec_env import VecNormalize

from agents.settings import TrainingSettings


def make_sac(settings: TrainingSettings, environment: VecNormalize, seed: int) -> SAC:
    """Untrained SAC."""
    sac = settings.sac
    return SAC(
        "MlpPolicy",
        environment,
        buffer_size=sac.buffer,
        batch_size=sac.batch,
        learning_starts=sac.start,
        learning_rate=sac.learning_rate,
        gamma=sac.discount,
        tau=sac.smoothing,
        train_freq=1,
        gradient_steps=sac.gradient_steps,
        policy_kwargs={"net_arch": list(sac.hidden)},
        seed=seed,
        device="cpu",
    )
