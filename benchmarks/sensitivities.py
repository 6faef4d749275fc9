"""Sensitivities of fits to real drives: simulated anew, and following a recorded simulation; how right, how fast.

    python -m benchmarks.sensitivities [--windows 6] [--threads 1]

A fit asks how the readings of windows change with every parameter and with the speeds at their start. Each such
sensitivity is the difference of two simulations: both made anew, or the second one extrapolating the wheel forces that
the first one recorded (:mod:`ddagr_gym.physics.force_record`). Both ways stand here beside differences of accurate
simulations, on windows of the six ordinary Warthog drives, at the values at which a calibration begins. Errors are root
mean squares over a window's encoder, gyro and accelerometer readings, over those of the accurate sensitivity.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.real_drives.__main__ import DRIVES, SOILS, load_drives
from ddagr_gym.api.nominal import robot_from, soil_from
from ddagr_gym.calibration.calibration_data import CalibrationData
from ddagr_gym.calibration.joint_fit import complete_model
from ddagr_gym.calibration.parts import DATA_SHEET_PARTS, RobotModel, first_values
from ddagr_gym.calibration.run import ready_drives
from ddagr_gym.calibration.settings import CalibrationSettings
from ddagr_gym.files import write_json
from ddagr_gym.identification.fit_numerics import field_numerics, field_slope_numerics
from ddagr_gym.identification.window_model import STATE_STEPS, WindowModel
from ddagr_gym.identification.windows import STATE, WindowSet
from ddagr_gym.parameters import Numerics
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

Array = NDArray[np.float64]
RESULT = Path(__file__).resolve().parent / "results" / "sensitivities.json"
SPEEDS = range(3, 8)
"""Of the body and of the wheels, among STATE."""
CHANNELS = slice(0, 5)
"""Specific forces, yaw rate and wheel speeds."""
ACCURATE = replace(field_numerics(), maximum_step=0.005, contact_nodes=5, jacobian_refresh=0.0, launch_change=0.02)
WAYS: dict[str, tuple[Numerics, bool]] = {
    "anew, steps of 25 ms": (field_numerics(), False),
    "anew, steps of 50 ms": (field_slope_numerics(), False),
    "following, steps of 25 ms": (field_numerics(), True),
    "following, steps of 50 ms": (field_slope_numerics(), True),
}


@dataclass(frozen=True, eq=False)
class Setup:
    """What is varied, and where.

    Attributes:
        data: drives with their nominal robot and soils.
        windows: of them.
        model: robot and parameters.
        values: (P,) of the parameters.
        varied: indices of those that a fit moves and that need simulations.
        threads: of the simulator.
    """

    data: CalibrationData
    windows: WindowSet
    model: RobotModel
    values: Array
    varied: tuple[int, ...]
    threads: int

    @classmethod
    def of(cls, windows: int, threads: int) -> Setup:
        """The six ordinary Warthog drives, with so many windows of each."""
        grounds = [ground for ground, _ in DRIVES.values()]
        soils = {ground: soil_from(SOILS[ground]) for ground in dict.fromkeys(grounds)}
        data = ready_drives(load_drives(), grounds, robot_from("warthog"), soils, CalibrationSettings(threads=threads))
        complete, held = complete_model(data)
        model = complete.without(DATA_SHEET_PARTS, data.robot)
        begun = held | first_values(model.parameters)
        values = np.array([begun.get(parameter.name, 0.0) for parameter in model.parameters])
        moved = [k for k, p in enumerate(model.parameters) if p.prior > 0.0 and not p.name.startswith("gyro_bias")]
        return cls(data, data.spread(windows), model, values, tuple(moved), threads)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the speeds at the start, and of the parameters."""
        speeds = tuple(f"{STATE[k]} at the start" for k in SPEEDS)
        return (*speeds, *(self.model.parameters[k].name for k in self.varied))

    def sensitivities(self, numerics: Numerics, follow: bool) -> tuple[Array, float]:
        """(K, W, T, 5), and the seconds of CPU that they took."""
        soil = next(iter(self.data.soils.values()))
        model = WindowModel(
            self.model.robot, soil, self.windows, self.model.parameters, numerics=numerics, threads=self.threads
        )
        states, began = self.windows.initial, time.process_time()
        near = model.reference(self.values, states) if follow else None
        base = model.predict(self.values, states) if near is None else near.prediction
        found = []
        for k in SPEEDS:
            moved = states.copy()
            moved[:, k] += STATE_STEPS[k]
            found.append((model.predict(self.values, moved, near=near) - base) / STATE_STEPS[k])
        for k in self.varied:
            values, step = self.values.copy(), self.model.parameters[k].step
            values[k] += step
            found.append((model.predict(values, states, near=near) - base) / step)
        return np.stack(found)[..., CHANNELS], time.process_time() - began


def errors(found: Array, accurate: Array) -> Array:
    """(K, W) error of sensitivities over the accurate ones, root mean square; NaN where nothing changes."""
    away = np.sqrt(((found - accurate) ** 2).mean(axis=(2, 3)))
    size = np.sqrt((accurate**2).mean(axis=(2, 3)))
    return np.asarray(away / np.where(size > 0.0, size, np.nan))


def compare(setup: Setup) -> dict[str, Any]:
    """Quantiles of the errors over the windows, and seconds, of every way; of what changes any window."""
    for numerics, follow in WAYS.values():
        setup.sensitivities(numerics, follow)  # what is compiled on first use
    accurate, seconds = setup.sensitivities(ACCURATE, False)
    acts = accurate.any(axis=(1, 2, 3))
    names = [name for name, does in zip(setup.names, acts, strict=True) if does]
    table: dict[str, Any] = {"accurate": {"seconds": seconds}}
    for name, (numerics, follow) in WAYS.items():
        found, seconds = setup.sensitivities(numerics, follow)
        off = errors(found[acts], accurate[acts])
        quantiles = np.nanquantile(off, (0.5, 0.9), axis=1)
        table[name] = {
            "seconds": seconds,
            "median": dict(zip(names, quantiles[0].tolist(), strict=True)),
            "ninth in ten": dict(zip(names, quantiles[1].tolist(), strict=True)),
            "of all": {"median": float(np.nanmedian(off)), "ninth in ten": float(np.nanquantile(off, 0.9))},
        }
        print(f"{name}: {seconds:.1f} s, {table[name]['of all']}", flush=True)
    return table


def draw(table: dict[str, Any], path: Path) -> None:
    """Errors of every quantity, and the seconds."""
    from matplotlib.figure import Figure

    names = list(next(iter(table[way] for way in WAYS))["median"])
    colours = (palette.VERMILLION, palette.ORANGE, palette.BLUE, palette.SKY_BLUE)
    with house_style():
        figure = Figure(figsize=(10.0, 1.5 + 0.22 * len(names)), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(3, 1))
        for way, colour in zip(WAYS, colours, strict=True):
            middle = [table[way]["median"][name] for name in names]
            far = [table[way]["ninth in ten"][name] for name in names]
            left.plot(middle, range(len(names)), "o", color=colour, label=way, markersize=5)
            left.plot(far, range(len(names)), "x", color=colour, markersize=5)
        left.set_yticks(range(len(names)), [name.replace("_", " ") for name in names])
        left.set(xscale="log", xlabel="error over the sensitivity: median (dot), ninth in ten (cross) of the windows")
        left.invert_yaxis()
        left.legend(fontsize=7)
        right.barh(list(WAYS), [table[way]["seconds"] for way in WAYS], color=colours)
        right.set_yticks([])
        right.invert_yaxis()
        right.set_xlabel("seconds of CPU of all")
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=120))


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare, write, draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--windows", type=int, default=6, help="of each drive")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--output", type=Path, default=RESULT)
    given = parser.parse_args(arguments)
    table = compare(Setup.of(given.windows, given.threads))
    write_json(given.output, {"command": "python -m benchmarks.sensitivities", "windows": given.windows, "ways": table})
    draw(table, given.output.with_suffix(".png"))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
