"""Is the filter as good as it says where its model is right? Monte Carlo over drives of its own model."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.errors import unknown_name
from ddagr_gym.estimation import (
    BLOCKS,
    CHANNELS,
    FilterModel,
    FilterRun,
    SoilPrior,
    channel_statistics,
    chi_square_band,
    draw_drive,
    normalised_estimation_error,
    run_filter,
)
from ddagr_gym.estimation.layout import COMMANDS, ENCODER_CHANNEL, OMEGA, PARAMETER
from ddagr_gym.evaluation.controllers import nominal_constants
from ddagr_gym.parameters import Robot, Sensors, WheelEncoder

Array = NDArray[np.float64]

INTERVAL = 1.0
"""Time between the instants at which errors are judged [s]."""
PROBABILITY = 0.95


KNOWN_SOIL = 0.15
"""Deviation of the logs of the force law's parameters where the soil is known roughly."""
MOST_RESISTANCE = 0.5
"""Motion resistance over traction limit from which the force law's robot is stuck; such soils are drawn again."""
PRIORS = ("soil_known_to_15_percent", "default_prior")


def matched_model(robot: Robot, sensors: Sensors, prior: str) -> FilterModel:
    """Filter of a robot that is known to stand at the start, with one of PRIORS.

    Raises:
        InputError: another prior.
    """
    if prior not in PRIORS:
        raise unknown_name("prior", prior, PRIORS)
    still = dict.fromkeys(("velocity_deviation", "yaw_rate_deviation", "bank_speed_deviation"), 0.0)
    model = FilterModel.of(robot, sensors, **still)
    if prior == "default_prior":
        return model
    names = ("traction_limit_deviation", "traction_rate_deviation", "resistance_deviation")
    known = dict.fromkeys(names, KNOWN_SOIL)
    return replace(model, prior=SoilPrior(**known))


def row_turn_commands(side: str, radius: float, period: float) -> Array:
    """(T, 2) right and left bank speeds [rad/s]: the ladder's constant speeds through a row turn.

    Args:
        side: "left" or "right".
        radius: of the turn [m].
        period: between samples [s].
    """
    turn = RowTurn(radius=radius, side=side)
    constants = nominal_constants(turn)
    lengths = (2.0 * turn.run_in, math.pi * turn.radius, 2.0 * turn.run_out)
    counts = [round(length / turn.speed / period) for length in lengths]
    bend = (constants.outer, constants.inner) if side == "left" else (constants.inner, constants.outer)
    straight = (constants.straight, constants.straight)
    return np.repeat(np.array([straight, bend, straight], dtype=np.float64), counts, axis=0)


def matched_drive(
    model: FilterModel, commands: ArrayLike, encoder: WheelEncoder, rng: np.random.Generator
) -> dict[str, Any]:
    """One drive of the filter's own model, filtered twice: with Gaussian readings, and with encoders that count.

    The noise of a counted speed is neither Gaussian nor independent, and of the assumed size only on average over
    speeds. Errors are judged with Gaussian readings, for which a band can be computed.

    Args:
        model: of drive and filter.
        commands: (T, 2) right and left [rad/s].
        encoder: its counts; 0 leaves the Gaussian noise.
        rng: of initial state, soil and noise.

    Returns:
        ``nees``: by block of the state, the normalised error squared over its degrees of freedom at each instant;
        ``nis``: by channel, its mean over the drive; ``nis_counted``: with encoders that count.
    """
    drive = np.asarray(commands, dtype=np.float64)
    states, readings = draw_drive(model, drive, rng, _moving_soil(model, rng))
    run = _filtered(model, drive, readings)
    rows = instants(len(drive), model.sample_period)
    errors, covariances = (states - run.states)[rows], run.covariances[rows]
    nees = {name: normalised_estimation_error(errors, covariances, name).tolist() for name in BLOCKS}
    if encoder.counts_per_revolution > 0:
        speeds = states[:, OMEGA : OMEGA + 2]
        readings[:, ENCODER_CHANNEL : ENCODER_CHANNEL + 2] = counted(speeds, encoder, model.sample_period, rng)
    return {"nees": nees, "nis": _nis(run), "nis_counted": _nis(_filtered(model, drive, readings))}


def _filtered(model: FilterModel, drive: Array, readings: Array) -> FilterRun:
    columns = {"t": model.sample_period * np.arange(1.0, len(drive) + 1.0)}
    columns |= dict(zip((*COMMANDS, *CHANNELS), np.column_stack([drive, readings]).T, strict=True))
    return run_filter(model, columns)


def _nis(run: FilterRun) -> dict[str, float]:
    return {name: found.nis for name, found in channel_statistics(run.standardised, lags=1).items()}


def _moving_soil(model: FilterModel, rng: np.random.Generator) -> Array:
    """Initial state from the prior, drawn again while the robot would be stuck."""
    mean, covariance = model.initial()
    while True:
        state = rng.multivariate_normal(mean, covariance)
        if state[PARAMETER + 3] - state[PARAMETER] < math.log(MOST_RESISTANCE):
            return np.asarray(state)


def counted(speeds: Array, encoder: WheelEncoder, period: float, rng: np.random.Generator) -> Array:
    """What an encoder of so many counts reads of true speeds (T, 2) [rad/s]: whole counts in each period."""
    step = 2.0 * math.pi / encoder.counts_per_revolution
    turned = np.concatenate([np.zeros((1, speeds.shape[1])), np.cumsum(speeds, axis=0) * period])
    counts = np.diff(np.floor(turned / step + rng.uniform(size=(1, speeds.shape[1]))), axis=0)
    return np.asarray(counts * step / period)


def instants(samples: int, period: float) -> NDArray[np.int64]:
    """Rows at which errors are judged."""
    step = round(INTERVAL / period)
    return np.arange(step - 1, samples, step)


def nees_table(drives: list[dict[str, Any]]) -> dict[str, Any]:
    """By block: mean over drives and instants, the chi-square band of one instant's mean, and how many keep it.

    Wider turns last longer; instants are those that all drives have.

    Drives are independent, so the mean over drives at one instant times drives and degrees of freedom is a chi-square
    value for a consistent Gaussian filter; means over time are not, their errors hang together.
    """
    table = {}
    for name, chosen in BLOCKS.items():
        shortest = min(len(drive["nees"][name]) for drive in drives)
        values = np.array([drive["nees"][name][:shortest] for drive in drives])
        band = chi_square_band(chosen.stop - chosen.start, len(drives), PROBABILITY)
        means = values.mean(axis=0)
        table[name] = {
            "mean": float(means.mean()),
            "median_drive": float(np.median(values.mean(axis=1))),
            "lowest": float(means.min()),
            "highest": float(means.max()),
            "band": list(band),
            "share_of_instants_inside": float(band.contains(means).mean()),
            "by_instant": means.tolist(),
        }
    return table


def nis_bands(drives: list[dict[str, Any]]) -> dict[str, Any]:
    """By channel: the mean NIS of matched drives and the range that holds 95 % of single drives.

    A gain that is de-weighted on purpose leaves innovations that hang together, so that the mean square over a drive
    scatters more than the chi-square value of as many degrees of freedom as samples; the range is therefore found by
    simulation of the very same filter.
    """
    table = {}
    for name in CHANNELS:
        values = np.array([drive["nis_counted"][name] for drive in drives])
        low, high = np.quantile(values, [0.5 * (1.0 - PROBABILITY), 0.5 * (1.0 + PROBABILITY)])
        gaussian = float(np.mean([drive["nis"][name] for drive in drives]))
        table[name] = {"mean_gaussian": gaussian, "mean": float(values.mean()), "band": [float(low), float(high)]}
    return table
