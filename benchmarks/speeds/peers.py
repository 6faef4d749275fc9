"""Contestants that others wrote: Gymnasium's Ant-v5, and a skid-steer on rigid ground in MuJoCo.

They need ``pip install "gymnasium[mujoco]"`` and are left out, with that reason, without it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from benchmarks.speeds.environments import STEP_SECONDS, play
from benchmarks.speeds.timing import Contestant

MODEL = Path(__file__).with_name("skid_steer.xml")
MAXIMUM_WHEEL_SPEED = 2.0  # [rad/s], the DDAGR's
TIMESTEPS = (0.001, 0.002, 0.005)  # [s]


class RigidSkidSteer(gymnasium.Env[np.ndarray, np.ndarray]):
    """The DDAGR's masses and lengths on rigid ground, 12.5 Hz control, actions as DDAGR-Turn-v0.

    Args:
        timestep: of MuJoCo [s].
    """

    def __init__(self, timestep: float) -> None:
        import mujoco

        self._mujoco: Any = mujoco
        self.model = mujoco.MjModel.from_xml_path(str(MODEL))
        self.model.opt.timestep = timestep
        self.data = mujoco.MjData(self.model)
        self._steps = round(STEP_SECONDS / timestep)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (10,), np.float32)

    def _observe(self) -> np.ndarray:
        return self.data.qvel.astype(np.float32)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, dict]:
        """Put the robot at rest at the origin."""
        super().reset(seed=seed)
        self._mujoco.mj_resetData(self.model, self.data)
        return self._observe(), {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict]:
        """Drive for one control interval; the reward is the distance along x."""
        right, left = MAXIMUM_WHEEL_SPEED * action
        self.data.ctrl[:] = right, left, right, left
        before = float(self.data.qpos[0])
        self._mujoco.mj_step(self.model, self.data, self._steps)
        return self._observe(), float(self.data.qpos[0]) - before, False, False, {}


def missing() -> str | None:
    """Why the peers cannot run here, or None."""
    try:
        import mujoco  # noqa: F401

        gymnasium.make("Ant-v5").close()
    except (ImportError, gymnasium.error.Error) as error:
        return f'peers left out: {error} (pip install "gymnasium[mujoco]").'
    return None


def contestants(actions: np.ndarray, steps: int) -> list[tuple[Contestant, float]]:
    """Peers with their simulated seconds per step; the amount is steps.

    Args:
        actions: (episodes, steps, 2) of the skid-steer.
        steps: in a turn; the skid-steer with short time steps does fewer.
    """
    found = [_ant(steps)]
    for timestep in TIMESTEPS:
        shorter = max(10, int(steps * timestep / TIMESTEPS[-1]))
        found.append((_skid_steer(actions, shorter, timestep), STEP_SECONDS))
    return found


def _skid_steer(actions: np.ndarray, steps: int, timestep: float) -> Contestant:
    checked = gymnasium.wrappers.PassiveEnvChecker(RigidSkidSteer(timestep))
    env = gymnasium.wrappers.OrderEnforcing(checked)

    def run() -> float:
        play(env, actions, steps)
        return float(steps)

    return Contestant(f"MuJoCo skid-steer on rigid ground, {1e3 * timestep:g} ms", run)


def _ant(steps: int) -> tuple[Contestant, float]:
    """Ant-v5 with random actions, resets included, and its simulated seconds per step."""
    env = gymnasium.make("Ant-v5")
    env.reset(seed=1)
    env.action_space.seed(1)
    actions = np.array([[env.action_space.sample() for _ in range(512)] for _ in range(4)])

    def run() -> float:
        play(env, actions, steps)
        return float(steps)

    return Contestant("Ant-v5", run), float(env.unwrapped.dt)  # type: ignore[attr-defined]


def turning_on_rigid_ground(timestep: float = 0.002) -> dict[str, float]:
    """Steady motion of the peer for bank speeds of 0.5 and 1.0 rad/s, to show that it is a skid-steer that turns."""
    env = RigidSkidSteer(timestep)
    env.reset()
    for _ in range(50):
        env.step(np.array([1.0, 0.5]) / MAXIMUM_WHEEL_SPEED)
    speed = float(np.hypot(*env.data.qvel[:2]))
    return {"speed": round(speed, 4), "yaw_rate": round(float(env.data.qvel[5]), 4)}
