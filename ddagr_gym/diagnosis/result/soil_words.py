"""What the soil of a finding does under a wheel, in words: the part of the sentence that its sizes alone do not say."""

from __future__ import annotations

from ddagr_gym.diagnosis.answer.amounts import amounts
from ddagr_gym.diagnosis.answer.soil_at_work import SIDE_FORCE, SINKAGE, TRACTION, SoilAtWork, SoilQuantity
from ddagr_gym.diagnosis.answer.verdict import Finding
from ddagr_gym.diagnosis.wording import describe

TITLES = {TRACTION: "traction", SIDE_FORCE: "side force", SINKAGE: "sinkage", "net_pull": "net pull"}
"""Of quantities, inside a sentence."""

LEAST = 0.05
"""Difference between two soils that the near end of an interval must reach to be said (ours)."""

_NOT_TOLD_APART = "its strength and stiffness cannot be told apart"


def finding_in_words(finding: Finding) -> str:
    """An effect with its sizes as a clause; of a soil whose sizes are not known by themselves, what both do together.

    Args:
        finding: of a diagnosis.
    """
    clause = describe(finding.name, amounts(finding.parameters))
    if finding.soil is None or finding.soil.told_apart:
        return clause
    return f"{soil_in_words(finding.soil) or clause} ({_NOT_TOLD_APART})"


def soil_in_words(soil: SoilAtWork) -> str:
    """How traction, else side force or sinkage, differs for certain between two soils; "" where none does."""
    certain = [item for item in soil.quantities if _sign(item)]
    if not certain:
        return ""
    item = certain[0]
    less = _sign(item) < 0
    span = change_in_words(item)
    if item.name == SINKAGE:
        return f"the soil {soil.first} lets wheels sink {span} {'less' if less else 'deeper'} than {soil.second}"
    return f"the soil {soil.first} gives {span} {'less' if less else 'more'} {TITLES[item.name]} than {soil.second}"


def change_in_words(item: SoilQuantity) -> str:
    """The interval of a change that is certain as percent without a sign: "20 to 30 %"."""
    low, high = sorted(abs(100.0 * end) for end in item.change_interval or (0.0, 0.0))
    return f"{low:.0f} to {high:.0f} %"


def _sign(item: SoilQuantity) -> int:
    """1 or -1 where all of a change's interval lies beyond LEAST on that side, else 0."""
    if item.change_interval is None:
        return 0
    low, high = item.change_interval
    return int(low >= LEAST) - int(high <= -LEAST)
