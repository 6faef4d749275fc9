"""The null bank: what the scan says of drives in which nothing is missing, made by structurally different simulators.

Every run drives the given commands in a world of its own
(:mod:`ddagr_gym.diagnosis.null_bank.structural_variants`), reads it with the noise of the given sensors, and
goes through the same refit and scan as a real drive.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.gates.thresholds import NullRun
from ddagr_gym.diagnosis.null_bank.drives import Template, null_recordings
from ddagr_gym.diagnosis.null_bank.standard_drives import standard_template
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


def null_run(
    robot: Robot,
    soil: Soil,
    template: Template | None,
    kind: str,
    setting: Setting,
    seed: Sequence[int],
    centre: tuple[Robot, Soil] | None = None,
) -> NullRun:
    """Refit and scan of one null world.

    Args:
        robot: nominal.
        soil: nominal.
        template: see :func:`null_recordings`; None draws drives of its own
            (:mod:`ddagr_gym.diagnosis.null_bank.standard_drives`).
        kind: of KINDS.
        setting: of the diagnosis.
        seed: of this run alone.
        centre: robot and soil about which worlds are drawn: the nominal ones by default, those fitted to the recordings
            for a bootstrap of the fitted nominal simulator.
    """
    rng = np.random.default_rng(list(seed))
    if template is None:
        template = standard_template(robot, rng)
    drives = null_recordings(*((robot, soil) if centre is None else centre), template, kind, rng)
    return scan_null_drives(robot, soil, drives, kind, setting)


def scan_null_drives(robot: Robot, soil: Soil, recordings: Sequence[Recording], kind: str, setting: Setting) -> NullRun:
    """Refit and scan of drives in which nothing is missing.

    Args:
        robot: nominal.
        soil: nominal.
        recordings: null drives of one world, or (pieces of) real drives that are known to be ordinary.
        kind: of KINDS, or the name of the real drive.
        setting: of the diagnosis.
    """
    problem = make_problem(robot, soil, recordings, setting)
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


def _is_meaningful(problem: Problem, gain: Gain, scan_: ScannedModel) -> bool:
    """Whether a scan puts an effect at its least meaningful size or above."""
    guess = first_guess(scan_.terms.candidates[gain.candidate], gain.multiples)
    return guess.is_meaningful(drive_extent(problem, scan_.fitted.prediction))


def bank_hash(
    robot: Robot,
    soil: Soil,
    template: Template | None,
    setting: Setting,
    count: int,
    seed: int,
    centre: tuple[Robot, Soil] | None = None,
    pieces: Sequence[Recording] = (),
) -> str:
    """Hash of everything that a bank depends on, the sources of the diagnosis and the simulator included.

    Args:
        robot: nominal.
        soil: nominal.
        template: of the null drives; None where they are drawn or real.
        setting: of the diagnosis.
        count: of null runs.
        seed: of the bank.
        centre: see :func:`null_run`.
        pieces: of real drives that are known to be ordinary, where they are the null runs.
    """
    from ddagr_gym.diagnosis.gates.source_digest import source_digest

    digest = hashlib.sha256(source_digest().encode())
    noise = [None if n is None else asdict(n) for n in template.noise] if template else []
    period, starts = (template.period, template.starts) if template else (0.0, ())
    text = json.dumps([repr(robot), repr(soil), repr(setting), noise, period, starts, count, seed], sort_keys=True)
    digest.update(text.encode())
    digest.update(b"" if centre is None else repr(centre).encode())
    for values in (*template.commands, *template.present) if template else ():
        digest.update(np.ascontiguousarray(values).tobytes())
    for piece in pieces:
        digest.update(f"{content_hash(piece)}{piece.meta.segments}{piece.meta.spans}".encode())
    return digest.hexdigest()
