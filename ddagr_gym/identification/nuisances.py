"""What a diagnosis must not mistake for missing physics: the uncertain nominal model.

*Global* parameters hold in all windows: soil, robot, biases of each recording, the sample in which commands act.
*Local* ones differ from window to window around the global value: fields vary by some percent from place to place and
their relief tilts the robot. Both have normal priors and are projected out of every sensitivity.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.identification.parameters import (
    ModelParameter,
    command_shift,
    heading_parameters,
    robot_parameters,
    sensor_parameters,
    soil_entries,
    soil_parameters,
)
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.parameters import Robot
from ddagr_gym.physics import layout


@dataclass(frozen=True)
class NuisancePriors:
    """Standard deviations of what is uncertain, all ours: orders of magnitude of fields and sensor specifications.

    Attributes:
        strength: logarithm of the whole field's factor on cohesion and tan(phi).
        stiffness: the same on k_c and k_phi.
        shear_modulus: logarithm of the factor on K.
        exit_angle: exit angle ratio, absolute.
        friction: logarithm of a factor on tan(phi) alone.
        exponent: logarithm of the factor on n.
        peak: coefficients of the stress peak, absolute.
        side_slip_lead: where the sideways velocity of a wheel counts, over its radius; two published ways to direct the
            shear stress (against the sliding velocity, against the displacement) differ by 0.06.
        sinkage_tilt: share of the tilt by unequal sinkage that the accelerometer feels, absolute.
        gyro_bias: of a recording [rad/s].
        accelerometer_bias: of a recording [m/s^2].
        local_strength: as strength, of one window against the field.
        local_stiffness: as stiffness, of one window.
        local_split: strength under the right wheels alone, of one window.
        local_accelerometer: relief under one window [m/s^2].
        local_gyro: wandering of the gyro in one window [rad/s].
    """

    strength: float = 0.12
    stiffness: float = 0.2
    shear_modulus: float = 0.4
    exit_angle: float = 0.1
    friction: float = 0.1
    exponent: float = 0.15
    peak: float = 0.1
    side_slip_lead: float = 0.05
    sinkage_tilt: float = 1.0
    gyro_bias: float = 2e-4
    accelerometer_bias: float = 0.01
    local_strength: float = 0.05
    local_stiffness: float = 0.1
    local_split: float = 0.03
    local_accelerometer: float = 0.02
    local_gyro: float = 3e-4

    def with_soil(self, factor: float) -> NuisancePriors:
        """The same with another uncertainty of the ground as a whole.

        Args:
            factor: on the deviations of strength, stiffness, shear modulus, friction and exponent; 1 for a field whose
                soil was surveyed, about 4 for ground of which only a kind is known.

        Raises:
            InputError: not a positive number.
        """
        if not (math.isfinite(factor) and factor > 0.0):
            raise InputError(f"the soil uncertainty is {factor:g}: give a factor above 0, 1 for a surveyed field.")
        names = ("strength", "stiffness", "shear_modulus", "friction", "exponent")
        return replace(self, **{name: factor * getattr(self, name) for name in names})


@dataclass(frozen=True)
class LocalUnknown:
    """A variation of one window about the value of all windows.

    Attributes:
        name: identifier.
        deviation: standard deviation about 0, in the unit of what it moves.
        parameter: index of the global parameter that it moves in its window; None for one that moves a reading.
        channel: index in CHANNELS of the reading that it adds to; None for one that moves a parameter.
    """

    name: str
    deviation: float
    parameter: int | None = None
    channel: int | None = None


@dataclass(frozen=True)
class Nuisances:
    """Parameters of a fit.

    Attributes:
        parameters: (P,) global ones, with their priors.
        local: (L,) unknowns that each window has besides its initial state.
    """

    parameters: tuple[ModelParameter, ...]
    local: tuple[LocalUnknown, ...] = ()


LOCAL = (
    "local_strength",
    "local_stiffness",
    "local_split",
    "local_accelerometer_x",
    "local_accelerometer_y",
    "local_gyro",
)
"""Local unknowns of a diagnosis, in their order."""


_SOIL_STEP = 0.05
"""Of finite differences: the simulator's adaptive steps leave 0.5 units of noise per prediction, and forces are nearly
linear in the logarithms over 5 percent."""


def _structural(priors: NuisancePriors) -> tuple[ModelParameter, ...]:
    """Directions in which another soil law differs from the nominal one."""
    friction = soil_entries(layout.SOIL_FRICTION_TANGENT)
    peak, peak_slip = soil_entries(layout.SOIL_PEAK_0), soil_entries(layout.SOIL_PEAK_1)
    right = (*soil_entries(layout.SOIL_COHESION, (0, 2)), *soil_entries(layout.SOIL_FRICTION_TANGENT, (0, 2)))
    return (
        ModelParameter("friction", "-", friction, True, priors.friction, _SOIL_STEP, -0.8, 0.8),
        ModelParameter(
            "sinkage_exponent", "-", soil_entries(layout.SOIL_EXPONENT), True, priors.exponent, _SOIL_STEP, -0.7, 0.7
        ),
        ModelParameter("stress_peak", "-", peak, False, priors.peak, _SOIL_STEP, -0.3, 0.3),
        ModelParameter("stress_peak_slip", "-", peak_slip, False, priors.peak, _SOIL_STEP, -0.3, 0.3),
        # only local: as a global parameter it would be the effect soil_split
        ModelParameter("strength_right", "-", right, True, 0.0, _SOIL_STEP, 0.0, 0.0),
    )


LEAD = "side_slip_lead"
"""Parameter of the place along its contact at which a wheel's sideways velocity counts."""

_MOST_LEAD = 0.2
"""Largest lead of the side slip over the wheel's radius: the contact of the DDAGR's wheels on its soil ends at 0.24."""

_LEAD_STEP = 0.01
"""Of finite differences, over the wheel's radius."""


def _side_slip_lead(robot: Robot, priors: NuisancePriors) -> ModelParameter:
    """Where along its contact a wheel's sideways velocity counts: the place of the turning centre."""
    deviation, most = (share * robot.outer_radius for share in (priors.side_slip_lead, _MOST_LEAD))
    step = _LEAD_STEP * robot.outer_radius
    return ModelParameter(LEAD, "m", (layout.SIDE_SLIP_LEAD,), False, deviation, step, -most, most)


TILT = "sinkage_tilt"
"""Parameter of how far the accelerometer feels the tilt by unequal sinkage."""


def _sinkage_tilt(robot: Robot, priors: NuisancePriors) -> ModelParameter:
    """From none to all of it; simulators that leave it out and robots with a stiff frame both exist."""
    low, high = -robot.sinkage_tilt, 1.0 - robot.sinkage_tilt
    return ModelParameter(TILT, "-", (layout.SINKAGE_TILT,), False, priors.sinkage_tilt, 0.2, low, high)


def nuisances(
    robot: Robot,
    recordings: int,
    period: float,
    priors: NuisancePriors = NuisancePriors(),
    unplaced: Sequence[int] = (),
) -> Nuisances:
    """Global and local parameters for some recordings of a robot.

    Args:
        robot: with the standard deviations of what it states as uncertain.
        recordings: how many.
        period: between samples [s].
        priors: standard deviations of the others.
        unplaced: recordings whose heading in the world nobody knows.
    """
    deviations = {
        "soil_strength": priors.strength,
        "soil_stiffness": priors.stiffness,
        "shear_modulus": priors.shear_modulus,
        "exit_angle_ratio": priors.exit_angle,
    }
    soil = tuple(replace(p, prior=deviations[p.name], step=_SOIL_STEP) for p in soil_parameters())
    parameters = (
        *soil,
        *_structural(priors),
        _side_slip_lead(robot, priors),
        _sinkage_tilt(robot, priors),
        *robot_parameters(robot),
        command_shift(period),
        *sensor_parameters(recordings, priors.gyro_bias, priors.accelerometer_bias),
        *heading_parameters(unplaced, math.pi),
    )
    names = [p.name for p in parameters]
    local = (
        LocalUnknown(LOCAL[0], priors.local_strength, parameter=names.index("soil_strength")),
        LocalUnknown(LOCAL[1], priors.local_stiffness, parameter=names.index("soil_stiffness")),
        LocalUnknown(LOCAL[2], priors.local_split, parameter=names.index("strength_right")),
        LocalUnknown(LOCAL[3], priors.local_accelerometer, channel=CHANNELS.index("specific_force_x")),
        LocalUnknown(LOCAL[4], priors.local_accelerometer, channel=CHANNELS.index("specific_force_y")),
        LocalUnknown(LOCAL[5], priors.local_gyro, channel=CHANNELS.index("yaw_rate")),
    )
    return Nuisances(parameters, local)


SHIFT_AS_EFFECT = "command_delay"
"""Effect that is no other thing than a row whose command acts later."""


def absorbed_sizes(parameters: Sequence[ModelParameter], values: NDArray[np.float64]) -> dict[str, float]:
    """Sizes of effects, in their units, that a nuisance can still take over without a trace.

    Args:
        parameters: (P,) global ones.
        values: (P,) where they stand.
    """
    rooms = [p.high - float(value) for p, value in zip(parameters, values, strict=True) if p.shift]
    return {SHIFT_AS_EFFECT: sum(rooms)} if rooms else {}
