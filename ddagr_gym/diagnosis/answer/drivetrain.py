"""What a simulator's drivetrain lacks against a real robot's, as the answer of a diagnosis holds it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

PART_TITLES = {
    "command_delay": "dead time of the commands",
    "turning_limit": "limit of the commanded turning",
    "mean_ramp": "ramp of the commanded mean speed",
    "turning_ramp": "ramp of the commanded turning",
    "command_ramp": "ramp of each bank's commands",
    "command_filter": "filter of the commands",
    "speed_loop": "speed loop",
    "integral": "integral part of the speed loop",
    "integral_limit": "limit of the integral part",
    "load": "the ground's torque on the wheels",
    "torque_limit": "torque limit",
    "no_load_speed": "torque that falls with speed",
    "power_limit": "power limit",
    "speed_limit": "highest wheel speed",
    "limit_imbalance": "banks of unequal strength",
    "friction": "friction of motors and gears",
}
"""Titles of the parts between command and wheel, by the name that a verdict uses, in the order of the signal."""

LEAST_GROWTH = 0.02
"""Growth of the losses below which a part does not matter however sure it is (ours): ramp, limits and load that a
simulated robot did not have were sure to 0.2 to 1.5 %."""

STEPS = "steps of the commands held for 3 s or more, with wheel speeds recorded at 10 Hz or more"
FULL = "straight pieces at the highest speed that the robot takes, commanded beyond it"
HARD = "full reversals of the commands on firm ground, with wheel speeds recorded at 10 Hz or more"
_SPINS = "turns on the spot on loose ground at the highest yaw rate that the robot takes, commanded beyond it"
_REVERSALS = "full reversals of turns on the spot, with wheel speeds recorded at 10 Hz or more"
_TURNS = "turns on the spot and wide arcs on firm ground, each held for 3 s or more"

PART_DRIVES = {
    "command_delay": f"{STEPS}, out of steady driving and with the time before each step recorded",
    "turning_limit": _SPINS,
    "mean_ramp": HARD,
    "turning_ramp": _REVERSALS,
    "command_ramp": HARD,
    "command_filter": STEPS,
    "speed_loop": STEPS,
    "integral": _TURNS,
    "integral_limit": f"{_TURNS}, and {FULL}",
    "load": _TURNS,
    "torque_limit": HARD,
    "no_load_speed": FULL,
    "power_limit": FULL,
    "speed_limit": FULL,
    "limit_imbalance": HARD,
    "friction": f"coasting, and {FULL}",
}
"""Drives from which each of them can be told, for a reader."""


@dataclass(frozen=True)
class PartEvidence:
    """What a part of the drivetrain is worth where nothing was fitted.

    Attributes:
        name: of the part.
        kept: whether the robot needs it.
        growth: relative growth of the forecasts' loss without it, over the parts of the drives that were left out [-].
        error: standard error of that growth; null for a single fold.
    """

    name: str
    kept: bool
    growth: float
    error: float | None


@dataclass(frozen=True)
class ForecastComparison:
    """Root mean square error of forecasts of what was left out of the fit.

    Attributes:
        drive: that was forecast.
        metric: heading, position, wheel_speed or yaw_rate.
        horizon: time from the start of the forecast [s]; null for all samples.
        unit: of the errors.
        nominal: of the simulator as it was given.
        corrected: with the drivetrain that was found; what else of robot, sensors and soil was fitted is in it too.
        kinematic: of an effective track with delay and lag, which knows no forces.
        corrected_interval: 95 % of ``corrected``, by resampling windows; null where too few were measured.
    """

    drive: str
    metric: str
    horizon: float | None
    unit: str
    nominal: float
    corrected: float
    kinematic: float
    corrected_interval: tuple[float, float] | None


@dataclass(frozen=True)
class Remaining:
    """Where the corrected simulator's squared residual of the wheel speeds is.

    Attributes:
        condition: in words.
        share: of the whole squared residual [-].
        time: share of the samples [-].
    """

    condition: str
    share: float
    time: float


@dataclass(frozen=True)
class DrivetrainAnswer:
    """Parts of the drivetrain that the simulator lacks, and what they are worth.

    Attributes:
        parts: that were tried, kept ones and others.
        forecasts: of stretches that were left out of the fit.
        remaining: where the residual of the wheel speeds is, after the correction.
        explained: share of the nominal simulator's squared error of the wheel speeds, on what was left out, that the
            correction takes away [-].
        other: names of further parameters of robot, sensors, commands and soil that were fitted along.
        misfit: of the encoders beside the nominal simulator, over its limit, for which the drivetrain was asked.
    """

    parts: tuple[PartEvidence, ...]
    forecasts: tuple[ForecastComparison, ...]
    remaining: tuple[Remaining, ...]
    explained: float
    other: tuple[str, ...] = ()
    misfit: Mapping[str, float] | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Kept parts, in the order of the signal."""
        kept = {part.name for part in self.parts if part.kept}
        return tuple(name for name in PART_TITLES if name in kept)
