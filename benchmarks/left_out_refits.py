"""Forecasts of left-out drives by one Gauss-Newton step, as calibrations make them, beside those by fits of their own.

    python -m benchmarks.left_out_refits [--threads 2] [--cache FOLDER] [--output FILE]

A calibration takes the fit without a drive to be one step from the fit of all. Here the parts that were selected are
fitted to the other drives of :mod:`benchmarks.real_drives`, until the fit is settled, and forecast the same windows.
Third comes the fit of all drives, which has seen them.
Writes ``left_out_refits.json`` and ``left_out_refits.png``: medians of the wheel speeds' errors over all samples, with
95 % intervals over windows.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.real_drives.__main__ import calibrated_drives
from ddagr_gym.calibration.joint_fit import FittedModel
from ddagr_gym.calibration.left_out import ENCODERS, Forecast, forecasts, refitted_without, values_without
from ddagr_gym.calibration.run import Outcome
from ddagr_gym.calibration.settings import CalibrationSettings
from ddagr_gym.files import write_json
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.replay_analysis.horizons import sample_errors
from ddagr_gym.replay_analysis.intervals import error_statistics
from ddagr_gym.reporting.figures import house_style

Array = NDArray[np.float64]
Booleans = NDArray[np.bool_]

RESULT = Path(__file__).resolve().parent / "results" / "left_out_refits.json"


def as_fitted(model: FittedModel, out: Booleans) -> Array:
    """Values (P,) of the fit of all drives."""
    return model.fitted.point.values


FITS: dict[str, Callable[[FittedModel, Booleans], Array]] = {
    "all drives": as_fitted, "one step without it": values_without, "fitted without it": refitted_without,
}  # fmt: skip
COLOURS = {"all drives": palette.PALE, "one step without it": palette.BLUE, "fitted without it": palette.GREEN}


def forecasts_by(outcome: Outcome, name: str, settings: CalibrationSettings) -> list[Forecast]:
    """Forecasts of every drive by one of the fits.

    Args:
        outcome: of a calibration.
        name: of the fit, one of :data:`FITS`.
        settings: windows that are forecast, and threads.
    """
    data, judged = outcome.data, outcome.data.spread(settings.judged)
    return list(forecasts(data, outcome.model, judged, outcome.weights, settings.threads, FITS[name]))


def row_of(outcome: Outcome, name: str, forecast: Forecast, seed: int) -> dict[str, Any]:
    """Median error of the wheel speeds of one forecast [rad/s] with its 95 % interval."""
    windows = forecast.windows
    errors, clusters = sample_errors(windows, forecast.prediction, ENCODERS)
    found = error_statistics(errors, clusters, np.random.default_rng(seed))
    return {
        "drive": outcome.data.names[int(windows.recording[0])], "fit": name, "count": found.count,
        "median": found.median, "interval": found.median_interval,
    }  # fmt: skip


def draw(rows: Sequence[dict[str, Any]], path: Path) -> None:
    """Medians by drive and fit."""
    from matplotlib.figure import Figure

    drives = list(dict.fromkeys(row["drive"] for row in rows))
    with house_style():
        figure = Figure(figsize=(7.5, 3.6), layout="constrained")
        panel = figure.subplots()
        for number, name in enumerate(FITS):
            chosen = [row for row in rows if row["fit"] == name]
            at = [drives.index(row["drive"]) + 0.26 * (number - 1) for row in chosen]
            low, high = (np.array([abs(r["median"] - r["interval"][k]) for r in chosen]) for k in (0, 1))
            panel.bar(at, [row["median"] for row in chosen], 0.24, yerr=[low, high], color=COLOURS[name], label=name)
        panel.set_xticks(range(len(drives)), [drive.removesuffix(".csv.gz").replace("_", " ") for drive in drives])
        panel.set_ylabel("median error of wheel speeds [rad/s]")
        panel.margins(y=0.3)
        panel.legend(title="forecast by the fit of", ncols=len(FITS), loc="upper center")
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=120))


def main(arguments: Sequence[str] | None = None) -> int:
    """Calibrate, fit without each drive, compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cache", type=Path, help="folder of finished steps, as of benchmarks.real_drives")
    parser.add_argument("--output", type=Path, default=RESULT)
    given = parser.parse_args(arguments)
    outcome = calibrated_drives(given.threads, given.seed, given.cache).outcome
    settings = CalibrationSettings(threads=given.threads, seed=given.seed)
    rows = []
    for name in FITS:
        print(f"forecasts by: {name}", flush=True)
        rows += [row_of(outcome, name, item, given.seed) for item in forecasts_by(outcome, name, settings)]
    write_json(given.output, {"command": "python -m benchmarks.left_out_refits", "rows": rows})
    draw(rows, given.output.with_suffix(".png"))
    for row in rows:
        print(f"{row['drive']}, {row['fit']}: {row['median']:.3f} {np.round(row['interval'], 3).tolist()} rad/s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
