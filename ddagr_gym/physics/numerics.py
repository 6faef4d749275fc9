"""Accuracy as the kernels read it: quadrature rules and tolerances, bundled by who needs them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.jit import kernel
from ddagr_gym.parameters import Numerics
from ddagr_gym.physics.contact_geometry import contact_rule, section_rule

Array = NDArray[np.float64]


class PatchNumerics(NamedTuple):
    """How the stresses are summed over a contact patch.

    Attributes:
        section_nodes: from ``contact_geometry.section_rule``.
        contact_nodes: from ``contact_geometry.contact_rule``.
        minimum_shear_rate: nu_min [rad/s].
        rest_speed: rim plus hub speed below which forward and backward travel are blended [m/s].
    """

    section_nodes: Array
    contact_nodes: Array
    minimum_shear_rate: float
    rest_speed: float


class StepNumerics(NamedTuple):
    """How a sample is stepped; the fields have the meaning of those of ``parameters.Numerics``.

    Attributes:
        forces: quadrature of the forces.
        derivative: quadrature of their derivative.
        sinkage_tolerance: relative error of a load.
        jacobian_refresh: relative change of a wheel's motion after which its derivative is renewed.
        force_extrapolation: relative change of a wheel's motion up to which forces are extrapolated.
        accepted_error: of a step [m/s].
        launch_substeps: parts of a step that is divided.
        launch_change: change of a rim speed above which a step is divided, relative to the wheel's.
        substeps: least number of steps per sample.
        maximum_step: [s].
    """

    forces: PatchNumerics
    derivative: PatchNumerics
    sinkage_tolerance: float
    jacobian_refresh: float
    force_extrapolation: float
    accepted_error: float
    launch_substeps: int
    launch_change: float
    substeps: int
    maximum_step: float


@kernel(inline=True)
def named_numerics(fields: tuple[Any, ...]) -> StepNumerics:
    """Numerics from plain tuples of the fields, which numba takes from Python several times faster."""
    return StepNumerics(PatchNumerics(*fields[0]), PatchNumerics(*fields[1]), *fields[2:])


def patch_numerics(numerics: Numerics, contact_nodes: int | None = None) -> PatchNumerics:
    """Quadrature of the forces, or the same with ``contact_nodes`` along the contact."""
    return PatchNumerics(
        section_rule(numerics.section_nodes),
        contact_rule(contact_nodes or numerics.contact_nodes),
        float(numerics.minimum_shear_rate),
        float(numerics.rest_speed),
    )


def step_numerics(numerics: Numerics) -> StepNumerics:
    """All that the integrator needs of ``numerics``."""
    return StepNumerics(
        forces=patch_numerics(numerics),
        derivative=patch_numerics(numerics, numerics.jacobian_contact_nodes),
        sinkage_tolerance=float(numerics.sinkage_tolerance),
        jacobian_refresh=float(numerics.jacobian_refresh),
        force_extrapolation=float(numerics.force_extrapolation),
        accepted_error=float(numerics.accepted_error),
        launch_substeps=numerics.launch_substeps,
        launch_change=float(numerics.launch_change),
        substeps=numerics.substeps,
        maximum_step=float(numerics.maximum_step),
    )
