"""The row-turn environment, ``DDAGR-Turn-v0``."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from ddagr_gym.envs import turn_kernel as kernel
from ddagr_gym.envs.options import action_space, check_info_level, check_mode, settings_from
from ddagr_gym.envs.scene_history import SceneHistory
from ddagr_gym.envs.settings import Episode
from ddagr_gym.envs.turn_batch import TurnBatch, check_action
from ddagr_gym.envs.turn_info import batch_info, single_info


class TurnEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """A skid-steer robot leaves a strawberry row, turns through 180 degrees and enters the next one.

    ## Task
    The robot (168 kg, Table 6.1 of the thesis) stands at (-run_in, 0) facing +x; the rows lie at x < 0. It drives
    straight to the headland boundary x = 0, turns about (0, +-R*) and leaves along y = +-2 R* to x = -run_out. The
    soil under every wheel is the full terramechanic model on a soil drawn at each reset. 25 s at 12.5 Hz control;
    each step is ten sensor samples of 8 ms.

    ## Action
    ``Box(-1, 1, (2,), float32)``: right and left bank speed command, in units of the robot's
    ``maximum_wheel_speed`` (DDAGR: 2.0 rad/s, 0.56 m/s). Values beyond the box are clipped; a wrong shape or a
    value that is not finite is an error.

    ## Observation
    ``Box(-10, 10, (12,), float32)``, what a robot without a receiver knows:

    ===  ==================  ========  ============  ==========================================================
    No.  entry               unit      observed as 1  meaning
    ===  ==================  ========  ============  ==========================================================
    0    specific_force_x    m/s^2     1.0           accelerometer, mean over the step
    1    specific_force_y    m/s^2     1.0           the same, to the left
    2    yaw_rate            rad/s     0.5           gyro, mean over the step
    3    encoder_right       rad/s     2.0           right bank, mean over the step
    4    encoder_left        rad/s     2.0           left bank
    5    last_action_right   -         1.0           action of this step
    6    last_action_left    -         1.0
    7    side                -         1.0           +1 left turn, -1 right turn
    8    target_radius       m         1.0           R*
    9    target_speed        m/s       0.25          reference speed
    10   heading_to_go       rad       pi            heading change left, from the integrated gyro
    11   run_in_to_go        m         1.0           distance left before the turn: encoders, nominal tyre
    ===  ==================  ========  ============  ==========================================================

    ``ekf_features=True``, or the id ``DDAGR-Turn-EKF-v0``, appends the twelve entries of
    :data:`ddagr_gym.control.observation.EKF_FEATURES`: what the filter makes of the raw samples. ``filter="inertial"``
    takes the inertial filter, which knows slopes, instead of the one that takes the ground for level, and
    ``filter="learned"`` that filter with its velocities corrected by a trained network. With ``filter="inertial"``,
    ``path_features=True`` appends the ten entries of :data:`ddagr_gym.control.observation.PATH_FEATURES`: the estimated
    pose, and its errors on the commanded path.

    ## Reward
    Weighted sum of named terms, :data:`ddagr_gym.envs.turn_kernel.TERMS`; weights by ``reward=RewardWeights(...)``.
    It uses the true state and serves training only.

    ## Endings
    ====  ====================  ===========  ==========================================================
    No.   ending                kind         when
    ====  ====================  ===========  ==========================================================
    1     exit reached          termination  the centre passes x = -run_out in the next row's corridor
    2     bogged                termination  no sinkage carries a wheel's load
    3     left the headland     termination  on a bed, beyond 3 m of headland, or 1.5 m beside the rows
    4     time                  truncation   25 s, by ``max_episode_steps``; ``info["ending"]`` stays 0
    ====  ====================  ===========  ==========================================================

    ## Info
    See :func:`ddagr_gym.envs.turn_info.batch_info`; ``info_level="full"`` adds the raw 125 Hz block, the true
    state and the reward's terms.

    ## Arguments
    ``robot, soil, radius, side, run_in, run_out, speed, sensors, randomisation, reward, effects, numerics,
    ekf_features, filter, path_features, calibration, ground`` as in
    :func:`ddagr_gym.envs.options.make_settings`; ``render_mode``, ``info_level``. ``reset(options={"episode": e})``
    repeats a given :class:`Episode`; ``env.unwrapped.episode`` is the present one.

    ## Versions
    v0: first.
    """

    metadata: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 12.5}  # noqa: RUF012

    def __init__(self, render_mode: str | None = None, info_level: str = "small", **settings: Any) -> None:
        self.render_mode = check_mode(render_mode, self.metadata["render_modes"])
        self.info_level = check_info_level(info_level)
        self.settings = settings_from(settings)
        self.action_space = action_space()  # type: ignore[assignment]
        self.batch = TurnBatch(self.settings)
        self.observation_space = self.batch.observation_space
        self._rewards = np.zeros(1)
        self._history: SceneHistory | None = None
        self._renderer: Any = None

    @property
    def episode(self) -> Episode | None:
        """What is being driven, None before the first reset."""
        return self.batch.episodes[0]

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode; ``options={"episode": Episode}`` repeats one."""
        super().reset(seed=seed)
        self.batch.reset([0], [self.np_random], options)
        observations = self.batch.new_observations()
        self.batch.observe_start([0], observations)
        self._history = None if self.render_mode is None else SceneHistory(self.batch)
        if self.render_mode == "human":
            self._draw()
        return observations[0], single_info(batch_info(self.batch, self.info_level))

    def step(self, action: NDArray[np.float32]) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Drive for one control interval.

        Raises:
            InputError: action of the wrong shape or not finite.
            gymnasium.error.ResetNeeded: before the first reset.
        """
        if self.episode is None:
            raise gymnasium.error.ResetNeeded("call reset() before step().")
        actions = check_action(action, (2,))[None]
        observations = self.batch.new_observations()
        self.batch.step(actions, [self.np_random], self._rewards, observations)
        terminated = bool(self.batch.tasks[0, kernel.ENDING] != kernel.NO_ENDING)
        if self._history is not None:
            self._history.append()
        if self.render_mode == "human":
            self._draw()
        info = single_info(batch_info(self.batch, self.info_level))
        return observations[0], float(self._rewards[0]), terminated, False, info

    def _draw(self) -> NDArray[np.uint8]:
        if self._renderer is None:
            from ddagr_gym.rendering.render import SceneRenderer

            mode: Any = self.render_mode
            self._renderer = SceneRenderer(mode=mode, frame_rate=self.metadata["render_fps"])
        if self._history is None:
            raise gymnasium.error.ResetNeeded("call reset() before render().")
        frame: NDArray[np.uint8] = self._renderer.draw(self._history.scene())
        return frame

    def render(self) -> NDArray[np.uint8] | None:
        """Picture (H, W, 3) of the field from above in mode "rgb_array"; None in "human", which draws by itself."""
        if self.render_mode is None:
            gymnasium.logger.warn('render() without render_mode: use gym.make(..., render_mode="rgb_array").')
            return None
        return self._draw() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Release the window; may be called again."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None
