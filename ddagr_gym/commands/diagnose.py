"""``ddagr diagnose``: which physics the nominal simulator leaves out, from recordings."""

from __future__ import annotations

import hashlib
import sys
from dataclasses import dataclass
from pathlib import Path

from tyro.conf import Positional

from ddagr_gym.commands.output import format_table, output_folder
from ddagr_gym.errors import InputError

EXAMPLES = ("ddagr diagnose run_1.csv.gz run_2.csv.gz run_3.csv.gz --thresholds thresholds.json --output diagnosis",)


@dataclass(frozen=True)
class Arguments:
    """Find the physics that a nominal simulator leaves out, from recordings of one robot.

    Attributes:
        runs: recordings; several of one robot are diagnosed together.
        thresholds: of `ddagr null-bank`, made with these or similar drives.
        output: folder for diagnosis.json and effects.json.
        robot: nominal robot.
        soil: nominal soil.
        map: column map, for sources that are not imported yet.
        stride: seconds between the starts of windows; 2 uses all samples.
        seed: of the resampling.
        threads: of the simulator.
        overwrite: replace an output folder that an earlier diagnosis wrote.
    """

    runs: Positional[tuple[Path, ...]]
    thresholds: Path
    output: Path
    robot: str = "ddagr"
    soil: str = "thesis_a1"
    map: str = ""
    stride: float = 2.0
    seed: int = 0
    threads: int = 2
    overwrite: bool = False


def run(arguments: Arguments) -> None:
    """Diagnose, write the files, print the answer."""
    import numpy as np

    from ddagr_gym.diagnosis.diagnose import diagnose
    from ddagr_gym.diagnosis.setting import Setting
    from ddagr_gym.diagnosis.thresholds import load_thresholds
    from ddagr_gym.diagnosis.verdict import save
    from ddagr_gym.physics.effects.files import save_effects
    from ddagr_gym.presets import get_robot, get_soil
    from ddagr_gym.recordings.load import load_recording

    if not arguments.runs:
        raise InputError("no recording is given: name one or more files.")
    thresholds = load_thresholds(arguments.thresholds)
    recordings = [load_recording(path, arguments.map or None, arguments.robot) for path in arguments.runs]
    setting = Setting(stride=arguments.stride, threads=arguments.threads)
    found, effects = diagnose(
        get_robot(arguments.robot),
        get_soil(arguments.soil),
        recordings,
        thresholds,
        np.random.default_rng(arguments.seed),
        setting,
        lambda step: print(f"ddagr diagnose: {step}", file=sys.stderr),
    )
    intervals = [
        {n: e.interval for n, e in finding.parameters.items() if e.interval is not None} for finding in found.findings
    ]
    hashes = hashlib.sha256("".join(r.meta.source_sha256 for r in recordings).encode()).hexdigest()
    with output_folder(arguments.output, overwrite=arguments.overwrite) as folder:
        save_effects(
            folder / "effects.json",
            effects,
            intervals=intervals if effects else (),
            data_hash=hashes,
            source=found.sentence,
        )
        save(found, folder / "diagnosis.json")
    print(found.sentence)
    if found.findings:
        rows = [
            [f.name, f"{f.gain:.1f}", f"{f.gate:.1f}", f"{f.score:.1f}", ", ".join(f.equivalence_set)]
            for f in found.findings
        ]
        print(format_table(["effect", "gain", "gate", "score", "could also be"], rows))
