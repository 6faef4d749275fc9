"""Which parameters of a finding are shown: limits that nothing reaches, and shapes switched off, say nothing."""

from __future__ import annotations

from ddagr_gym.diagnosis.answer.verdict import Estimate, Finding

_WHERE_OFF = {"half_length": ("half_length", "bearing"), "turning": ("turning",), "way": ("way", "angle")}
"""What says nothing where a shape is 0: the line of a disc, a turning like each bank, soil that is not heaped up."""

_WHERE_ON = {"turning": ("second_pole", "slowing")}
"""The same where it is not: the loops where the turning alone is late."""


def shown_parameters(finding: Finding) -> dict[str, Estimate]:
    """Parameters of a finding without idle shapes and the limits that are none; all of them where none is left.

    Args:
        finding: of a diagnosis; a fault of channels, which the library does not have, keeps all.
    """
    from ddagr_gym.physics.effects.registry import effect_kinds

    kind = effect_kinds().get(finding.name)
    if kind is None or kind.differentiable:
        idle = {name for switch, item in finding.parameters.items() for name in _idle(switch, item.value)}
        return {name: item for name, item in finding.parameters.items() if name not in idle}
    none = {name: kind.parameter(name).metadata["neutral"] for name in kind.size_names()}
    found = {name: item for name, item in finding.parameters.items() if item.value != none.get(name)}
    return found or dict(finding.parameters)


def _idle(switch: str, value: float) -> tuple[str, ...]:
    """Parameters that say nothing beside the value of a switch."""
    return (_WHERE_OFF if value == 0.0 else _WHERE_ON).get(switch, ())
