"""A replay in one drive mode: the simulator follows either the recorded commands or the recorded wheel speeds."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.deprecation import renamed
from ddagr_gym.identification.data_split import clusters, held_out, training
from ddagr_gym.identification.residual_weights import noise_weights, residuals
from ddagr_gym.identification.windows import WindowSet
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.replay_analysis.fitting import (
    ITERATIONS,
    MOST_WINDOWS,
    PASSES,
    DriveModeFit,
    drive_mode_parameters,
    fit_drive_mode,
    motor_start,
)
from ddagr_gym.replay_analysis.horizons import HORIZONS, METRICS, heading_growth, horizon_errors
from ddagr_gym.replay_analysis.intervals import compare, error_statistics
from ddagr_gym.replay_analysis.kinematic import KinematicModel
from ddagr_gym.replay_analysis.models import Baselines, ReplaySimulator, fit_baselines, predict_all, weights_of
from ddagr_gym.replay_analysis.prepare import Prepared
from ddagr_gym.replay_analysis.report import (
    EFFECTIVE_TRACK,
    NO_SLIP,
    NOMINAL,
    REFITTED,
    DriveModeReport,
    FittedParameter,
    HorizonComparison,
    HorizonError,
    ModelResiduals,
    RefitReport,
    Rollout,
    Speed,
)
from ddagr_gym.replay_analysis.residuals import RECORDED, bin_values, binned_residuals, channel_residuals

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

STEPS = PASSES * ITERATIONS + len(HORIZONS) + 3
"""Steps of progress in one drive mode: fit, horizons, baselines, residuals and roll-outs."""

ENCODERS = ("encoder_right", "encoder_left")


@dataclass(frozen=True, eq=False)
class HorizonResult:
    """Errors after one horizon on the evaluation part, which no fit has used.

    Attributes:
        clusters: (W,) cluster of each window; the bootstrap draws whole clusters.
        errors: (W,) by model and metric; NaN where no sensor measures the quantity.
        growth: by model, root mean square heading error (T,) after each sample [rad].
        period: between samples [s].
    """

    clusters: Integers
    errors: Mapping[str, Mapping[str, Array]]
    growth: Mapping[str, Array]
    period: float


@dataclass(frozen=True, eq=False)
class DriveModeResult:
    """Replay in one drive mode: its report, and the arrays that the figures are drawn from.

    Attributes:
        report: its part of replay.json.
        windows: windows with free initial states over the whole recording.
        in_training: (W,) True for windows that a fit may have used.
        residuals: (W, T, 8) residuals of every simulator, by model name.
        horizons: errors by horizon [s].
        rollouts: windows and the predictions of every model, one pair for each length of window.
    """

    report: DriveModeReport
    windows: WindowSet
    in_training: NDArray[np.bool_]
    residuals: Mapping[str, Array]
    horizons: Mapping[float, HorizonResult]
    rollouts: tuple[tuple[WindowSet, Mapping[str, Array]], ...]


@dataclass(frozen=True)
class ReplaySettings:
    """Settings of a replay, the same for both drive modes.

    Attributes:
        window: length of the windows with free initial states [s].
        refit: whether to fit soil and robot parameters.
        effects: effects to add to the nominal simulator.
        threads: number of threads of the simulator.
        seed: seed of the bootstrap intervals.
        swapped: whether to fit on the evaluation part and evaluate on the training part.
    """

    window: float = 2.0
    refit: bool = False
    effects: tuple[Effect, ...] = ()
    threads: int = 1
    seed: int = 0
    swapped: bool = False


def replay_drive_mode(
    prepared: Prepared,
    robot: Robot,
    soil: Soil,
    drive_by: str,
    settings: ReplaySettings,
    start: Mapping[str, float],
    advance: Callable[[int], None],
) -> tuple[DriveModeResult, dict[str, float]] | None:
    """Replay recordings in one drive mode.

    Args:
        prepared: the recordings.
        robot: nominal robot.
        soil: nominal soil.
        drive_by: "commands", or "encoders" for the recorded wheel speeds.
        settings: window, refit, effects, threads and seed.
        start: initial parameter values of a refit, by name.
        advance: called with the number of steps done; they sum to STEPS.

    Returns:
        The result and the fitted values by name; None if no window has valid commands or wheel speeds.
    """
    windows = prepared.windows(settings.window, drive_by)
    if windows is None:
        advance(STEPS)
        return None
    seen = prepared.windows(settings.window, drive_by, part=training, most=MOST_WINDOWS)
    baselines = fit_baselines(prepared, robot, drive_by, seen)
    advance(1)
    fit, refit = None, None
    if settings.refit and seen is not None:
        fit, refit = _fit(prepared, robot, soil, seen, baselines, settings, start, advance)
    else:
        advance(PASSES * ITERATIONS)
    simulators = _simulators(robot, soil, settings, baselines, fit)
    for simulator in simulators.values():
        simulator.warm_up(windows)
    tables, residual = _residuals(prepared, simulators, windows, drive_by)
    advance(1)
    found: dict[float, HorizonResult] = {}
    for horizon in HORIZONS:
        result = _horizon(prepared, simulators, baselines.models(), drive_by, horizon)
        found |= {} if result is None else {horizon: result}
        advance(1)
    rolled = tuple((run, predict_all(simulators, baselines.models(), run)) for run in prepared.runs(drive_by))
    advance(1)
    sizes, pairs = horizon_tables(found, settings.seed)
    judged = prepared.windows(settings.window, drive_by, part=held_out)
    report = DriveModeReport(
        "encoders" if drive_by == "encoders" else "commands",
        0 if seen is None else seen.count,
        0 if judged is None else judged.count,
        tables,
        sizes,
        pairs,
        _rollouts(rolled, drive_by),
        baselines.report(),
        refit,
        _speed(simulators.values()),
        tuple(_notes(settings, seen, judged, baselines, found)),
    )
    values = {} if fit is None else dict(zip((p.name for p in fit.parameters), fit.values.tolist(), strict=True))
    in_training = training(windows, prepared.splits)
    return DriveModeResult(report, windows, in_training, residual, found, rolled), values


def _speed(simulators: Iterable[ReplaySimulator]) -> Speed:
    """Speed of all simulators of a drive mode together."""
    speeds = [simulator.speed() for simulator in simulators]
    simulated, cpu = sum(s.simulated_seconds for s in speeds), sum(s.cpu_seconds for s in speeds)
    return Speed(simulated, cpu, simulated / cpu if cpu > 0.0 else 0.0)


def _notes(
    settings: ReplaySettings,
    seen: WindowSet | None,
    judged: WindowSet | None,
    baselines: Baselines,
    found: Mapping[float, HorizonResult],
) -> Iterator[str]:
    if seen is None:
        yield f"no window of {settings.window:g} s lies in the part for fits: nothing was fitted."
    elif baselines.effective_track is None:
        yield (
            "no effective track could be fitted: in the part for fits the robot did not turn, or not as it was driven; "
            "see ddagr check."
        )
    if judged is None:
        yield f"no window of {settings.window:g} s lies in the unseen part: its residuals are not judged."
    for horizon in HORIZONS:
        if horizon not in found:
            yield f"no unseen stretch with a known drive lasts {horizon:g} s: errors after that time are not judged."


def _fit(
    prepared: Prepared,
    robot: Robot,
    soil: Soil,
    seen: WindowSet,
    baselines: Baselines,
    settings: ReplaySettings,
    start: Mapping[str, float],
    advance: Callable[[int], None],
) -> tuple[DriveModeFit, RefitReport]:
    made = 0
    before = time.process_time()
    imposed = baselines.motor is None

    def step() -> None:
        nonlocal made
        made += 1
        advance(1)

    own = {"wheel_speed_shift": baselines.delay} if baselines.motor is None else motor_start(robot, baselines.motor)
    fit = fit_drive_mode(
        robot,
        soil,
        seen,
        drive_mode_parameters(robot, soil, prepared.noise, prepared.period, imposed),
        noise_weights(prepared.noise, seen, imposed, prepared.dead),
        imposed=imposed,
        start={**start, **own},
        effects=settings.effects,
        threads=settings.threads,
        progress=step,
    )
    advance(PASSES * ITERATIONS - made)
    return fit, _refit_report(fit, settings.window, time.process_time() - before)


def _simulators(
    robot: Robot, soil: Soil, settings: ReplaySettings, baselines: Baselines, fit: DriveModeFit | None
) -> dict[str, ReplaySimulator]:
    def make(fitted: DriveModeFit | None) -> ReplaySimulator:
        return ReplaySimulator(
            robot, soil, settings.effects, imposed=baselines.motor is None, delay=baselines.delay, fit=fitted,
            threads=settings.threads,
        )  # fmt: skip

    return {NOMINAL: make(None)} | ({} if fit is None else {REFITTED: make(fit)})


def _residuals(
    prepared: Prepared, simulators: Mapping[str, ReplaySimulator], windows: WindowSet, drive_by: str
) -> tuple[tuple[ModelResiduals, ...], dict[str, Array]]:
    imposed = drive_by == "encoders"
    left_out = (*prepared.dead, *(ENCODERS if imposed else ()))
    judged = held_out(windows, prepared.splits)
    sigma = weights_of(prepared, windows, imposed)
    tables, arrays = [], {}
    for name, simulator in simulators.items():
        prediction, record = simulator.with_free_states(windows, sigma, RECORDED)
        residual = residuals(windows, prediction)
        table = channel_residuals(residual[judged], prepared.sigma, left_out)
        tables.append(ModelResiduals(name, table, binned_residuals(residual, bin_values(windows, record), left_out)))
        arrays[name] = residual
    return tuple(tables), arrays


def _horizon(
    prepared: Prepared,
    simulators: Mapping[str, ReplaySimulator],
    kinematic: Mapping[str, KinematicModel],
    drive_by: str,
    horizon: float,
) -> HorizonResult | None:
    windows = prepared.windows(horizon, drive_by, stride=max(1.0, horizon / 6.0), part=held_out)
    if windows is None:
        return None
    predictions = predict_all(simulators, kinematic, windows)
    known = _metrics(prepared, drive_by)
    errors = {name: horizon_errors(windows, p) for name, p in predictions.items()}
    return HorizonResult(
        clusters(windows, prepared.splits),
        {name: {metric: error[metric] for metric in known} for name, error in errors.items()},
        {name: heading_growth(windows, p) for name, p in predictions.items()},
        windows.period,
    )


def horizon_tables(
    results: Mapping[float, HorizonResult], seed: int
) -> tuple[tuple[HorizonError, ...], tuple[HorizonComparison, ...]]:
    """Sizes of all errors, and simulators against kinematic models.

    Args:
        results: by horizon [s].
        seed: of the resampling; the same draws for every model.
    """
    sizes: list[HorizonError] = []
    pairs: list[HorizonComparison] = []
    for horizon, result in results.items():
        metrics = next(iter(result.errors.values()))
        for metric in metrics:
            for model, errors in result.errors.items():
                size = error_statistics(errors[metric], result.clusters, np.random.default_rng(seed))
                sizes.append(HorizonError(model, horizon, metric, METRICS[metric][0], size))
            pairs += _pairs(horizon, metric, result, seed)
    return tuple(sizes), tuple(pairs)


def _metrics(prepared: Prepared, drive_by: str) -> list[str]:
    """Metrics that can be evaluated: none of a dead gyro, and no wheel speed where wheel speeds are imposed."""
    by_gyro = ("heading", "yaw_rate") if "yaw_rate" in prepared.dead else ()
    return [m for m in METRICS if m not in by_gyro and not (m == "wheel_speed" and drive_by == "encoders")]


def _pairs(horizon: float, metric: str, result: HorizonResult, seed: int) -> list[HorizonComparison]:
    made = []
    for candidate in (NOMINAL, REFITTED):
        for baseline in (NO_SLIP, EFFECTIVE_TRACK):
            if candidate in result.errors and baseline in result.errors:
                ours, theirs = result.errors[candidate][metric], result.errors[baseline][metric]
                rng = np.random.default_rng(seed)
                pair = compare(candidate, ours, baseline, theirs, result.clusters, rng)
                made += [] if pair is None else [HorizonComparison(horizon, metric, pair)]
    return made


def _rollouts(rolled: Sequence[tuple[WindowSet, Mapping[str, Array]]], drive_by: str) -> tuple[Rollout, ...]:
    made = []
    for windows, predictions in rolled:
        for name, prediction in predictions.items():
            errors = horizon_errors(windows, prediction)
            for w in range(windows.count):
                ends = {m: float(e[w]) if np.isfinite(e[w]) else None for m, e in errors.items()}
                if drive_by == "encoders":
                    ends["wheel_speed"] = None
                made.append(Rollout(name, float(windows.time[w]), windows.duration, ends))
    return tuple(made)


def _refit_report(fit: DriveModeFit, window: float, cpu: float) -> RefitReport:
    found = fit.fitted
    parameters = tuple(
        FittedParameter(
            p.name, p.unit, float(value), float(deviation), float(spread), p.prior, float(value) / p.prior,
            p.name in fit.at_bound,
        )
        for p, value, deviation, spread in zip(
            fit.parameters, fit.values, fit.deviations, fit.window_deviations, strict=True
        )
    )  # fmt: skip
    return RefitReport(parameters, fit.windows, window, found.iterations, found.converged, found.cost, cpu)


if not TYPE_CHECKING:  # a typed __getattr__ would hide misspelt names from the type checker
    __getattr__ = renamed(
        __name__,
        {
            "ArmResult": f"{__name__}:DriveModeResult",
            "ArmSettings": f"{__name__}:ReplaySettings",
            "replay_arm": f"{__name__}:replay_drive_mode",
        },
        goes="0.4.0",
    )
