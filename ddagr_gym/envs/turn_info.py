"""What ``info`` holds: little by default, because wrappers copy it at every step; everything on request."""

from __future__ import annotations

from typing import Any

import numpy as np

from ddagr_gym.envs import turn_kernel as kernel
from ddagr_gym.envs.turn_batch import SAMPLE_CHANNELS, TurnBatch
from ddagr_gym.physics import layout

_STATE = {
    "true_x": layout.X,
    "true_y": layout.Y,
    "true_yaw": layout.YAW,
    "true_v_x": layout.V_X,
    "true_v_y": layout.V_Y,
    "true_yaw_rate": layout.YAW_RATE,
    "true_omega_right": layout.OMEGA,
    "true_omega_left": layout.OMEGA + 1,
}


def batch_info(batch: TurnBatch, level: str) -> dict[str, Any]:
    """Info of all environments as arrays with a leading dimension N; always new arrays.

    small: ``ending`` (0 running, 1 exit reached, 2 bogged, 3 left the headland), ``success``,
    ``exit_lateral_error`` [m], ``exit_heading_error`` [rad] (0 before the exit).
    full: besides, the true state, ``true_sinkage`` (4,), ``true_slip_ratio`` (4,), ``true_soil`` (36,),
    ``samples`` (CONTROL_INTERVAL, 5) raw 125 Hz block, ``command`` (2,), ``reward_<term>`` unweighted.
    """
    tasks = batch.tasks
    info: dict[str, Any] = {
        "ending": batch.endings,
        "success": tasks[:, kernel.SUCCESS] > 0.0,
        "exit_lateral_error": tasks[:, kernel.EXIT_LATERAL].copy(),
        "exit_heading_error": tasks[:, kernel.EXIT_HEADING].copy(),
    }
    if level == "full":
        rows = batch.simulator.rows
        info |= {name: rows[:, index].copy() for name, index in _STATE.items()}
        info["true_sinkage"] = rows[:, layout.SINKAGE : layout.SINKAGE + 4].copy()
        info["true_slip_ratio"] = rows[:, layout.SLIP_RATIO : layout.SLIP_RATIO + 4].copy()
        info["true_soil"] = rows[:, layout.SOIL : layout.SOIL + 36].copy()
        info["samples"] = batch.readings[:, :, : len(SAMPLE_CHANNELS)].copy()
        info["command"] = batch.commands.copy()
        info |= {f"reward_{name}": batch.terms[:, j].copy() for j, name in enumerate(kernel.TERMS)}
    return info


def single_info(info: dict[str, Any]) -> dict[str, Any]:
    """The first environment's info with plain Python scalars."""
    return {key: value[0].item() if value.ndim == 1 else np.array(value[0]) for key, value in info.items()}
