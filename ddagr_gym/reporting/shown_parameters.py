"""Which parameters of a finding are shown: limits that nothing reaches say nothing."""

from __future__ import annotations

from ddagr_gym.diagnosis.answer.verdict import Estimate, Finding


def shown_parameters(finding: Finding) -> dict[str, Estimate]:
    """Parameters of a finding without the limits that are none; all of them where none is left.

    Args:
        finding: of a diagnosis; a fault of channels, which the library does not have, keeps all.
    """
    from ddagr_gym.physics.effects.registry import effect_kinds

    kind = effect_kinds().get(finding.name)
    if kind is None or kind.differentiable:
        return dict(finding.parameters)
    none = {name: kind.parameter(name).metadata["neutral"] for name in kind.size_names()}
    found = {name: item for name, item in finding.parameters.items() if item.value != none.get(name)}
    return found or dict(finding.parameters)
