"""A written MuJoCo model, driven as our simulator was."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.exporting.chassis import WHEELS
from ddagr_gym.exporting.comparison import Motion
from ddagr_gym.exporting.working_point import AVERAGED, RATE, SETTLING
from ddagr_gym.parameters import STANDARD_GRAVITY

Array = NDArray[np.float64]

_LANDING = 1.0
"""Time that the robot gets to settle on its wheels before it is driven [s]."""


def drive_mujoco(text: str, commands: Array) -> Motion:
    """Drive a model from rest at constant commands; means as :func:`~ddagr_gym.exporting.working_point.steady_drives`.

    Args:
        text: MJCF of :mod:`~ddagr_gym.exporting.mujoco_model`.
        commands: (K, 2) right and left bank speed commands [rad/s].
    """
    import mujoco

    model = mujoco.MjModel.from_xml_string(text)
    # the drives that it is compared with are on level ground too
    model.opt.gravity[:] = (0.0, 0.0, -STANDARD_GRAVITY)
    records = np.array([_drive(mujoco, model, command) for command in commands])
    means = records[:, -round(RATE * AVERAGED) :].mean(axis=1)
    paths = records[:, :, 3:] - records[:, :1, 3:]
    return Motion(means[:, 0], means[:, 1], records[0, :, 2], paths)


def _drive(mujoco: Any, model: Any, command: Array) -> Array:
    """(T, 5) speed, yaw rate, mean wheel speed and position, from the command on."""
    data = mujoco.MjData(model)
    each = round(1.0 / (RATE * model.opt.timestep))
    mujoco.mj_step(model, data, nstep=round(_LANDING / model.opt.timestep))
    data.ctrl[:] = command[[0 if left < 0 else 1 for _, _, left in WHEELS]]
    rows = []
    for _ in range(round(RATE * (SETTLING + AVERAGED))):
        mujoco.mj_step(model, data, nstep=each)
        heading = 2.0 * np.arctan2(data.qpos[6], data.qpos[3])
        along = np.cos(heading) * data.qvel[0] + np.sin(heading) * data.qvel[1]
        rows.append((along, data.qvel[5], data.qvel[6:10].mean(), *data.qpos[:2]))
    return np.array(rows)
