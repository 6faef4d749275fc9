"""From a Stable-Baselines3 model to a policy of plain numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecNormalize

from agents.settings import TrainingSettings
from ddagr_gym.policies.archive import Policy
from ddagr_gym.version import __version__


def actor_of(model: BaseAlgorithm) -> torch.nn.Sequential:
    """Layers from normalised inputs to the mean outputs, without exploration."""
    policy: Any = model.policy
    if hasattr(policy, "mlp_extractor"):
        return torch.nn.Sequential(*policy.mlp_extractor.policy_net, policy.action_net)
    return torch.nn.Sequential(*policy.actor.latent_pi, policy.actor.mu, torch.nn.Tanh())


def archive_of(model: BaseAlgorithm, normalise: VecNormalize, settings: TrainingSettings, seed: int) -> Policy:
    """The policy of a model with the statistics that its inputs are normalised by, now frozen."""
    layers = [layer for layer in actor_of(model) if isinstance(layer, torch.nn.Linear)]
    statistics: Any = normalise.obs_rms
    seen = slice(len(settings.design.inputs))  # what follows is the critic's
    hidden: Any = next(layer for layer in actor_of(model) if not isinstance(layer, torch.nn.Linear))
    return Policy(
        design=settings.design,
        weights=tuple(layer.weight.detach().numpy().astype(np.float32) for layer in layers),
        biases=tuple(layer.bias.detach().numpy().astype(np.float32) for layer in layers),
        mean=np.array(statistics.mean[seen], dtype=np.float64),
        deviation=np.sqrt(np.asarray(statistics.var[seen], dtype=np.float64) + normalise.epsilon),
        clip=float(normalise.clip_obs),
        activation="relu" if isinstance(hidden, torch.nn.ReLU) else "tanh",
        squashed=not hasattr(model.policy, "mlp_extractor"),
        training={
            "algorithm": settings.algorithm,
            "seed": seed,
            "steps": model.num_timesteps,
            "digest": settings.digest(),
            "version": __version__,
        },
    )
