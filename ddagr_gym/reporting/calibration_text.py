"""A calibration as text: headline and tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ddagr_gym.calibration.accelerometer_results import ImuMounting, SlopeOfGround
from ddagr_gym.calibration.parts import DATA_SHEET_PARTS, PARTS
from ddagr_gym.calibration.result import (
    CALIBRATED,
    DATA_SHEET,
    KINEMATIC,
    MODELS,
    CalibratedParameter,
    Calibration,
    ForecastError,
)
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.reporting.text_table import format_table

PARAMETER_HEADER = ("parameter", "unit", "data sheet", "calibrated", "90 %", "between drives")
"""Of :func:`parameter_rows`."""

MODEL_LABELS = {
    DATA_SHEET: "data sheet",
    CALIBRATED: "calibrated",
    KINEMATIC: "effective track with delay and lag",
}
"""Models in words."""

FORECAST_HEADER = ("left-out drive", "soil from", "error", "unit", *(MODEL_LABELS[name] for name in MODELS))
"""Of :func:`forecast_rows`."""

AS_STATED = "as in the data sheet"
"""Of what was not fitted in the end."""

MEASURES = (
    "Median: of the sizes of the errors, which few large ones do not move; heading and position: root mean square.\n"
    "The headline has the root mean square of the wheel speeds over all samples, in which large errors count most."
)
"""Which measures the table of errors and the headline have."""

PART_HEADER = ("part", "in the model", "forecasts without it are worse by", "standard error")
"""Of :func:`part_rows`."""

MOUNTING_HEADER = ("IMU", "calibrated", "90 %", "unit", "left-out drives are worse without it by", "standard error", "")
"""Of :func:`mounting_rows`."""

SLOPE_HEADER = ("ground", "slopes by [deg]", "rising towards [deg from the x axis]", "as an effect")
"""Of :func:`slope_rows`."""

_MOUNTING = {
    "imu_yaw": "turned about the vertical",
    "imu_x": "place, forward",
    "imu_y": "place, to the left",
    "imu_roll": "tilted, left side up",
    "imu_pitch": "tilted, nose down",
}

SHOWN = (("wheel_speed", None), ("heading", 5.0), ("position", 5.0))
"""Errors of the short table: metric and horizon."""

_TITLES = {part.name: part.title for part in PARTS}


def headline(calibration: Calibration) -> str:
    """What was calibrated with what, and what it is worth."""
    drives, grounds = len(calibration.drives), len(calibration.grounds)
    robot = [item for item in calibration.parameters if not item.ground]
    found = sum(item.calibrated for item in robot)
    first = (
        f"{calibration.robot}: {found} of {len(robot)} parameters of the robot from {drives} "
        f"drive{'s' * (drives > 1)} on {grounds} ground{'s' * (grounds > 1)}"
    )
    share = error_share(calibration, "wheel_speed", None)
    return first + (
        "."
        if share is None
        else "; on left-out drives the root mean square error of the wheel speeds over all samples is "
        f"{100.0 * share:.0f} % of the data sheet's."
    )


def error_share(calibration: Calibration, metric: str, horizon: float | None) -> float | None:
    """Error of the calibrated simulator over the data sheet's, root mean square over left-out drives; None without."""
    chosen = [e for e in calibration.forecasts if (e.metric, e.horizon) == (metric, horizon) and e.rms is not None]
    sums = {
        model: sum(e.rms**2 for e in chosen if e.model == model and e.rms is not None)
        for model in (DATA_SHEET, CALIBRATED)
    }
    return (sums[CALIBRATED] / sums[DATA_SHEET]) ** 0.5 if sums[DATA_SHEET] > 0.0 else None


def parameter_rows(calibration: Calibration) -> list[tuple[str, ...]]:
    """Parameters under :data:`PARAMETER_HEADER`."""
    return [parameter_row(item) for item in calibration.parameters]


def parameter_row(item: CalibratedParameter) -> tuple[str, ...]:
    """One parameter: data sheet, value, interval, and scatter between drives."""
    sheet = "none" if item.data_sheet is None else f"{number(item.data_sheet)} ± {item.expected_deviation:.2g}"
    if item.interval is None or item.value is None:
        return parameter_label(item), unit(item), sheet, AS_STATED, "", ""
    interval = f"{number(item.interval[0])} to {number(item.interval[1])}"
    return parameter_label(item), unit(item), sheet, number(item.value), interval, scatter_text(item)


def parameter_label(item: CalibratedParameter) -> str:
    """Name of a parameter in words."""
    base, _, ground = item.name.partition("/")
    return base.replace("_", " ") + (f", {ground}" if ground else "")


def scatter_text(item: CalibratedParameter) -> str:
    """Deviation between drives, of a factor in percent."""
    size = item.scatter.same_ground if item.ground else item.scatter.other_grounds
    if size is None:
        return "one drive"
    return f"{size:.2g} {item.unit}" if is_difference(item) else f"{100.0 * size:.2g} %"


def is_difference(item: CalibratedParameter) -> bool:
    """Whether the fit adds to a parameter; it multiplies the others."""
    return item.value is not None and abs(item.value - item.expected - item.change) <= 1e-9 * max(abs(item.change), 1.0)


def number(value: float) -> str:
    """Three significant digits."""
    return f"{value:.3g}"


def unit(item: CalibratedParameter) -> str:
    """Unit of a parameter as it is printed."""
    return "" if item.unit == "-" else item.unit


def part_rows(calibration: Calibration) -> list[tuple[str, ...]]:
    """Decisions on parts under :data:`PART_HEADER`."""
    return [
        (
            _TITLES[item.name],
            "yes" if item.kept else AS_STATED if item.name in DATA_SHEET_PARTS else "no",
            f"{100.0 * item.growth:+.1f} %",
            f"{100.0 * item.error:.1f} %",
        )
        for item in calibration.parts
    ]


def mounting_rows(mounting: ImuMounting) -> list[tuple[str, ...]]:
    """How the IMU is mounted, under :data:`MOUNTING_HEADER`."""
    return [
        (
            _MOUNTING[item.name],
            f"{item.value:.3g}" if item.kept else "as stated",
            "" if item.interval is None else f"{item.interval[0]:.3g} to {item.interval[1]:.3g}",
            item.unit,
            "" if item.growth is None else f"{100.0 * item.growth:+.1f} %",
            "" if item.error is None else f"{100.0 * item.error:.1f} %",
            "" if item.kept else f"to determine it: {item.helps}",
        )
        for item in mounting.sizes
    ]


def slope_rows(slopes: Sequence[SlopeOfGround]) -> list[tuple[str, ...]]:
    """Slopes of the grounds, under :data:`SLOPE_HEADER`."""
    rows: list[tuple[str, ...]] = []
    for item in slopes:
        effect = Slope.of_gradient(*item.gradient)
        deviation = math.degrees(math.hypot(*item.deviations) / math.sqrt(2.0))
        angle, direction = math.degrees(effect.angle), math.degrees(effect.direction)
        code = f"slope={effect.angle:.3g},direction={effect.direction:.3g}"
        rows.append((item.ground, f"{angle:.1f} ± {deviation:.1f}", f"{direction:.0f}", code))
    return rows


def forecast_rows(calibration: Calibration, shown: Sequence[tuple[str, float | None]] = SHOWN) -> list[tuple[str, ...]]:
    """Errors on left-out drives under :data:`FORECAST_HEADER`; median of wheel speeds, else root mean square."""
    rows = []
    for drive in dict.fromkeys(item.drive for item in calibration.forecasts):
        for metric, horizon in shown:
            found = {
                item.model: item
                for item in calibration.forecasts
                if (item.drive, item.metric, item.horizon) == (drive, metric, horizon)
            }
            if any(item.count for item in found.values()):
                first = next(iter(found.values()))
                cells = (error_text(found[model]) if model in found else "-" for model in MODELS)
                rows.append((drive, first.soil_from, error_label(metric, horizon), first.unit, *cells))
    return rows


def error_label(metric: str, horizon: float | None) -> str:
    """What an error is of, in words."""
    name = metric.replace("_", " ")
    return f"{name}, median" if horizon is None else f"{name} after {horizon:g} s"


def error_text(item: ForecastError) -> str:
    """Size of an error with its 95 % interval."""
    size, interval = (item.median, item.median_interval) if item.horizon is None else (item.rms, item.rms_interval)
    if size is None:
        return "-"
    return number(size) + ("" if interval is None else f" ({interval[0]:.2g}-{interval[1]:.2g})")


def refused_groups(calibration: Calibration) -> dict[str, list[str]]:
    """By the reason why parameters are as in the data sheet: lines of these and of the drives that would help."""
    groups: dict[str, dict[str, list[str]]] = {}
    for item in calibration.parameters:
        if not item.calibrated:
            groups.setdefault(item.reason, {}).setdefault(item.helps, []).append(parameter_label(item))
    return {
        reason: [f"{', '.join(names)}: {helps}." for helps, names in lines.items()] for reason, lines in groups.items()
    }


def refused_heading(reason: str) -> str:
    """What stands above the parameters that one reason leaves as in the data sheet."""
    return f"As in the data sheet, since of each of them: {reason.rstrip('.')}. Drives that would help:"


def unexplained_rows(calibration: Calibration) -> list[tuple[str, ...]]:
    """Where the residuals of left-out drives are: channel, condition, share of the squares, of the time, size."""
    return [
        (
            item.channel.replace("_", " "),
            item.condition,
            f"{100.0 * item.share:.0f} %",
            f"{100.0 * item.time:.0f} %",
            number(item.rms),
            number(item.noise),
        )
        for item in calibration.unexplained
    ]


UNEXPLAINED_HEADER = ("channel", "where", "share of the squares", "of the samples", "r.m.s. [rad/s]", "noise [rad/s]")
"""Of :func:`unexplained_rows`."""


def summary(calibration: Calibration) -> str:
    """All tables as the command prints them."""
    parts = [headline(calibration)]
    parts += [f"note: {drive.source}: {note}" for drive in calibration.drives for note in drive.notes]
    parts += ["", format_table(PARAMETER_HEADER, parameter_rows(calibration))]
    parts += ["", format_table(PART_HEADER, part_rows(calibration))]
    parts += [] if calibration.imu is None else ["", format_table(MOUNTING_HEADER, mounting_rows(calibration.imu))]
    parts += ["", format_table(SLOPE_HEADER, slope_rows(calibration.slopes))] if calibration.slopes else []
    parts += ["", MEASURES, "", format_table(FORECAST_HEADER, forecast_rows(calibration))]
    parts += ["", format_table(UNEXPLAINED_HEADER, unexplained_rows(calibration))]
    for reason, lines in refused_groups(calibration).items():
        parts += ["", refused_heading(reason), *(f"- {line}" for line in lines)]
    parts += [] if calibration.converged else ["", "The joint fit did not settle: intervals are too narrow."]
    return "\n".join(parts)
