"""The report of a replay: what ``ddagr replay`` writes as JSON.

The dataclasses below are the schema; :class:`ReplayReport` is the document. Units are SI and radians, errors are
prediction less measurement, residuals measurement less prediction, intervals hold 95 %. A number that could not be
measured is null. ``schema_version`` changes whenever a field changes its meaning or goes.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from ddagr_gym.deprecation import renamed
from ddagr_gym.replay_analysis.intervals import Comparison, ErrorStatistics
from ddagr_gym.replay_analysis.residuals import ChannelResidual, ResidualBins

SCHEMA = "ddagr-gym/replay"
SCHEMA_VERSION = 1

NOMINAL = "simulator"
REFITTED = "simulator_refitted"
NO_SLIP = "kinematic_no_slip"
EFFECTIVE_TRACK = "kinematic_effective_track"
MODELS = (NOMINAL, REFITTED, NO_SLIP, EFFECTIVE_TRACK)
"""Names of the models, in the order in which they are shown."""


@dataclass(frozen=True)
class HorizonError:
    """Error of one model after one horizon, on the part of the recording that no fit has seen.

    Attributes:
        model: of MODELS.
        horizon: [s].
        metric: of :data:`ddagr_gym.replay_analysis.horizons.METRICS`.
        unit: of the metric.
        error: its size.
    """

    model: str
    horizon: float
    metric: str
    unit: str
    error: ErrorStatistics


@dataclass(frozen=True)
class HorizonComparison:
    """A simulator against a kinematic model after one horizon.

    Attributes:
        horizon: [s].
        metric: as above.
        comparison: on the same windows.
    """

    horizon: float
    metric: str
    comparison: Comparison


@dataclass(frozen=True)
class ModelResiduals:
    """Residuals of one simulator over windows with free initial states.

    Attributes:
        model: of MODELS.
        channels: on the part that no fit has seen.
        regimes: binned residuals over the whole recording, one item per channel and quantity.
    """

    model: str
    channels: tuple[ChannelResidual, ...]
    regimes: tuple[ResidualBins, ...]


@dataclass(frozen=True)
class Rollout:
    """One long roll-out of one model, from the state at its start.

    Attributes:
        model: of MODELS.
        start: time of the recording [s].
        seconds: its length.
        errors: at its end by metric; null where no sensor measures the quantity.
    """

    model: str
    start: float
    seconds: float
    errors: Mapping[str, float | None]


@dataclass(frozen=True)
class FittedParameter:
    """Result of a refit for one parameter.

    Attributes:
        name: identifier.
        unit: "-" for logarithms of factors on the nominal value.
        value: 0 is nominal.
        deviation: Gauss-Newton standard deviation.
        window_deviation: the same from the scatter between windows.
        prior: standard deviation before the fit.
        pull: value over prior; beyond 3 the parameter compensates for an effect that the model lacks.
        at_bound: whether the fitted value is at a bound of its range.
    """

    name: str
    unit: str
    value: float
    deviation: float
    window_deviation: float
    prior: float
    pull: float
    at_bound: bool


@dataclass(frozen=True)
class RefitReport:
    """A refit on the training part.

    Attributes:
        parameters: all that it moved.
        windows: that it used.
        window_seconds: their length.
        iterations: of the last pass.
        converged: whether the last step changed the cost by less than the tolerance.
        cost: at the end.
        cpu_seconds: spent.
    """

    parameters: tuple[FittedParameter, ...]
    windows: int
    window_seconds: float
    iterations: int
    converged: bool
    cost: float
    cpu_seconds: float


@dataclass(frozen=True)
class BaselineReport:
    """Kinematic models, fitted on the training part.

    Attributes:
        track_ratio: effective over geometric track; null where no turn was measured.
        drive_delay: by which wheel speeds act late [s], negative where their clock is late.
        motor_rate: of the first-order motor between commands and bank speeds [1/s]; null where wheel speeds drive.
        motor_speed: its ceiling [rad/s].
        motor_delay: its dead time [s].
    """

    track_ratio: float | None
    drive_delay: float
    motor_rate: float | None
    motor_speed: float | None
    motor_delay: float | None


@dataclass(frozen=True)
class Speed:
    """How fast the simulator ran on one core, with the default accuracy.

    Attributes:
        simulated_seconds: of robot time.
        cpu_seconds: that they took.
        times_real_time: their ratio.
    """

    simulated_seconds: float
    cpu_seconds: float
    times_real_time: float


@dataclass(frozen=True)
class DriveModeReport:
    """Replay in one drive mode.

    Attributes:
        drive: what drove the simulator: recorded commands, or recorded wheel speeds ("encoders").
        training_windows: of the window length.
        evaluation_windows: the same, unseen by fits.
        residuals: per simulator.
        horizons: errors after horizons.
        comparisons: simulators against kinematic models.
        rollouts: over every stretch with a known drive.
        baselines: kinematic models.
        refit: null where none was asked for.
        speed: of the simulator.
        notes: sentences on what could not be fitted or judged, and why.
    """

    drive: Literal["commands", "encoders"]
    training_windows: int
    evaluation_windows: int
    residuals: tuple[ModelResiduals, ...]
    horizons: tuple[HorizonError, ...]
    comparisons: tuple[HorizonComparison, ...]
    rollouts: tuple[Rollout, ...]
    baselines: BaselineReport
    refit: RefitReport | None
    speed: Speed
    notes: tuple[str, ...]


@dataclass(frozen=True)
class RunReport:
    """Replay of one recording, or of several together.

    Attributes:
        sources: file names.
        sha256: of the files, "" for simulations.
        rows: of the recordings.
        seconds: duration of the recordings.
        period: between samples [s].
        split: rule by which the training part was chosen.
        noise: standard deviations by channel.
        pose_lateness: corrected before anything else [s], one per recording.
        pose_jitter: left in it [s].
        notes: sentences on what was left out and why.
        arms: one for each drive mode that the recordings allow.
        cpu_seconds: processor time of all drive modes, with fits, baselines and intervals, without drawing.
    """

    sources: tuple[str, ...]
    sha256: tuple[str, ...]
    rows: int
    seconds: float
    period: float
    split: str
    noise: Mapping[str, float]
    pose_lateness: tuple[float, ...]
    pose_jitter: tuple[float, ...]
    notes: tuple[str, ...]
    arms: tuple[DriveModeReport, ...]
    cpu_seconds: float


@dataclass(frozen=True)
class ReplayReport:
    """The document.

    Attributes:
        schema: name of this format.
        schema_version: of this format.
        program: version of ddagr-gym.
        robot: nominal.
        soil: nominal.
        effects: names and parameters of missing physics that were added.
        window: length of the windows with free initial states [s].
        refit: whether parameters were fitted.
        seed: of the resampled intervals.
        runs: one per recording, or one for all.
    """

    schema: str
    schema_version: int
    program: str
    robot: str
    soil: str
    effects: tuple[Mapping[str, float | str], ...]
    window: float
    refit: bool
    seed: int
    runs: tuple[RunReport, ...]


def lead_errors(mode: DriveModeReport, horizon: float = 5.0) -> dict[str, HorizonError]:
    """Heading errors by model after a horizon [s]: from the gyro, else from the poses; empty without either."""
    for metric in ("heading", "heading_pose"):
        found = {e.model: e for e in mode.horizons if (e.horizon, e.metric) == (horizon, metric) and e.error.count}
        if found:
            return found
    return {}


def to_json(report: ReplayReport) -> dict[str, Any]:
    """The report in JSON's types."""
    return asdict(report)


def save_report(report: ReplayReport, path: Path) -> None:
    """Write the report as JSON; numbers that are not finite are refused."""
    path.write_text(json.dumps(to_json(report), indent=1, allow_nan=False) + "\n", encoding="utf-8")


if not TYPE_CHECKING:  # a typed __getattr__ would hide misspelt names from the type checker
    __getattr__ = renamed(__name__, {"ArmReport": f"{__name__}:DriveModeReport"}, goes="0.4.0")
