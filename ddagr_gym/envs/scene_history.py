"""What a picture of the running episode needs of its past."""

from __future__ import annotations

import numpy as np

from ddagr_gym.control.circle import running_radius
from ddagr_gym.envs.turn_batch import TurnBatch
from ddagr_gym.physics import layout
from ddagr_gym.rendering.scene import Scene, turn_stage


class SceneHistory:
    """Track and ruts of the first environment of a batch since its reset."""

    def __init__(self, batch: TurnBatch) -> None:
        episode = batch.episodes[0]
        if episode is None:
            raise ValueError("the batch has not been reset")
        self._batch = batch
        self._turn = episode.turn
        self._stage = turn_stage(episode.turn, episode.robot, "soil of this episode")
        self._track: list[tuple[float, float, float]] = []
        self._ruts: list[tuple[float, ...]] = []
        self.append()

    def append(self) -> None:
        """Note the present pose and sinkages."""
        row = self._batch.simulator.rows[0]
        self._track.append((row[layout.X], row[layout.Y], row[layout.YAW]))
        self._ruts.append(tuple(row[layout.SINKAGE : layout.SINKAGE + 4]))

    def scene(self) -> Scene:
        """The present instant."""
        row = self._batch.simulator.rows[0]
        track = np.array(self._track)
        speed, angle, command = (
            tuple(map(float, row[i : i + 2])) for i in (layout.OMEGA, layout.WHEEL_ANGLE, layout.COMMAND)
        )
        slip = tuple(float(v) for v in row[layout.SLIP_RATIO : layout.SLIP_RATIO + 4])
        return Scene(
            stage=self._stage,
            time=float(row[layout.TIME]),
            track=track,
            ruts=np.array(self._ruts),
            wheel_speed=(speed[0], speed[1]),
            command=(command[0], command[1]),
            slip_ratio=(slip[0], slip[1], slip[2], slip[3]),
            wheel_angle=(angle[0], angle[1]),
            radius=running_radius(track[:, 0], track[:, 1], track[:, 2], self._turn.side),
        )
