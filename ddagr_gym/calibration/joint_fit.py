"""One fit over all drives: the robot's parameters shared, soil by ground, gyro bias by drive."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.parts import RobotModel, complete_robot, shared_parameters
from ddagr_gym.identification.block_means import sample_windows
from ddagr_gym.identification.fit_numerics import FIELD_TOLERANCE, field_numerics, field_slope_numerics
from ddagr_gym.identification.gauss_newton import Fitted, fit
from ddagr_gym.identification.motor_currents import current_noise
from ddagr_gym.identification.nuisances import Nuisances
from ddagr_gym.identification.parameters import (
    KIND_STIFFNESS_DEVIATION,
    ModelParameter,
    per_group,
    sensor_parameters,
    slope_parameters,
    soil_entries,
    soil_parameters,
)
from ddagr_gym.identification.problem import Point, Problem
from ddagr_gym.identification.residual_weights import (
    LEAST_GYRO_BIAS,
    ROBUST,
    UNKNOWN_GYRO_BIAS,
    Weights,
    misfit_weights,
    noise_weights,
)
from ddagr_gym.identification.windows import WindowSet
from ddagr_gym.parameters import Numerics, Soil
from ddagr_gym.physics.wheel_forces import soil_vector
from ddagr_gym.recordings.channels import CURRENTS

Array = NDArray[np.float64]
Progress = Callable[[str], None]

ITERATIONS = 12
"""Most Gauss-Newton steps of a fit (ours): field drives take 4 to 8, a robot with limits that it does not have more."""

REPEATS = 1
"""Further steps with the sensitivities of each step (ours): of five fits to drives of a Warthog without some parts, 6
such pairs ended at lower costs than 8 single steps in three and at up to 0.2 % higher ones in two, in 0.73 of the
time."""

FIRST_ITERATIONS = 6
"""Steps of the fit that only serves to weigh residuals (ours)."""

FIRST_TOLERANCE = 5e-3
"""Relative gain of a step that ends that fit (ours): medians of residuals move by half as much."""

LAST_ITERATIONS = 12
"""Steps of a fit that begins at the values of another one (ours)."""

OFFSET = "offset_"
"""Begins the names of parameters that carry the nominal soil and the slope of a ground; they are always held."""


@dataclass(frozen=True, eq=False)
class Standing:
    """Where a fit stands, small enough to be kept.

    Attributes:
        values: of all parameters by name.
        states: (W, 8) initial states of the windows.
        converged: whether the last step lowered the cost by less than the tolerance.
    """

    values: dict[str, float]
    states: Array
    converged: bool


@dataclass(frozen=True, eq=False)
class FittedModel:
    """Parameters fitted to some windows.

    Attributes:
        model: robot and parameters.
        problem: windows, parameters and weights.
        fitted: where the fit stands.
    """

    model: RobotModel
    problem: Problem
    fitted: Fitted

    @property
    def parameters(self) -> tuple[ModelParameter, ...]:
        """(P,), held ones included."""
        return self.problem.nuisances.parameters

    @property
    def values(self) -> dict[str, float]:
        """By name."""
        pairs = zip(self.parameters, self.fitted.point.values.tolist(), strict=True)
        return {parameter.name: value for parameter, value in pairs}

    @property
    def standing(self) -> Standing:
        """Where it stands."""
        return Standing(self.values, self.fitted.point.states, self.fitted.converged)

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the parameters that the fit moved."""
        return tuple(parameter.name for parameter in self.parameters if parameter.prior > 0.0)


def complete_model(data: CalibrationData, doubted: Sequence[str] = ()) -> tuple[RobotModel, dict[str, float]]:
    """The joint model with all parts, and the values at which parameters that never move are held.

    Soils of the grounds differ from the first one's by offsets that are held; what is fitted of a ground acts on top.
    Slopes that the accelerometers tell are held too.

    Args:
        data: drives.
        doubted: further parts, see :func:`~ddagr_gym.calibration.parts.shared_parameters`.
    """
    offsets, held = _soil_offsets(data)
    slopes, gradients = _slope_offsets(data)
    offsets, held = [*offsets, *slopes], held | gradients
    by_ground = [
        per_group(p, {ground: drives})
        for ground, drives in data.drives_on.items()
        for p in soil_parameters(data.soils[ground], KIND_STIFFNESS_DEVIATION)
    ]
    soil = [parameter for made in by_ground for parameter in made]
    noise = data.prepared.noise
    known = [float(np.hypot(*item.gyro_bias)) for item in noise if item.gyro_bias is not None]
    bias = max(*known, LEAST_GYRO_BIAS) if len(known) == len(noise) else UNKNOWN_GYRO_BIAS
    biases = [p for p in sensor_parameters(data.count, bias, 1.0) if p.name.startswith("gyro_bias")]
    robot = complete_robot(data.robot)
    constants = () if data.currents is None else data.currents.parameters
    return RobotModel(robot, (*offsets, *soil, *shared_parameters(robot, doubted), *biases, *constants)), held


def _soil_offsets(data: CalibrationData) -> tuple[list[ModelParameter], dict[str, float]]:
    first = soil_vector(next(iter(data.soils.values())))
    parameters, values = [], {}
    for ground, drives in data.drives_on.items():
        for index, difference in enumerate(soil_vector(data.soils[ground]) - first):
            if difference != 0.0:
                name = f"{OFFSET}{index}_{ground}"
                entry = soil_entries(index)
                scope = frozenset(drives)
                parameters.append(ModelParameter(name, "", entry, False, 0.0, 1.0, -np.inf, np.inf, scope))
                values[name] = float(difference)
    return parameters, values


def _slope_offsets(data: CalibrationData) -> tuple[list[ModelParameter], dict[str, float]]:
    parameters, values = [], {}
    for ground, slope in data.slopes.items():
        scope = frozenset(data.drives_on[ground])
        for parameter, gradient in zip(slope_parameters((0.0, 0.0)), slope.gradient, strict=True):
            name = f"{OFFSET}{parameter.name}_{ground}"
            parameters.append(replace(parameter, name=name, scope=scope))
            values[name] = gradient
    return parameters, values


def make_problem(
    data: CalibrationData,
    windows: WindowSet,
    model: RobotModel,
    weights: Weights,
    threads: int,
    slopes: Numerics | None = None,
) -> Problem:
    """The fit of some windows with some weights, and with sensitivities by their own numerics where that is wanted."""
    soil: Soil = next(iter(data.soils.values()))
    return Problem(
        model.robot, soil, sample_windows(windows, weights.sigma), Nuisances(model.parameters), robust=weights.robust,
        threads=threads, numerics=field_numerics(), slopes=slopes, currents=data.currents,
    )  # fmt: skip


def point_at(problem: Problem, values: Mapping[str, float], states: Array | None = None) -> Point:
    """Point at values by name, 0 for the others, inside the bounds."""
    parameters = problem.nuisances.parameters
    listed = np.array([values.get(p.name, 0.0) for p in parameters], dtype=np.float64)
    return Point(
        np.clip(listed, problem.low, problem.high), problem.blocked.windows.initial if states is None else states
    )


def first_weights(data: CalibrationData, windows: WindowSet) -> Weights:
    """Weights by the sensors' noise."""
    weights = noise_weights(data.prepared.noise, windows, False, data.prepared.dead)
    if data.currents is None:
        return weights
    sigma = np.concatenate([weights.sigma, current_noise(data.currents, windows)], axis=2)
    return Weights(sigma, np.concatenate([weights.robust, np.full(len(CURRENTS), ROBUST)]))


def weights_by_drive(windows: WindowSet, prediction: Array, before: Weights) -> Weights:
    """Weights by what a fit left of each drive: grounds and days shake a robot differently."""
    sigma, robust = before.sigma.copy(), before.robust.copy()
    for drive in np.unique(windows.recording):
        rows = windows.recording == drive
        found = misfit_weights(windows.subset(rows), prediction[rows], Weights(before.sigma[rows], before.robust))
        sigma[rows] = found.sigma
        robust = np.minimum(robust, found.robust)
    return Weights(sigma, robust)


def model_at(
    data: CalibrationData,
    windows: WindowSet,
    model: RobotModel,
    weights: Weights,
    standing: Standing,
    threads: int,
) -> FittedModel:
    """Model where a fit stands, with its derivatives there."""
    return fit_model(data, windows, model, weights, standing.values, threads, states=standing.states, iterations=0)


def fit_model(
    data: CalibrationData,
    windows: WindowSet,
    model: RobotModel,
    weights: Weights,
    start: Mapping[str, float],
    threads: int,
    *,
    states: Array | None = None,
    iterations: int = ITERATIONS,
    tolerance: float = FIELD_TOLERANCE,
    give_up: Callable[[float, float], bool] = lambda before, after: False,
    renewed: bool = True,
) -> FittedModel:
    """Fit parameters to windows with given weights.

    Args:
        data: drives.
        windows: to fit.
        model: robot and parameters.
        weights: of the residuals.
        start: values by name.
        threads: of the simulator.
        states: (W, 8) initial states to start from; the windows' first guess by default.
        iterations: most steps, with coarse sensitivities; 0 only computes fine ones at the start.
        tolerance: relative gain of a step that ends the fit.
        give_up: called with the cost before and after each step; the fit ends where it says so.
        renewed: whether the sensitivities of the result are needed.
    """
    slopes = field_slope_numerics() if iterations > 0 else None
    problem = make_problem(data, windows, model, weights, threads, slopes)
    point = point_at(problem, start, states)
    found = fit(
        problem, point, iterations=iterations, tolerance=tolerance, renewals=iterations, repeats=REPEATS,
        give_up=give_up, renewed=renewed,
    )  # fmt: skip
    return FittedModel(model, problem, found)


def rough_fit(
    data: CalibrationData, windows: WindowSet, model: RobotModel, start: Mapping[str, float], threads: int
) -> tuple[FittedModel, Weights]:
    """Fit by what the start leaves unexplained of each drive, and the weights by what that fit leaves.

    The noise of good sensors is no measure of a model that is still far off: its weights would bend every parameter to
    its bound. Arguments as :func:`weigh_and_fit`.
    """
    noise = first_weights(data, windows)
    problem = make_problem(data, windows, model, noise, threads)
    weights = weights_by_drive(windows, problem.predict(point_at(problem, start)), noise)
    found = fit_model(
        data, windows, model, weights, start, threads, iterations=FIRST_ITERATIONS, tolerance=FIRST_TOLERANCE,
        renewed=False,
    )  # fmt: skip
    return found, weights_by_drive(windows, found.fitted.prediction, noise)


def weigh_and_fit(
    data: CalibrationData,
    windows: WindowSet,
    model: RobotModel,
    start: Mapping[str, float],
    threads: int,
    iterations: int = ITERATIONS,
) -> tuple[FittedModel, Weights]:
    """Fit by what a rough fit leaves unexplained of each drive.

    Args:
        data: drives.
        windows: to fit.
        model: robot and parameters.
        start: values by name.
        threads: of the simulator.
        iterations: most steps after the rough fit.

    Returns:
        The fit, and its weights.
    """
    rough, weights = rough_fit(data, windows, model, start, threads)
    states = rough.fitted.point.states
    found = fit_model(data, windows, model, weights, rough.values, threads, states=states, iterations=iterations)
    return found, weights
