"""The null bank: what the scan says of drives in which nothing is missing, made by structurally different simulators.

Every run drives the given commands in a world of its own
(:mod:`ddagr_gym.diagnosis.null_bank.structural_variants`), reads it with the noise of the given sensors, and
goes through the same refit and scan as a real drive.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.gates.source_digest import source_digest
from ddagr_gym.diagnosis.gates.thresholds import NullRun
from ddagr_gym.diagnosis.null_bank.drives import Template, null_recordings
from ddagr_gym.diagnosis.null_bank.standard_drives import standard_template
from ddagr_gym.diagnosis.null_bank.structural_variants import KINDS
from ddagr_gym.diagnosis.preprocessing.input_requirements import content_hash
from ddagr_gym.diagnosis.search.gains import Gain
from ddagr_gym.diagnosis.search.initial_guess import first_guess
from ddagr_gym.diagnosis.search.rivals import best_gains, scans_of
from ddagr_gym.diagnosis.search.scan import drive_extent
from ddagr_gym.diagnosis.search.scanned_model import ScannedModel, scan_model
from ddagr_gym.diagnosis.search.starting_models import refit_nominal
from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.identification.problem import Problem
from ddagr_gym.parameters import Robot, Soil
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class NullBank:
    """Drives in which nothing is missing, and how they are scanned: one null run each.

    Attributes:
        robot: nominal.
        soil: nominal.
        setting: of the diagnosis.
        drives: what each run drives: the template of simulated drives, None for drives that are drawn
            (:mod:`ddagr_gym.diagnosis.null_bank.standard_drives`), or a real drive that is known to be ordinary.
        seed: of all runs.
        centre: robot and soil about which worlds are drawn: the nominal ones by default, those fitted to the recordings
            for a bootstrap of the fitted nominal simulator.
    """

    robot: Robot
    soil: Soil
    setting: Setting
    drives: tuple[Template | Recording | None, ...]
    seed: int = 0
    centre: tuple[Robot, Soil] | None = None

    def run(self, number: int) -> NullRun:
        """Refit and scan of one null world, or of one ordinary drive.

        Args:
            number: of the drive; simulated worlds go through all kinds in turn.
        """
        drive = self.drives[number]
        if isinstance(drive, Recording):
            return self.scan([drive], f"real {Path(drive.meta.source).name}")
        kind, rng = KINDS[number % len(KINDS)], np.random.default_rng([self.seed, number])
        template = standard_template(self.robot, rng) if drive is None else drive
        robot, soil = (self.robot, self.soil) if self.centre is None else self.centre
        return self.scan(null_recordings(robot, soil, template, kind, rng), kind)

    def scan(self, recordings: Sequence[Recording], kind: str) -> NullRun:
        """Refit and scan of drives of one world.

        Args:
            recordings: null drives of one world, or (pieces of) real drives that are known to be ordinary.
            kind: of KINDS, or the name of the real drive.
        """
        problem = make_problem(self.robot, self.soil, recordings, self.setting)
        raw, refitted = refit_nominal(problem)
        model = scan_model(problem, refitted)
        best = best_gains(scans_of(problem, model, raw))
        return NullRun(
            kind,
            {name: gain.gain for name, (gain, _) in best.items()},
            {name: scan_.scores[name] for name, (_, scan_) in best.items()},
            {name: scan_.held_out[name] for name, (_, scan_) in best.items()},
            model.misfit,
            problem.blocked.windows.count,
            tuple(name for name, (gain, scan_) in best.items() if not _is_meaningful(problem, gain, scan_)),
            problem.blocked.windows.duration,
        )

    def key(self) -> str:
        """Hash of everything that the bank depends on, the sources of the diagnosis and the simulator included."""
        digest = hashlib.sha256(source_digest().encode())
        nominal = [repr(self.robot), repr(self.soil), repr(self.setting)]
        digest.update(json.dumps([*nominal, len(self.drives), self.seed]).encode())
        digest.update(b"" if self.centre is None else repr(self.centre).encode())
        # one template may stand for all runs: it is read once
        for drive in dict.fromkeys(self.drives):
            digest.update(_drive_digest(drive))
        return digest.hexdigest()


def _drive_digest(drive: Template | Recording | None) -> bytes:
    """What tells a drive of a bank from another one."""
    if drive is None:
        return b"drawn"
    if isinstance(drive, Recording):
        return f"{content_hash(drive)}{drive.meta.segments}{drive.meta.spans}".encode()
    noise = [None if found is None else asdict(found) for found in drive.noise]
    digest = hashlib.sha256(json.dumps([noise, drive.period, drive.starts], sort_keys=True).encode())
    for values in (*drive.commands, *drive.present):
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.digest()


def _is_meaningful(problem: Problem, gain: Gain, scan_: ScannedModel) -> bool:
    """Whether a scan puts an effect at its least meaningful size or above."""
    guess = first_guess(scan_.terms.candidates[gain.candidate], gain.multiples)
    return guess.is_meaningful(drive_extent(problem, scan_.fitted.prediction))
