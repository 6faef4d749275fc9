"""Calibrate a Warthog with its ordinary drives and forecast each of them from the others, beside other models.

    python -m benchmarks.real_drives [--threads 2] [--cache FOLDER] [--calibration FOLDER] [--bank] [--output FOLDER]

Six ordinary drives of NorLab's Warthog are read from ``shared/recordings``: two on asphalt, two on sand, one on grass
and one on gravel (its gyro has the wrong sign, which the calibration finds and turns). The soil of grass and gravel is
fitted to the first half of the drive, the second half is forecast. Writes ``real_drives.json`` and ``real_drives.png``.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.real_drives.compare import (
    BY_COMMANDS,
    CALIBRATED_BY_SPEEDS,
    LATENESS_KNOWN,
    LEARNED,
    TRACK_BY_SPEEDS,
    Compared,
    compare,
    errors_of,
    gain_share,
    ratio_of,
)
from benchmarks.real_drives.figure import draw
from ddagr_gym import calibrate
from ddagr_gym.api.calibrate import CalibrationResult
from ddagr_gym.calibration.result import CALIBRATED, DATA_SHEET, KINEMATIC
from ddagr_gym.commands.output import make_folder, write_text
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.version import __version__

CHECKOUT = Path(__file__).resolve().parents[2]
RESULTS = CHECKOUT / "benchmarks" / "results"
DRIVES = {
    "open/warthog_asphalt": ("asphalt", "drive_steps"),
    "concealed/warthog_2": ("asphalt", "drive_steps"),
    "open/warthog_sand": ("sand", "drive_steps"),
    "concealed/warthog_5": ("sand", "drive_steps"),
    "concealed/warthog_4": ("gravel", "drive_steps"),
    "open/warthog_grass": ("grass", "drive_continuous"),
}
"""Ground and column map by file below ``shared/recordings``."""

SOILS = {"asphalt": "firm_ground", "sand": "lete_sand_wong", "gravel": "firm_ground", "grass": "firm_ground"}
"""Nominal soil of each ground; the calibration fits it."""

HORIZON = 5.0  # [s] of the aims
AIMS = (
    ("calibrated over calibrated by wheel speeds", CALIBRATED, CALIBRATED_BY_SPEEDS, 1.5),
    ("calibrated over effective track with delay and lag", CALIBRATED, KINEMATIC, 0.8),
    ("lateness of each command known, over calibrated by wheel speeds", LATENESS_KNOWN, CALIBRATED_BY_SPEEDS, 1.5),
    ("by wheel speeds: calibrated over effective track", CALIBRATED_BY_SPEEDS, TRACK_BY_SPEEDS, 1.0),
)
"""Name, model, baseline, and the largest ratio of their root mean square heading errors that is aimed at."""


def recordings_folder() -> Path:
    """Folder of the real drives."""
    shared = Path(os.environ.get("DDAGR_SHARED") or CHECKOUT.parent / "shared")
    folder = shared / "recordings"
    if not folder.is_dir():
        sys.exit(f"no recordings at {folder}: set DDAGR_SHARED to the folder that holds them.")
    return folder


def aims_of(item: Compared, seed: int, horizon: float = HORIZON) -> dict[str, Any]:
    """What the drive shows of each aim."""
    found: dict[str, Any] = {}
    for name, model, baseline, most in AIMS:
        ratio = ratio_of(item, model, baseline, horizon, seed)
        if ratio is not None:
            found[name] = {**ratio, "aim": most, "met": ratio["ratio"] <= most}
    share = gain_share(item, CALIBRATED, LEARNED, DATA_SHEET, horizon, seed)
    if share is not None:
        found["share of the learned model's gain"] = {**share, "aim": 0.8, "met": share["ratio"] >= 0.8}
    return found


def main(arguments: list[str] | None = None) -> None:
    """Calibrate, forecast, compare, write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cache", type=Path, help="folder of finished steps, to go on after an interruption")
    parser.add_argument("--calibration", type=Path, help="folder for the calibration itself, as of `ddagr calibrate`")
    parser.add_argument("--bank", action="store_true", help="with the bank that benchmarks.what_changed needs")
    parser.add_argument("--output", type=Path, default=RESULTS)
    given = parser.parse_args(arguments)
    folder = make_folder(given.output)
    went_on = given.cache is not None and given.cache.exists()
    result = calibrated_drives(given.threads, given.seed, given.cache, given.bank)
    if given.calibration is not None:
        result.report(given.calibration)
    outcome = result.outcome
    compared = []
    for item in outcome.forecasts:
        print(f"models beside it: {item.drive}", flush=True)
        compared.append(compare(outcome, item, given.seed))
    rows = [row for item in compared for row in errors_of(item, given.seed)]
    answer = outcome.calibration
    results = {
        "version": __version__,
        # of one that went on after an interruption it is not known how long all of it took
        "seconds_of_calibration": None if went_on else round(answer.seconds, 1),
        "parameters": [
            {"name": p.name, "value": p.value, "data_sheet": p.data_sheet, "unit": p.unit, "calibrated": p.calibrated}
            for p in answer.parameters
        ],
        "parts": [{"name": p.name, "kept": p.kept, "growth": p.growth, "error": p.error} for p in answer.parts],
        "aims": {item.drive: aims_of(item, given.seed) for item in compared},
        "lateness": {item.drive: item.lateness.figures for item in compared if item.lateness is not None},
        "errors": rows,
    }
    write_text(folder / "real_drives.json", json.dumps(results, indent=1, default=_plain) + "\n")
    draw(rows, folder / "real_drives.png")
    for drive, aims in results["aims"].items():
        for name, value in aims.items():
            print(f"{drive}: {name}: {value['ratio']:.2f} (aim {value['aim']}{', met' if value['met'] else ''})")
    print(f"written: {folder / 'real_drives.json'} and real_drives.png; models by commands: {', '.join(BY_COMMANDS)}")


def load_drives() -> list[Recording]:
    """Recordings of the ordinary drives, in the order of DRIVES."""
    from ddagr_gym import load_recording

    folder = recordings_folder()
    return [
        load_recording(folder / f"{name}.csv.gz", column_map=column_map, robot="warthog")
        for name, (_, column_map) in DRIVES.items()
    ]


def calibrated_drives(threads: int, seed: int, cache: Path | None, bank: bool = False) -> CalibrationResult:
    """The robot as the ordinary drives show it.

    Args:
        threads: of the simulator.
        seed: of resampled intervals.
        cache: folder of finished steps; None keeps nothing.
        bank: whether every drive is also scanned for every effect of the library.
    """
    grounds: dict[str, list[int]] = {}
    for number, (ground, _) in enumerate(DRIVES.values()):
        grounds.setdefault(ground, []).append(number)
    return calibrate(
        load_drives(), robot="warthog", soil=SOILS, grounds=grounds, seed=seed, threads=threads, cache=cache,
        bank=bank, progress=lambda line: print(line, flush=True),
    )  # fmt: skip


def _plain(value: object) -> object:
    """JSON of what numpy leaves behind."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{value!r} is no JSON value")


if __name__ == "__main__":
    main()
