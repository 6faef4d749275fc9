"""Skid-steer field robots on soft soil: simulator, Gymnasium environments, recordings, diagnosis.

Importing the package registers the environments; :func:`gymnasium.make` then knows ``DDAGR-Turn-v0``. The functions are
what the commands of the same names do, with typed results::

    drive = ddagr_gym.simulate("arcs", effects="slope=0.05")     # or load_recording("run.csv")
    ddagr_gym.check(drive)                                       # clocks, signs, units, sensors
    result = ddagr_gym.diagnose(drive)                           # which physics the simulator leaves out
    result.findings[0].parameters["angle"], result.effects       # how big; what gym.make(effects=...) takes
    ddagr_gym.adapt(drive).report("adapted")                     # a controller that is tuned on what was found

Conventions, everywhere in the package:

===============  =======================================================================================
units            SI and radians; percentages and degrees appear in printed tables only
frames           REP 103: world x, y horizontal; body x forward, y left, z up; yaw counter-clockwise
wheels           1 front right, 2 front left, 3 rear right, 4 rear left
banks            ordered (right, left); a positive speed drives the robot forward
forces           those of the soil on the wheel
slip ratio       positive when the wheel spins faster than it travels, negative when it is braked
specific force   raw accelerometer: +9.81 m/s^2 on z when the robot stands level
time             seconds from the start of the drive, one row per sensor sample
missing samples  NaN: the channel has no new sample in that row
randomness       only from a :class:`numpy.random.Generator` that the caller passes in
truth            columns that no sensor reads carry the prefix ``true_``
===============  =======================================================================================

Columns of a drive: ``t``; ``command_right``, ``command_left``, ``encoder_right``, ``encoder_left`` [rad/s];
``specific_force_x``, ``specific_force_y``, ``specific_force_z`` [m/s^2]; ``yaw_rate`` [rad/s]; optional ``roll``,
``pitch`` [rad], ``pose_x``, ``pose_y`` [m], ``pose_yaw`` [rad], ``current_right``, ``current_left`` [A],
``voltage_right``, ``voltage_left``, ``battery_voltage`` [V].

Bad input raises :class:`ddagr_gym.errors.InputError`: one sentence with the offending value and the remedy.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from ddagr_gym.deprecation import install as install_moved_modules
from ddagr_gym.envs.registration import register_environments
from ddagr_gym.version import __version__

if TYPE_CHECKING:
    from ddagr_gym.api.adapt import AdaptationResult, adapt
    from ddagr_gym.api.calibrate import CalibrationResult, calibrate
    from ddagr_gym.api.change import ChangeResult
    from ddagr_gym.api.check import CheckResult, check
    from ddagr_gym.api.diagnose import diagnose
    from ddagr_gym.api.diagnosis_result import DiagnosisResult
    from ddagr_gym.api.drive_series import DriveSeriesResult, diagnose_drives
    from ddagr_gym.api.estimate import EstimateResult, estimate
    from ddagr_gym.api.export import ExportResult, export
    from ddagr_gym.api.guess_topic_map import TopicMapGuess, guess_topic_map
    from ddagr_gym.api.isolability import IsolabilityResult, isolability
    from ddagr_gym.api.load_recording import load_recording
    from ddagr_gym.api.next_drive import NextDriveResult, next_drive
    from ddagr_gym.api.replay import ReplayResult, replay
    from ddagr_gym.api.simulate import SimulationResult, simulate

__all__ = [
    "AdaptationResult",
    "CalibrationResult",
    "ChangeResult",
    "CheckResult",
    "DiagnosisResult",
    "DriveSeriesResult",
    "EstimateResult",
    "ExportResult",
    "IsolabilityResult",
    "NextDriveResult",
    "ReplayResult",
    "SimulationResult",
    "TopicMapGuess",
    "__version__",
    "adapt",
    "calibrate",
    "check",
    "diagnose",
    "diagnose_drives",
    "estimate",
    "export",
    "guess_topic_map",
    "isolability",
    "load_recording",
    "next_drive",
    "register_environments",
    "replay",
    "simulate",
]

_MODULES = {
    "AdaptationResult": "adapt",
    "CalibrationResult": "calibrate",
    "ChangeResult": "change",
    "CheckResult": "check",
    "DiagnosisResult": "diagnosis_result",
    "DriveSeriesResult": "drive_series",
    "EstimateResult": "estimate",
    "ExportResult": "export",
    "IsolabilityResult": "isolability",
    "NextDriveResult": "next_drive",
    "ReplayResult": "replay",
    "SimulationResult": "simulate",
    "TopicMapGuess": "guess_topic_map",
    "adapt": "adapt",
    "calibrate": "calibrate",
    "check": "check",
    "diagnose": "diagnose",
    "diagnose_drives": "drive_series",
    "estimate": "estimate",
    "export": "export",
    "guess_topic_map": "guess_topic_map",
    "isolability": "isolability",
    "load_recording": "load_recording",
    "next_drive": "next_drive",
    "replay": "replay",
    "simulate": "simulate",
}
"""Module of :mod:`ddagr_gym.api` that defines a public name; it is imported when the name is asked for."""


def __getattr__(name: str) -> Any:
    """A function or result class, imported at its first use (PEP 562)."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(importlib.import_module(f"{__name__}.api.{_MODULES[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    """Names of the module, those that are not loaded yet included."""
    return sorted({*globals(), *__all__})


install_moved_modules()
register_environments()
