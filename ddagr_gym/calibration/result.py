"""Typed result of a calibration, as ``calibration.json`` holds it.

Units are SI and radians, intervals hold 90 % unless said otherwise. Errors are prediction less measurement, residuals
measurement less prediction.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ddagr_gym.calibration.accelerometer_results import ImuMounting, SlopeOfGround

SCHEMA = "ddagr-gym/calibration"
SCHEMA_VERSION = 1

DATA_SHEET = "data_sheet"
CALIBRATED = "calibrated"
KINEMATIC = "kinematic_effective_track"
MODELS = (DATA_SHEET, CALIBRATED, KINEMATIC)
"""Models whose forecasts are compared, in the order in which they are shown."""


@dataclass(frozen=True)
class DriveSummary:
    """One drive and how much of it was used.

    Attributes:
        source: name of its file.
        sha256: of its values.
        ground: that it was on.
        seconds: under known commands.
        used_seconds: that the joint fit used.
        judged_seconds: that were forecast when it was left out.
        pose_lateness: by which its poses come behind the gyro [s]; 0 where that is not known.
        notes: sentences on what was mended or left out.
        lateness_interval: 99 % interval of the poses' lateness [s]; null where that is not known.
    """

    source: str
    sha256: str
    ground: str
    seconds: float
    used_seconds: float
    judged_seconds: float
    pose_lateness: float
    notes: tuple[str, ...]
    lateness_interval: tuple[float, float] | None = None


@dataclass(frozen=True)
class PartDecision:
    """Whether the drives support a part of the robot.

    Attributes:
        name: of :data:`ddagr_gym.calibration.parts.PARTS`.
        kept: whether it is in the calibrated robot.
        growth: relative growth of the forecasts' loss without it, mean over left-out drives [-].
        error: standard error of that growth between drives [-].
    """

    name: str
    kept: bool
    growth: float
    error: float


@dataclass(frozen=True)
class DriveEstimate:
    """What one drive says about a parameter.

    Attributes:
        drive: name of its file.
        ground: that it was on.
        value: estimate, as the parameter's own value.
        deviation: of it, from the drive alone; null where the drive says nothing.
    """

    drive: str
    ground: str
    value: float
    deviation: float | None


@dataclass(frozen=True)
class Scatter:
    """How much a parameter differs between drives (random effects).

    Attributes:
        drives: number of drives that say something.
        same_ground: standard deviation between drives on the same ground; null without two on one.
        other_grounds: between drives on whatever ground; null below two drives.
        same_ground_degrees: of freedom of the first.
        other_grounds_degrees: of freedom of the second.
    """

    drives: int
    same_ground: float | None
    other_grounds: float | None
    same_ground_degrees: int
    other_grounds_degrees: int


@dataclass(frozen=True)
class CalibratedParameter:
    """One parameter of the robot, of its sensors and commands, or of the soil of a ground.

    Attributes:
        name: identifier; of a soil with its ground behind a slash.
        part: of the robot that it belongs to; "soil" for soils.
        ground: that it belongs to; "" for the robot.
        unit: of the values; "-" for factors.
        data_sheet: value before; null where that says nothing, as of most limits.
        expected: value that the fit began with: the data sheet's, or a likely one for a robot of this size.
        expected_deviation: of that.
        value: calibrated, the data sheet's where it is not calibrated; null where that says nothing.
        interval: 90 %, between drives where there are several; null where it is not calibrated.
        calibrated: whether the drives determine it.
        reason: why not, in a sentence; "" where it is.
        helps: drive that would determine it; "" where it is.
        change: what the fit moves: a logarithm of a factor, or a difference in the unit.
        deviation: of that, within drives.
        scatter: of that, between drives.
        estimates: of that, by drive.
    """

    name: str
    part: str
    ground: str
    unit: str
    data_sheet: float | None
    expected: float
    expected_deviation: float
    value: float | None
    interval: tuple[float, float] | None
    calibrated: bool
    reason: str
    helps: str
    change: float
    deviation: float | None
    scatter: Scatter
    estimates: tuple[DriveEstimate, ...]

    @property
    def deviation_elsewhere(self) -> float:
        """Deviation of a change in a further drive: what is uncertain of the mean, and what differs between drives.

        Where a single drive says nothing of the latter, it counts as much as the former.
        """
        within, between = self.deviation or 0.0, self.scatter.other_grounds
        return math.hypot(within, within if between is None else between)


@dataclass(frozen=True)
class Covariance:
    """Covariance, within drives, of what the fit moved.

    Attributes:
        names: (P,) of the parameters.
        matrix: (P, P).
    """

    names: tuple[str, ...]
    matrix: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class ForecastError:
    """Error of a model on a drive that its parameters were not fitted to.

    Attributes:
        drive: that was left out.
        ground: that it was on.
        soil_from: other drives on that ground, or the first half of the drive itself.
        model: of :data:`MODELS`.
        metric: heading, position, wheel_speed or yaw_rate.
        horizon: time from the start of the forecast [s]; null for all samples of the windows.
        unit: of the error.
        count: windows, or samples.
        rms: root mean square; null where nothing measures it.
        rms_interval: 95 % by resampling windows.
        median: of the absolute error.
        median_interval: the same.
    """

    drive: str
    ground: str
    soil_from: str
    model: str
    metric: str
    horizon: float | None
    unit: str
    count: int
    rms: float | None
    rms_interval: tuple[float, float] | None
    median: float | None
    median_interval: tuple[float, float] | None


@dataclass(frozen=True)
class Spectrum:
    """Power spectral density of what the calibrated simulator leaves of a channel, over all left-out drives.

    Attributes:
        channel: of the recordings.
        unit: of the channel.
        frequency: (F,) [Hz].
        before: (F,) of the data sheet's residual [unit^2/Hz].
        after: (F,) of the calibrated simulator's.
    """

    channel: str
    unit: str
    frequency: tuple[float, ...]
    before: tuple[float, ...]
    after: tuple[float, ...]


@dataclass(frozen=True)
class Unexplained:
    """What is left of a channel under one condition, on left-out drives.

    Attributes:
        channel: of the recordings; both encoders together are wheel_speed.
        condition: in words.
        share: of the channel's whole squared residual [-].
        time: share of the samples [-].
        rms: residual under the condition.
        noise: of the sensor with vibration.
    """

    channel: str
    condition: str
    share: float
    time: float
    rms: float
    noise: float


@dataclass(frozen=True)
class CurrentConstant:
    """An unknown constant between the torque of the motors and their measured current.

    Attributes:
        name: identifier.
        unit: of the value.
        value: fitted.
        deviation: standard deviation of it inside the drives.
    """

    name: str
    unit: str
    value: float
    deviation: float


@dataclass(frozen=True)
class CurrentError:
    """How well the current of a bank of a left-out drive was forecast.

    Attributes:
        drive: name of the drive, or of its part.
        bank: right or left.
        count: of samples.
        measured: root mean square of the measured current about its mean [A].
        left: root mean square of measured less forecast [A].
    """

    drive: str
    bank: str
    count: int
    measured: float
    left: float


@dataclass(frozen=True)
class CurrentEvidence:
    """Currents of the motors as a calibration used them.

    Attributes:
        kind: "motor" for the motors' own current, "supply" for what they draw.
        constants: that were fitted with robot and grounds.
        errors: on left-out drives.
    """

    kind: str
    constants: tuple[CurrentConstant, ...]
    errors: tuple[CurrentError, ...]


@dataclass(frozen=True)
class Calibration:
    """The whole answer.

    Attributes:
        schema: name of this format.
        schema_version: of it.
        program: version of ddagr-gym.
        robot: name of it.
        data_sheet: name or file of the robot before.
        soils: nominal soil by ground, name or file.
        drives: that were given.
        window: length of the windows [s].
        parts: decisions on them.
        parameters: of the robot, then of the grounds.
        covariance: of what the fit moved.
        forecasts: errors on left-out drives.
        spectra: of their residuals.
        unexplained: where the residuals are.
        converged: whether the joint fit settled.
        seed: of resampled intervals.
        seconds: that this run took, without the steps that an earlier one had finished.
        currents: of the motors; None, and not in the file, where none was used.
        imu: how the IMU is mounted; None where its accelerometer was read in fewer than two drives, or quarters of one.
        slopes: of the grounds that surely slope; the others are taken to be level.
    """

    schema: str
    schema_version: int
    program: str
    robot: str
    data_sheet: str
    soils: Mapping[str, str]
    drives: tuple[DriveSummary, ...]
    window: float
    parts: tuple[PartDecision, ...]
    parameters: tuple[CalibratedParameter, ...]
    covariance: Covariance
    forecasts: tuple[ForecastError, ...]
    spectra: tuple[Spectrum, ...]
    unexplained: tuple[Unexplained, ...]
    converged: bool
    seed: int
    seconds: float
    currents: CurrentEvidence | None = None
    imu: ImuMounting | None = None
    slopes: tuple[SlopeOfGround, ...] = ()

    def parameter(self, name: str) -> CalibratedParameter:
        """Parameter by name; KeyError where there is none."""
        return {item.name: item for item in self.parameters}[name]

    @property
    def grounds(self) -> tuple[str, ...]:
        """Names of the grounds."""
        return tuple(self.soils)

    @property
    def calibrated(self) -> tuple[str, ...]:
        """Names of the parameters that the drives determine."""
        return tuple(item.name for item in self.parameters if item.calibrated)

    @property
    def refused(self) -> tuple[str, ...]:
        """Names of the parameters that keep their value."""
        return tuple(item.name for item in self.parameters if not item.calibrated)
