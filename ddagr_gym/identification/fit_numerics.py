"""Accuracy of the simulator inside a fit: settings each as coarse as what its residuals leave unexplained allows.

All are smooth (no decision of the integrator jumps with a parameter by more than its error), because sensitivities are
differences of simulations.
"""

from __future__ import annotations

from dataclasses import replace

from ddagr_gym.parameters import Numerics

FIELD_TOLERANCE = 5e-4
"""Relative gain of a step that ends a fit to field drives (ours): far below the deviations of the parameters."""

RUN_IN_STEP = 0.05
"""Longest step of the integrator before a window [s] (ours)."""


FOLLOWED_CHANGE = 0.03
"""Change of a wheel's velocity over its speed up to which sensitivities extrapolate its forces (ours)."""

FOLLOWED_REFRESH = 0.001
"""Change of a wheel's velocity over its speed from which the derivatives for that are renewed (ours)."""


def reference_numerics(numerics: Numerics) -> Numerics:
    """For a simulation whose forces others extrapolate: derivatives as accurate as the forces, and renewed often.

    Args:
        numerics: of the others.
    """
    refresh = min(numerics.jacobian_refresh, FOLLOWED_REFRESH)
    return replace(numerics, jacobian_refresh=refresh, jacobian_contact_nodes=numerics.contact_nodes)


def field_numerics() -> Numerics:
    """For fits to samples of field drives (a replay): smooth, with steps of up to 25 ms.

    Yaw rates are within 2e-3 rad/s (r.m.s.) of converged ones on drives of several m/s, a hundredth of what such
    drives leave unexplained, at a quarter of the cost of ``Numerics.smooth()``.
    """
    return replace(Numerics.smooth(), maximum_step=0.025, jacobian_refresh=0.05, launch_change=0.1)


def far_off_numerics() -> Numerics:
    """For a diagnosis of a fast robot whose nominal model is far off: :func:`field_numerics`, five nodes in a contact.

    On drives of a Warthog block means are within 0.008 deviations of their noise (r.m.s.) of converged ones, those of
    :func:`block_mean_numerics` within 0.007, at 0.62 times the cost; the nominal model leaves 5 to 10 deviations.
    """
    return replace(field_numerics(), contact_nodes=5)


def field_slope_numerics() -> Numerics:
    """For the sensitivities of calibrations and of diagnoses that are far off: steps of 50 ms, five nodes in a contact.

    On drives of a Warthog they err by 5 % in the median window and by 33 % in one of ten, those of
    :func:`field_numerics` by 4 % and 23 % at 1.3 times the cost (benchmarks/sensitivities.py).
    """
    return replace(field_numerics(), maximum_step=0.05, contact_nodes=5)


def run_in_numerics(numerics: Numerics) -> Numerics:
    """For what was driven right before a window, of which only the integral parts of the speed loops are kept.

    On drives of a Warthog these are as close to converged ones with steps of 50 ms as with :func:`field_numerics`
    (within 0.04 rad/s^2, r.m.s., of 12.7; wheel speeds within 2 mrad/s), at 0.65 times the cost.

    Args:
        numerics: of the windows.
    """
    return replace(numerics, maximum_step=max(numerics.maximum_step, RUN_IN_STEP))


def block_mean_numerics() -> Numerics:
    """For fits to block means (a diagnosis): steps of 20 ms, divided where their error estimate asks for it.

    Accelerations of starts, arcs, stops and spins are within 0.5 mm/s^2 (r.m.s.) of converged ones. Dividing at
    launches instead (``Numerics.smooth()``) costs up to 1.5 times as much and errs by 2.3 mm/s^2. A wheel's derivative
    is kept while its motion changes by less than 2 %, at two thirds of the time (:func:`reference_numerics` renews it
    more often, since sensitivities are as right as the derivative).

    The derivative is that of the forces as they are summed, with as many nodes. With fewer, Newton's method fails in
    soils that resist within a hundredth of slip, to which refits come: on a robot whose battery had moved a prediction
    took 1.6 s in place of 0.2 s (0.06 s on the nominal soil, with either).
    """
    return replace(
        Numerics.smooth(),
        maximum_step=0.02,
        accepted_error=1e-4,
        launch_change=1e9,
        jacobian_refresh=0.02,
        contact_nodes=4,
        jacobian_contact_nodes=4,
    )
