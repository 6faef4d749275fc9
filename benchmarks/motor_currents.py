"""What motor currents are worth to a calibration: on simulated drives, and on a real one that carries them.

    python -m benchmarks.motor_currents [--recordings FOLDER] [--summary]

Simulated (:mod:`benchmarks.motor_current_drives`): drives of two minutes, each of a Warthog and on a soil of its own,
are fitted without currents, with what the motors draw from their supply at 1 Hz (as a real Warthog logs it), and with
the motors' own current at 10 Hz. All constants of the currents are unknown to the fit. Compared are the deviations that
the fit states, its errors, and how often 90 % intervals hold the truth.

Real: the grass drive of ``FOLDER/open`` (by default ``shared/recordings``) is fitted with and without its currents in
quarters, and the quarter that was left out is forecast.

Written are ``benchmarks/results/motor_currents.json`` and ``.png``; a run goes on after the drives that the file holds.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.motor_current_drives import ROBOT, SOIL, true_drive
from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.current_evidence import current_evidence
from ddagr_gym.calibration.forecast_errors import all_forecasts
from ddagr_gym.calibration.identifiability import covariance
from ddagr_gym.calibration.joint_fit import FittedModel, complete_model, weigh_and_fit
from ddagr_gym.calibration.left_out import forecasts
from ddagr_gym.calibration.parts import first_values
from ddagr_gym.calibration.result import CALIBRATED
from ddagr_gym.calibration.run import ready_drives
from ddagr_gym.calibration.settings import CalibrationSettings
from ddagr_gym.evaluation.statistics import wilson_interval
from ddagr_gym.files import write_json
from ddagr_gym.identification.motor_currents import without_currents
from ddagr_gym.identification.residual_weights import Weights
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.checks.currents import CurrentKind
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.recordings.load import load_recording
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.rendering import palette
from ddagr_gym.replay_analysis.horizons import horizon_errors
from ddagr_gym.reporting.figures import house_style

RESULT = Path(__file__).resolve().parent / "results" / "motor_currents.json"
GROUND = "ground"
DRIVES = 10
RATES = {CurrentKind.SUPPLY: 1.0, CurrentKind.MOTOR: 10.0}
"""At which currents come [Hz]."""
WITHOUT = "without"
QUANTILE = 1.645
"""Of a normal variable: half of a 90 % interval."""
ABSENT = frozenset((
    "no_load_speed", "torque_limit", "integral_limit", "limit_imbalance", "command_ramp", "mean_ramp", "turning_ramp",
    "command_filter", "power_limit", "speed_limit",
))  # fmt: skip
"""Parts that the simulated robots do not have and that no fit of them asks for."""
SHOWN = (
    "soil_strength", "soil_stiffness", "shear_modulus", "mass", "motor_rate", "integral_rate", "load_compliance",
    "viscous_rate", "coulomb_friction",
)  # fmt: skip
REAL = "open/warthog_grass.csv.gz"
HORIZON = 5.0
"""Of the forecasts of the real drive [s]."""

Array = NDArray[np.float64]


def ready(recording: Recording, fitted: int) -> CalibrationData:
    """A drive ready to be fitted, with its currents."""
    settings = CalibrationSettings(fitted=fitted, supply_currents=True)
    return ready_drives([recording], [GROUND], get_robot(ROBOT), {GROUND: get_soil(SOIL)}, settings)


def no_currents(data: CalibrationData) -> CalibrationData:
    """The same without currents."""
    return replace(data, currents=None, windows=without_currents(data.windows))


def fitted_to(data: CalibrationData, count: int, absent: frozenset[str]) -> tuple[FittedModel, Weights]:
    """Fit of all parts but the absent ones to at most ``count`` windows."""
    complete, held = complete_model(data)
    model = complete.without(absent, data.robot)
    return weigh_and_fit(data, data.spread(count), model, {**held, **first_values(model.parameters)}, 1)


def simulated_answer(seed: int) -> dict[str, Any]:
    """Values and deviations of a drive by each set of readings, beside the truth."""
    found: dict[str, Any] = {"seed": seed, "fits": {}}
    for kind, rate in RATES.items():
        drive = true_drive(seed, kind, current_rate=rate)
        data = ready(drive.recording, 12)
        found["truth"] = drive.truth
        found["fits"][str(kind)] = _values(data)
        if WITHOUT not in found["fits"]:
            found["fits"][WITHOUT] = _values(no_currents(data))
    return found


def _values(data: CalibrationData) -> dict[str, Any]:
    began = time.monotonic()
    model, _ = fitted_to(data, 12, ABSENT)
    deviation = dict(zip(model.free, np.sqrt(np.diag(covariance(model))).tolist(), strict=True))
    names = {name: name if name in deviation else f"{name}_{GROUND}" for name in SHOWN}
    values = {name: [model.values[own], deviation[own]] for name, own in names.items()}
    return {"values": values, "converged": model.fitted.converged, "seconds": round(time.monotonic() - began, 1)}


def simulated_summary(answers: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """By parameter and readings: median deviation, r.m.s. and median error, and how often intervals hold the truth."""
    found: dict[str, Any] = {}
    for fit in (WITHOUT, *map(str, RATES)):
        errors = {name: np.array([item["fits"][fit]["values"][name] for item in answers]) for name in SHOWN}
        truth = {name: np.array([item["truth"][name] for item in answers]) for name in SHOWN}
        inside = {n: np.abs(errors[n][:, 0] - truth[n]) <= QUANTILE * errors[n][:, 1] for n in SHOWN}
        held = int(sum(v.sum() for v in inside.values()))
        asked = sum(v.size for v in inside.values())
        share = wilson_interval(held, asked)
        found[fit] = {
            "parameters": {
                name: {
                    "deviation": float(np.median(errors[name][:, 1])),
                    "error": float(np.sqrt(np.mean((errors[name][:, 0] - truth[name]) ** 2))),
                    "median": float(np.median(np.abs(errors[name][:, 0] - truth[name]))),
                    "held": int(inside[name].sum()),
                }
                for name in SHOWN
            },
            "held": [held, asked],
            "coverage": [share.low, share.high],
        }
    return found


def real_answer(folder: Path, seed: int = 0) -> dict[str, Any]:
    """Forecasts of left-out quarters of the real drive with and without its currents."""
    data = ready(load_recording(folder / REAL, robot=ROBOT), 30)
    found: dict[str, Any] = {"source": Path(REAL).name}
    errors = {}
    for name, chosen in (("with", data), (WITHOUT, no_currents(data))):
        model, weights = fitted_to(chosen, 30, frozenset())
        _, held = complete_model(chosen)
        made = tuple(forecasts(chosen, model, chosen.spread(100), weights, 1))
        compared = all_forecasts(chosen, model, made, held, 1)
        samples = round(HORIZON / data.prepared.period)
        errors[name] = {metric: [] for metric in ("heading", "position", "wheel_speed")}
        for item in compared:
            short = replace(
                item.windows,
                measured=item.windows.measured[:, :samples],
                speeds=item.windows.speeds[:, : item.windows.history + samples],
            )
            own = horizon_errors(short, item.predictions[CALIBRATED][:, :samples])
            for metric, values in errors[name].items():
                values.append(own[metric])
        deviation = dict(zip(model.free, np.sqrt(np.diag(covariance(model))).tolist(), strict=True))
        shown = {n: n if n in deviation else f"{n}_{GROUND}" for n in SHOWN}
        found[name] = {n: [model.values[own], deviation[own]] for n, own in shown.items()}
        evidence = current_evidence(chosen, model, compared)
        if evidence is not None:
            found["constants"] = {c.name: [c.value, c.deviation, c.unit] for c in evidence.constants}
            found["current_errors"] = [[e.drive, e.bank, e.count, e.measured, e.left] for e in evidence.errors]
    found["forecasts"] = {
        metric: _ratio(*(np.concatenate(errors[n][metric]) for n in ("with", WITHOUT)), np.random.default_rng(seed))
        for metric in errors["with"]
    }
    return found


def _ratio(with_: Array, without: Array, rng: np.random.Generator) -> dict[str, Any]:
    """Root mean square errors with and without currents, and their ratio with a 90 % interval over windows."""
    known = np.isfinite(with_) & np.isfinite(without)
    squares = np.stack([with_[known] ** 2, without[known] ** 2])
    drawn = squares[:, rng.integers(0, squares.shape[1], (2000, squares.shape[1]))].mean(axis=2)
    low, high = np.quantile(np.sqrt(drawn[0] / drawn[1]), [0.05, 0.95])
    size = np.sqrt(squares.mean(axis=1))
    return {
        "windows": int(known.sum()), "with": float(size[0]), "without": float(size[1]),
        "ratio": float(size[0] / size[1]), "interval": [float(low), float(high)],
    }  # fmt: skip


def save_figure(content: dict[str, Any], path: Path) -> None:
    """Deviations and errors of each parameter with currents over those without."""
    from matplotlib.figure import Figure

    summary = content["summary"]
    plain = summary[WITHOUT]["parameters"]
    with house_style():
        figure = Figure(figsize=(7.4, 3.6), layout="constrained")
        panels = figure.subplots(1, 2, sharey=True)
        for axis, key, title in zip(panels, ("deviation", "median"), ("stated deviation", "median error"), strict=True):
            axis.axvline(1.0, color=palette.GREY, lw=0.8)
            for shift, kind, colour in ((0.15, "supply", palette.VERMILLION), (-0.15, "motor", palette.BLUE)):
                ratio = [summary[kind]["parameters"][name][key] / plain[name][key] for name in SHOWN]
                rows = np.arange(len(SHOWN))[::-1] + shift
                label = f"{kind} current, {RATES[CurrentKind(kind)]:g} Hz"
                axis.plot(ratio, rows, "o", ms=5, color=colour, label=label)
            axis.set_xlabel(f"{title}, with over without currents")
            axis.set_xlim(left=0.0)
        panels[0].set_yticks(range(len(SHOWN)), [name.replace("_", " ") for name in reversed(SHOWN)])
        figure.legend(*panels[0].get_legend_handles_labels(), ncols=2, loc="outside upper left")
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=160, metadata={"Software": None}))


def main() -> None:
    """Run what is missing, and write the summary."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.motor_currents")
    parser.add_argument("--recordings", type=Path, default=Path("shared/recordings"))
    parser.add_argument("--summary", action="store_true", help="only summarise what is there")
    arguments = parser.parse_args()
    content: dict[str, Any] = json.loads(RESULT.read_text()) if RESULT.is_file() else {"simulated": []}
    done = {item["seed"] for item in content["simulated"]}
    if not arguments.summary:
        if "real" not in content:
            content["real"] = real_answer(arguments.recordings)
            write_json(RESULT, content)
        for seed in (s for s in range(DRIVES) if s not in done):
            content["simulated"].append(simulated_answer(seed))
            print(f"drive {seed + 1} of {DRIVES}", flush=True)
            write_json(RESULT, content)
    content["summary"] = simulated_summary(content["simulated"])
    write_json(RESULT, content)
    save_figure(content, RESULT.with_suffix(".png"))


if __name__ == "__main__":
    main()
