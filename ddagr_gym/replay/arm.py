"""One arm of a replay: one way to drive the simulator, all models, all errors."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.replay.fitting import (
    ITERATIONS,
    MOST_WINDOWS,
    PASSES,
    ArmFit,
    arm_parameters,
    fit_arm,
    motor_start,
    noise_weights,
)
from ddagr_gym.replay.horizons import HORIZONS, METRICS, heading_growth, horizon_errors
from ddagr_gym.replay.intervals import compare, error_statistics
from ddagr_gym.replay.kinematic import KinematicModel
from ddagr_gym.replay.models import Baselines, SimulatorOfArm, fit_baselines, predict_all, weights_of
from ddagr_gym.replay.prepare import Prepared
from ddagr_gym.replay.report import (
    EFFECTIVE_TRACK,
    NO_SLIP,
    NOMINAL,
    REFITTED,
    ArmReport,
    FittedParameter,
    HorizonComparison,
    HorizonError,
    ModelResiduals,
    RefitReport,
    Rollout,
)
from ddagr_gym.replay.residuals import RECORDED, channel_residuals, regime_values, regimes, residuals
from ddagr_gym.replay.split import clusters, held_out, training
from ddagr_gym.replay.windows import WindowSet

Array = NDArray[np.float64]

STEPS = PASSES * ITERATIONS + len(HORIZONS) + 3
"""Steps of progress that one arm makes: its fit, its horizons, baselines, residuals, roll-outs."""

ENCODERS = ("encoder_right", "encoder_left")


@dataclass(frozen=True, eq=False)
class ArmResult:
    """What figures need of an arm, besides its report.

    Attributes:
        report: for the document.
        windows: with free initial states, of the whole recording.
        in_training: (W,) which of them a fit may have seen.
        residuals: (W, T, 8) by simulator.
        growth: by horizon [s] and model, root mean square heading error (T,) after each sample.
        rollouts: windows and predictions by model, one pair per length.
    """

    report: ArmReport
    windows: WindowSet
    in_training: NDArray[np.bool_]
    residuals: Mapping[str, Array]
    growth: Mapping[float, Mapping[str, Array]]
    rollouts: tuple[tuple[WindowSet, Mapping[str, Array]], ...]


@dataclass(frozen=True)
class ArmSettings:
    """How an arm is replayed.

    Attributes:
        window: length of windows with free initial states [s].
        refit: whether parameters are fitted.
        effects: missing physics.
        threads: of the simulator.
        seed: of resampled intervals.
    """

    window: float = 2.0
    refit: bool = False
    effects: tuple[Effect, ...] = ()
    threads: int = 1
    seed: int = 0


def replay_arm(
    prepared: Prepared,
    robot: Robot,
    soil: Soil,
    drive_by: str,
    settings: ArmSettings,
    start: Mapping[str, float],
    advance: Callable[[int], None],
) -> tuple[ArmResult, dict[str, float]] | None:
    """Replay one arm.

    Args:
        prepared: recordings.
        robot: nominal.
        soil: nominal.
        drive_by: "commands" or "encoders".
        settings: see there.
        start: parameter values to start a refit from, by name.
        advance: told of every step of STEPS.

    Returns:
        The result and the fitted values by name; None where no window has a known drive.
    """
    imposed = drive_by == "encoders"
    windows = prepared.windows(settings.window, drive_by)
    if windows is None:
        advance(STEPS)
        return None
    seen = prepared.windows(settings.window, drive_by, part=training, most=MOST_WINDOWS)
    baselines = fit_baselines(prepared, robot, drive_by, seen)
    advance(1)
    fit, cpu = None, 0.0
    if settings.refit and seen is not None:
        before = time.process_time()
        fit = _fit(prepared, robot, soil, seen, baselines, imposed, settings, start, advance)
        cpu = time.process_time() - before
    else:
        advance(PASSES * ITERATIONS)
    simulators = _simulators(robot, soil, settings, imposed, baselines, fit)
    for simulator in simulators.values():
        simulator.warm_up(windows)
    free = _residuals(prepared, simulators, windows, imposed)
    advance(1)
    kinematic = {NO_SLIP: baselines.no_slip}
    if baselines.effective_track is not None:
        kinematic[EFFECTIVE_TRACK] = baselines.effective_track
    errors, comparisons, growth = _horizons(prepared, simulators, kinematic, drive_by, settings, advance)
    rolled = tuple((run, predict_all(simulators, kinematic, run)) for run in prepared.runs(drive_by))
    advance(1)
    judged = prepared.windows(settings.window, drive_by, part=held_out)
    report = ArmReport(
        "encoders" if imposed else "commands",
        0 if seen is None else seen.count,
        0 if judged is None else judged.count,
        free[0],
        errors,
        comparisons,
        _rollouts(rolled, imposed),
        baselines.report(),
        None if fit is None else _refit_report(fit, settings.window, cpu),
        simulators[max(simulators)].speed(),
    )
    values = {} if fit is None else dict(zip((p.name for p in fit.parameters), fit.fit.values.tolist(), strict=True))
    result = ArmResult(report, windows, training(windows, prepared.splits), free[1], growth, rolled)
    return result, values


def _fit(
    prepared: Prepared,
    robot: Robot,
    soil: Soil,
    seen: WindowSet,
    baselines: Baselines,
    imposed: bool,
    settings: ArmSettings,
    start: Mapping[str, float],
    advance: Callable[[int], None],
) -> ArmFit:
    made = 0

    def step() -> None:
        nonlocal made
        made += 1
        advance(1)

    own = {"wheel_speed_shift": baselines.delay} if baselines.motor is None else motor_start(robot, baselines.motor)
    fit = fit_arm(
        robot,
        soil,
        seen,
        arm_parameters(robot, soil, prepared.noise, prepared.period, imposed),
        noise_weights(prepared.noise, seen, imposed, prepared.dead),
        imposed=imposed,
        start={**start, **own},
        effects=settings.effects,
        threads=settings.threads,
        progress=step,
    )
    advance(PASSES * ITERATIONS - made)
    return fit


def _simulators(
    robot: Robot, soil: Soil, settings: ArmSettings, imposed: bool, baselines: Baselines, fit: ArmFit | None
) -> dict[str, SimulatorOfArm]:
    def make(fitted: ArmFit | None) -> SimulatorOfArm:
        return SimulatorOfArm(
            robot, soil, settings.effects, imposed=imposed, delay=baselines.delay, fit=fitted, threads=settings.threads
        )

    return {NOMINAL: make(None)} | ({} if fit is None else {REFITTED: make(fit)})


def _residuals(
    prepared: Prepared, simulators: Mapping[str, SimulatorOfArm], windows: WindowSet, imposed: bool
) -> tuple[tuple[ModelResiduals, ...], dict[str, Array]]:
    left_out = (*prepared.dead, *(ENCODERS if imposed else ()))
    judged = held_out(windows, prepared.splits)
    sigma = weights_of(prepared, windows, imposed)
    tables, arrays = [], {}
    for name, simulator in simulators.items():
        prediction, record = simulator.with_free_states(windows, sigma, RECORDED)
        residual = residuals(windows, prediction)
        table = channel_residuals(residual[judged], prepared.sigma, left_out)
        tables.append(ModelResiduals(name, table, regimes(residual, regime_values(windows, record), left_out)))
        arrays[name] = residual
    return tuple(tables), arrays


def _horizons(
    prepared: Prepared,
    simulators: Mapping[str, SimulatorOfArm],
    kinematic: Mapping[str, KinematicModel],
    drive_by: str,
    settings: ArmSettings,
    advance: Callable[[int], None],
) -> tuple[tuple[HorizonError, ...], tuple[HorizonComparison, ...], dict[float, dict[str, Array]]]:
    table: list[HorizonError] = []
    pairs: list[HorizonComparison] = []
    growth: dict[float, dict[str, Array]] = {}
    for horizon in HORIZONS:
        windows = prepared.windows(horizon, drive_by, stride=max(1.0, horizon / 6.0), part=held_out)
        if windows is not None:
            predictions = predict_all(simulators, kinematic, windows)
            growth[horizon] = {name: heading_growth(windows, p) for name, p in predictions.items()}
            errors = {name: horizon_errors(windows, p) for name, p in predictions.items()}
            near = clusters(windows, prepared.splits)
            for metric in _metrics(prepared, drive_by):
                sizes = {name: error[metric] for name, error in errors.items()}
                table += _sizes(horizon, metric, sizes, near, settings.seed)
                pairs += _pairs(horizon, metric, sizes, tuple(simulators), tuple(kinematic), near, settings.seed)
        advance(1)
    return tuple(table), tuple(pairs), growth


def _metrics(prepared: Prepared, drive_by: str) -> list[str]:
    """Metrics that say something in this arm; a dead gyro judges nothing, imposed wheel speeds neither."""
    by_gyro = ("heading", "yaw_rate") if "yaw_rate" in prepared.dead else ()
    return [m for m in METRICS if m not in by_gyro and not (m == "wheel_speed" and drive_by == "encoders")]


def _sizes(
    horizon: float, metric: str, sizes: Mapping[str, Array], near: NDArray[np.int64], seed: int
) -> list[HorizonError]:
    # the same draws for every model
    return [
        HorizonError(name, horizon, metric, METRICS[metric][0], error_statistics(e, near, np.random.default_rng(seed)))
        for name, e in sizes.items()
    ]


def _pairs(
    horizon: float,
    metric: str,
    sizes: Mapping[str, Array],
    candidates: Sequence[str],
    baselines: Sequence[str],
    near: NDArray[np.int64],
    seed: int,
) -> list[HorizonComparison]:
    made = []
    for candidate in candidates:
        for baseline in baselines:
            pair = compare(candidate, sizes[candidate], baseline, sizes[baseline], near, np.random.default_rng(seed))
            if pair is not None:
                made.append(HorizonComparison(horizon, metric, pair))
    return made


def _rollouts(rolled: Sequence[tuple[WindowSet, Mapping[str, Array]]], imposed: bool) -> tuple[Rollout, ...]:
    made = []
    for windows, predictions in rolled:
        for name, prediction in predictions.items():
            errors = horizon_errors(windows, prediction)
            for w in range(windows.count):
                ends = {m: float(e[w]) if np.isfinite(e[w]) else None for m, e in errors.items()}
                if imposed:
                    ends["wheel_speed"] = None
                made.append(Rollout(name, float(windows.time[w]), windows.duration, ends))
    return tuple(made)


def _refit_report(fit: ArmFit, window: float, cpu: float) -> RefitReport:
    found = fit.fit
    parameters = tuple(
        FittedParameter(
            p.name, p.unit, float(value), float(deviation), float(spread), p.prior, float(value) / p.prior,
            p.name in found.at_bound,
        )
        for p, value, deviation, spread in zip(
            fit.parameters, found.values, found.deviations, found.window_deviations, strict=True
        )
    )  # fmt: skip
    return RefitReport(parameters, fit.windows, window, found.iterations, found.converged, found.cost, cpu)
