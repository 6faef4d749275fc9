"""What a calibration on sloping ground is worth: how small a change ``ddagr diagnose --calibration`` can tell there.

    python -m benchmarks.sloping_grounds [--threads N] [--output benchmarks/results]

A DDAGR is calibrated with four drives of 100 s on a level field, and on one that slopes by 6 %, and asked what changed
in two further drives on each in which nothing did. The drives have headings, commands that are held for 2 to 4 s, and
days of their own (:func:`benchmarks.changes_since.drive`). Written are the slope that was found, the verdicts and the
least change of each effect that would be told (``sloping_grounds.json``, ``.png``). Four minutes of a core a field.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import ddagr_gym
from benchmarks.changes_since import drive
from ddagr_gym.calibration.ordinary_robot import load_ordinary_robot
from ddagr_gym.diagnosis.change.run import what_changed
from ddagr_gym.diagnosis.wording import title
from ddagr_gym.files import make_folder, write_json
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

RESULTS = Path(__file__).resolve().parent / "results"
FIELDS = {"level": "", "sloping by 6 %": "slope=0.06,direction=0.8"}
"""Effect in all drives on each field."""

SECONDS = 100.0
CALIBRATED, ASKED = range(900, 904), range(904, 906)
"""Seeds of the drives that are calibrated with, and of those that are asked about."""

SHOWN = (
    ("payload", "mass"),
    ("soil_change", "strength"),
    ("multipass", "stiffening"),
    ("towed_drag", "force"),
    ("centre_of_mass_offset", "x"),
    ("accelerometer_bias", "x"),
    ("imu_tilt", "roll"),
    ("imu_misalignment", "yaw"),
    ("imu_lever_arm", "x"),
)
"""Effects and fields of the picture: those that gravity bears on."""


def answers(effect: str, threads: int) -> dict[str, Any]:
    """What a calibration on one field says of it, and of drives in which nothing changed.

    Args:
        effect: of the field.
        threads: of the simulator.
    """
    drives = [drive(seed, effect, SECONDS) for seed in CALIBRATED]
    made = ddagr_gym.calibrate(drives, robot="ddagr", soil="thesis_a1", bank=True, threads=threads)
    with tempfile.TemporaryDirectory() as folder:
        made.report(Path(folder) / "calibration")
        ordinary = load_ordinary_robot(Path(folder) / "calibration")
    (ground,) = ordinary.soils
    asked = [what_changed([drive(seed, effect, SECONDS)], ordinary, ground, threads=threads) for seed in ASKED]
    return {
        "slopes": [{"gradient": item.gradient, "deviations": item.deviations} for item in made.calibration.slopes],
        "verdicts": [list(item.diagnosis.verdict) for item in asked],
        "least_detectable": [item.diagnosis.detectable for item in asked],
    }


def least(found: Mapping[str, Any], effect: str, field: str) -> float | None:
    """Largest of the least detectable sizes over the drives; None where one of them would show none."""
    sizes = [item.get(effect, {}).get(field) for item in found["least_detectable"]]
    return None if any(size is None for size in sizes) else max(sizes)


def draw(fields: Mapping[str, Mapping[str, Any]], path: Path) -> None:
    """Least detectable sizes on the sloping field over those on the level one."""
    from matplotlib.figure import Figure

    level, sloping = (fields[name] for name in FIELDS)
    with house_style():
        figure = Figure(figsize=(7.0, 3.6), layout="constrained")
        axes = figure.subplots()
        for place, (effect, field) in enumerate(reversed(SHOWN)):
            sizes = least(level, effect, field), least(sloping, effect, field)
            if sizes[0] is not None and sizes[1] is not None:
                axes.barh(place, sizes[1] / sizes[0], 0.6, color=palette.BLUE)
            else:
                axes.text(0.02, place, "not told on one of them", va="center")
        axes.axvline(1.0, color=palette.INK, lw=0.9)
        axes.set_yticks(range(len(SHOWN)), [f"{title(effect)}, {field}" for effect, field in reversed(SHOWN)])
        axes.set_xlabel("least change that is told on the sloping field, over that on the level one")
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=110))


def main(arguments: Sequence[str] | None = None) -> None:
    """Calibrate, ask, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--output", type=Path, default=RESULTS)
    given = parser.parse_args(arguments)
    folder = make_folder(given.output)
    fields = {}
    for name, effect in FIELDS.items():
        fields[name] = answers(effect, given.threads)
        print(name, fields[name]["slopes"], fields[name]["verdicts"], flush=True)
    write_json(
        folder / "sloping_grounds.json", {"command": "python -m benchmarks.sloping_grounds", "fields": fields}
    )  # fmt: skip
    draw(fields, folder / "sloping_grounds.png")
    for effect, field in SHOWN:
        print(f"{effect} {field}:", *(least(fields[name], effect, field) for name in FIELDS))


if __name__ == "__main__":
    main()
