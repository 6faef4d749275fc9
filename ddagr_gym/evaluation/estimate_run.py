"""The filter over one recording, made ready for tables and figures; the thesis's two runs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.control.manoeuvres import find_manoeuvre
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import (
    CHANNELS,
    STATE,
    THESIS_STATE,
    FilterModel,
    FilterRun,
    ForceLaw,
    ThesisModel,
    channel_statistics,
    estimates,
    run_thesis_filter,
)
from ddagr_gym.evaluation.force_law_fits import LAUNCH, LawFit, drive_law_fit, fit_to_soil
from ddagr_gym.evaluation.recording_filter import FilterSetUp, filter_recording, set_up_filter
from ddagr_gym.evaluation.thesis_runs import thesis_run
from ddagr_gym.identification.recording_noise import recording_noise
from ddagr_gym.parameters import Robot, Sensors, Soil
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate

Array = NDArray[np.float64]

PARAMETERS = ("traction_limit", "traction_rate", "lateral_stiffness", "motion_resistance")
"""a1 [N], a2 [-], b [N/rad], Rc [N]."""
TRUTH = ("true_v_x", "true_v_y", "true_yaw_rate", "true_omega_right", "true_omega_left")
_TRUTH_NEEDED = (*TRUTH, *(f"true_force_{axis}_{wheel}" for axis in "xy" for wheel in (1, 2, 3, 4)))
_TURNING = 0.02  # [rad/s], above which a radius is judged


@dataclass(frozen=True, eq=False)
class EstimatedRun:
    """A recording as a filter saw it.

    Attributes:
        recording: the drive.
        robot: as the filter knows it.
        run: states and covariances of the rows.
        model: of our filter; None for the thesis's.
        uses_commands: whether the filter used the commands.
        law_fit: parameters that the true forces fit best, None where unknown.
        title: of the run.
    """

    recording: Recording
    robot: Robot
    run: FilterRun
    model: FilterModel | None
    uses_commands: bool
    law_fit: LawFit | None
    title: str

    @property
    def parameters(self) -> tuple[Array, Array]:
        """Values (T, n) of a1, a2, b and in our filter Rc, and standard deviations (T, n) of their logs."""
        states, deviations = self.run.states, self.run.deviations
        if self.model is None:
            return states[:, 5:8], deviations[:, 5:8] / states[:, 5:8]
        return np.exp(states[:, 5:9]), deviations[:, 5:9]

    @property
    def truth(self) -> dict[str, Array]:
        """True columns by state name, where the recording has them."""
        extras = self.recording.extras
        return {name[len("true_") :]: extras[name] for name in TRUTH if name in extras}


def simulate_thesis_run(name: str, soil_name: str, seed: int) -> tuple[Recording, Robot]:
    """Recording and robot of one of the thesis's runs; ``soil_name`` "" takes the run's own."""
    plan = thesis_run(name)
    robot = replace(get_robot("ddagr"), motor_rate=plan.motor_rate)
    sensors = Sensors()
    commands = find_manoeuvre(plan.manoeuvre).commands(1.0 / sensors.period)
    columns = simulate(robot, get_soil(soil_name or plan.soil), commands, sensors=sensors, seed=seed)
    return Recording.from_columns(columns, robot), robot


def estimate_thesis_run(name: str, soil_name: str, estimator: str, law: ForceLaw, seed: int) -> EstimatedRun:
    """One of the thesis's runs, driven in the simulator and filtered with the sensors' data sheets."""
    recording, robot = simulate_thesis_run(name, soil_name, seed)
    set_up = FilterSetUp(FilterModel.of(robot, Sensors(), law=law))
    title = thesis_run(name).title if not soil_name else f"thesis Table {name}, simulated on {soil_name}"
    return _estimate(recording, robot, set_up, estimator, None, title)


def estimate_recording(
    recording: Recording, robot: Robot, soil: Soil | None, estimator: str, law: ForceLaw, attitude: bool, seed: int
) -> EstimatedRun:
    """A recording, filtered with the noise that it shows itself; ``soil`` tells the parameters to expect."""
    if not len(recording):
        raise InputError(f"{recording.meta.source} has no rows: the filter needs a drive.")
    noise = recording_noise(recording, np.random.default_rng(seed))
    set_up = set_up_filter(robot, [recording], [noise], attitude=attitude, law=law)
    return _estimate(recording, robot, set_up, estimator, soil, recording.meta.source)


def _estimate(
    recording: Recording, robot: Robot, set_up: FilterSetUp, estimator: str, soil: Soil | None, title: str
) -> EstimatedRun:
    if estimator == "thesis":
        expected = _expected(recording, robot, soil, ForceLaw.thesis)
        title = f"{title}: the thesis's filter"
        return EstimatedRun(recording, robot, _thesis_filter(recording, robot), None, True, expected, title)
    run, expected = filter_recording(set_up, recording), _expected(recording, robot, soil, set_up.model.law)
    return EstimatedRun(recording, robot, run, set_up.model, set_up.use_commands, expected, title)


def _thesis_filter(recording: Recording, robot: Robot) -> FilterRun:
    if not recording.has("command_right", "command_left"):
        raise InputError(f"{recording.meta.source} has no commands: the thesis's filter needs them.")
    if len(recording.meta.spans) > 1:
        raise InputError(
            f"{recording.meta.source} has {len(recording.meta.spans)} spans: the thesis's filter knows one drive from "
            "rest; leave --filter out."
        )
    columns = recording.columns() | dict(zip(("command_right", "command_left"), recording.held_commands(), strict=True))
    return run_thesis_filter(ThesisModel(robot, sample_period=recording.period), columns)


def _expected(recording: Recording, robot: Robot, soil: Soil | None, law: ForceLaw) -> LawFit | None:
    """Parameters by the true forces of the drive, or by those of a soil under wheels in turns."""
    if all(name in recording.extras for name in _TRUTH_NEEDED):
        return drive_law_fit(robot, recording.columns(), law)
    if soil is None:
        return None
    return fit_to_soil(law, robot, soil)


def dead_reckoned(estimated: EstimatedRun) -> dict[str, Array]:
    """Paths (T, 2) [m]: "estimated" from the filter's speeds, and "true" or "measured" where there is one.

    Each span starts at its first known position and heading, else at the origin.
    """
    recording, states = estimated.recording, estimated.run.states
    known = {axis: _pose(recording, axis) for axis in ("x", "y", "yaw")}
    path = np.zeros((len(recording), 2))
    for span in recording.spans():
        x, y, yaw = (_first(known[axis], span) for axis in ("x", "y", "yaw"))
        steps = np.diff(recording.t[span], prepend=recording.t[span][0])
        v_x, v_y, turning = states[span, 0], states[span, 1], states[span, 2]
        heading = yaw + np.cumsum(turning * steps)
        path[span, 0] = x + np.cumsum((v_x * np.cos(heading) - v_y * np.sin(heading)) * steps)
        path[span, 1] = y + np.cumsum((v_x * np.sin(heading) + v_y * np.cos(heading)) * steps)
    paths = {"estimated": path}
    if known["x"] is not None and known["y"] is not None:
        name = "true" if "true_x" in recording.extras else "measured"
        paths = {name: np.column_stack([known["x"], known["y"]])} | paths
    return paths


def _pose(recording: Recording, axis: str) -> Array | None:
    if f"true_{axis}" in recording.extras:
        return recording.extras[f"true_{axis}"]
    return recording[f"pose_{axis}"] if recording.has(f"pose_{axis}") else None


def _first(values: Array | None, span: slice) -> float:
    found = np.empty(0) if values is None else values[span][np.isfinite(values[span])]
    return float(found[0]) if found.size else 0.0


def table_of(estimated: EstimatedRun) -> dict[str, Array]:
    """Columns by name: time, states with deviations, soil parameters, derived quantities, innovations."""
    run, model = estimated.run, estimated.model
    names = THESIS_STATE if model is None else STATE
    columns = {"t": run.t}
    for k, name in enumerate(names):
        columns[name] = run.states[:, k]
        columns[f"{name}_deviation"] = run.deviations[:, k]
    if model is not None:
        found = estimates(model, run.states, run.covariances)
        columns |= dict(zip(PARAMETERS, found.parameters.T, strict=True))
        columns |= {f"{name}_learned": values for name, values in zip(PARAMETERS, found.learned.T, strict=True)}
        columns |= {f"slip_ratio_{bank}": found.slip_ratios[:, k] for k, bank in enumerate(("right", "left"))}
        columns |= {"radius": found.radius, "radius_deviation": found.radius_deviation}
    path = dead_reckoned(estimated)["estimated"]
    columns |= {"x": path[:, 0], "y": path[:, 1]}
    return columns | {f"innovation_{name}": values for name, values in zip(CHANNELS, run.standardised.T, strict=True)}


def summary_of(estimated: EstimatedRun) -> dict[str, Any]:
    """Final parameters, errors where the truth is known, NIS with bands."""
    values, deviations = estimated.parameters
    model, fit = estimated.model, estimated.law_fit
    summary: dict[str, Any] = {
        "title": estimated.title,
        "robot": estimated.robot.name,
        "motor_rate": estimated.robot.motor_rate,
        "filter": "thesis" if model is None else "ours",
        "force_law": ForceLaw.thesis.name if model is None else model.law.name,
        "uses_commands": estimated.uses_commands,
        "rows": len(estimated.recording),
        "seconds": float(estimated.run.t[-1] - estimated.run.t[0]),
        "parameters": {
            name: {
                "value": _number(values[-1, k]),
                "log_deviation": _number(deviations[-1, k]),
                "best_fit": None if fit is None else _number(np.exp(fit.logs[k])),
            }
            for k, name in enumerate(PARAMETERS[: values.shape[1]])
        },
        "errors": _errors(estimated),
        "nis": {
            name: {"value": found.nis, "band": list(found.band), "correlation": float(found.correlation[0])}
            for name, found in channel_statistics(estimated.run.standardised, lags=1).items()
        },
    }
    if model is not None:
        learned = estimates(model, estimated.run.states[-1], estimated.run.covariances[-1]).learned
        for name, share in zip(PARAMETERS, learned, strict=True):
            summary["parameters"][name]["learned"] = float(share)
        names = ("accelerometer", "gyro", "encoder", "acceleration", "yaw_acceleration")
        summary["noise"] = {name: getattr(model.noise, name) for name in names}
    return summary


def _errors(estimated: EstimatedRun) -> dict[str, float | None]:
    """Root mean square errors from 1.6 s on, and the error of the mean radius while turning; empty without truth."""
    truth, run = estimated.truth, estimated.run
    late = run.t - run.t[0] > LAUNCH
    found = {
        f"{name}_rmse": _number(np.sqrt(np.mean((run.states[late, k] - truth[name][late]) ** 2)))
        for k, name in enumerate(STATE[:3])
        if name in truth and late.any()
    }
    if {"v_x", "yaw_rate"} <= set(truth):
        turning = late & (np.abs(truth["yaw_rate"]) > _TURNING)
        if turning.any():
            # a reversal of the turn must not cancel
            sign = np.sign(truth["yaw_rate"][turning])
            ours = run.states[turning, 0].sum() / (sign * run.states[turning, 2]).sum()
            true = truth["v_x"][turning].sum() / (sign * truth["yaw_rate"][turning]).sum()
            found["radius_error"] = _number(ours / true - 1.0)
    return found


def _number(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None
