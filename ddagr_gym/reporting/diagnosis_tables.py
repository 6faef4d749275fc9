"""Texts and tables of the page of a diagnosis."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ddagr_gym.diagnosis.answer.amounts import Amount, amounts, number, size
from ddagr_gym.diagnosis.answer.certificate import Certificate, Measured
from ddagr_gym.diagnosis.answer.location import Localisation, OperatingConditionShare, Span
from ddagr_gym.diagnosis.answer.next_drive_plan import NextDrivePlan
from ddagr_gym.diagnosis.answer.unnamed_terms import UnnamedTerm, UnnamedTerms
from ddagr_gym.diagnosis.answer.verdict import NONE, UNKNOWN, DataDoubt, Diagnosis, Finding, GatesUsed, IncompleteFor
from ddagr_gym.diagnosis.result.sentences import when
from ddagr_gym.diagnosis.result.soil_words import finding_in_words
from ddagr_gym.diagnosis.wording import CHANNEL_NAMES, in_sentence, range_in_words, title
from ddagr_gym.reporting.drivetrain_section import drivetrain_tiles
from ddagr_gym.reporting.shown_parameters import shown_parameters
from ddagr_gym.reporting.soil_table import soil_section

if TYPE_CHECKING:
    from ddagr_gym.physics.effects import Effect

_MOST_SPANS = 8
"""Stretches that are listed for a finding, at most: those with most gain (ours: one line of text)."""

_MIDDLE = 5.0  # [s] the horizon that stands for all

_JUDGED = {
    "by recording": "Errors on each recording, by models whose sizes were fitted to the others",
    "by time": "Errors on each half of the one recording, by models whose sizes were fitted to the other half",
}

_NULLS = {
    "simulated": "simulated drives with nothing missing, made by structurally different simulators,",
    "ordinary": "pieces of real drives that are taken to be ordinary,",
}


_INCOMPLETE: Mapping[IncompleteFor, str] = {
    "left": "something is left",
    "names": "nothing else shows, but what is named is doubtful",
    "dead": "not every channel speaks",
    "contradictions": "the recordings contradict themselves",
}


def _of_drive(diagnosis: Diagnosis, seconds: float) -> str:
    """What the time that windows cover is of: of long drives they are some."""
    total, recordings = sum(item.seconds for item in diagnosis.data), _recordings(len(diagnosis.recordings))
    if seconds > _NEARLY_ALL * total:
        return f"of {total:.0f} s compared, in {recordings}"
    return f"compared, in windows evenly chosen from {total:.0f} s in {recordings}"


_NEARLY_ALL = 0.7
"""Share of the time of drives from which windows count as all of it: at the ends of stretches none fits."""


def tiles(diagnosis: Diagnosis, seconds: float) -> list[dict[str, str]]:
    """The few numbers under the headline.

    Args:
        diagnosis: the answer.
        seconds: of drive that the windows cover.
    """
    parts = () if diagnosis.drivetrain is None else diagnosis.drivetrain.names
    names = [title(name) if name not in (NONE, UNKNOWN) else name for name in diagnosis.verdict if name not in parts]
    verdict = ", ".join(["Drivetrain", *names] if parts else names)
    status = "complete: nothing else shows" if diagnosis.complete else f"incomplete: {_incomplete(diagnosis)}"
    explained = None if diagnosis.localisation is None else diagnosis.localisation.explained
    shares = [] if diagnosis.fit is None else _gain_shares(diagnosis.fit)
    found = [
        {"value": verdict, "label": status},
        {"value": f"{seconds:.0f} s", "label": _of_drive(diagnosis, seconds)},
        {"value": str(diagnosis.thresholds.nulls), "label": "null drives behind the gates"},
    ]
    if diagnosis.drivetrain is not None:
        return [*found[:1], *drivetrain_tiles(diagnosis.drivetrain), found[1]]
    if explained is not None and any(finding.gate > 0.0 for finding in diagnosis.findings):
        found.insert(1, {"value": percent(explained), "label": "of the mismatch above the noise explained"})
    if shares:
        horizon, share = shares[0]
        label = f"of what is explicable where no size was fitted, {horizon:g} s ahead"
        found.insert(2, {"value": percent(share.value), "label": label})
    return found


def _incomplete(diagnosis: Diagnosis) -> str:
    """The first reason why an answer is not complete, in words."""
    if diagnosis.incomplete_for:
        return _INCOMPLETE[diagnosis.incomplete_for[0]]
    return "something is left" if diagnosis.verdict != (NONE,) else "the recordings are in doubt"


def _recordings(count: int) -> str:
    return "1 recording" if count == 1 else f"{count} recordings"


def percent(share: float) -> str:
    """A share in percent."""
    return f"{100.0 * share:.0f} %" if math.isfinite(share) else "–"


def checks(items: Sequence[DataDoubt]) -> list[dict[str, str]]:
    """What is wrong with the data themselves: where, and in words."""
    found = []
    for item in items:
        recording = item.recording or "Several recordings together"
        place = f"{recording}, {item.channel}" if item.channel else recording
        found.append({"place": place, "sentence": item.sentence})
    return found


def finding_card(finding: Finding, recordings: Sequence[str]) -> dict[str, Any]:
    """One finding in words.

    Args:
        finding: of the diagnosis.
        recordings: names of the sources.
    """
    name, parameters = finding.name, amounts(shown_parameters(finding))
    sentence = finding_in_words(finding)
    equivalents = _equivalents(name, finding.equivalence_set)
    where = finding.where
    return {
        "title": title(name),
        "sentence": f"{sentence[:1].upper()}{sentence[1:]}{when(finding)}.",
        "where": "not located" if where is None else where.phrase,
        "evidence": _evidence(finding),
        "sizes": [f"{key.replace('_', ' ')} {size(item)}" for key, item in parameters.items()],
        "soil": None if finding.soil is None else soil_section(finding.soil),
        "spans": "" if where is None else _spans(where.spans, recordings),
        "equivalents": equivalents,
        "equivalence_note": _equivalence_note(finding, equivalents),
    }


def rejected(items: Sequence[Finding]) -> list[dict[str, str]]:
    """What fits best where nothing may be named: in words, and why it is no name."""
    return [{"title": title(item.name), "evidence": _evidence(item)} for item in items]


def _evidence(finding: Finding) -> str:
    if finding.gate == 0.0:
        return _seen(finding)
    if finding.by_forecasts:
        growth, gate = (f"{100.0 * value:.1f} %" for value in (finding.gain, finding.gate))
        return f"forecasts of what was left out are worse by {growth} without it, at least {gate} is asked for"
    parts = [f"gain {number(finding.gain, 3)}"]
    if finding.gate > 0.0:
        parts.append(f"{number(finding.gain / finding.gate)} times its gate of {number(finding.gate, 3)}")
    parts.append(f"{number(finding.held_out, 3)} on left-out windows")
    parts.append(f"score {number(finding.score, 2)}")
    if finding.calibrated_p is not None:
        parts.append(f"p = {number(finding.calibrated_p, 2)} against the null drives")
    return ", ".join(parts)


def _seen(finding: Finding) -> str:
    """Evidence of what the values themselves show: no window was left out for it."""
    if finding.name == "sensor_hold":
        return f"seen in the values: {finding.gain:.0f} readings are repeats"
    if finding.score > 0.0:
        return f"seen in the values, {number(finding.score, 2)} standard errors beyond doubt"
    return "seen in the values"


def _spans(spans: Sequence[Span], recordings: Sequence[str]) -> str:
    """The stretches that hold most of the gain, in the order of time."""
    chosen = sorted(spans, key=lambda item: -item.share)[:_MOST_SPANS]
    parts = []
    for item in sorted(chosen, key=lambda item: (item.recording, item.start)):
        index = item.recording
        name = recordings[index] if index < len(recordings) else f"recording {index + 1}"
        parts.append(f"{name} {item.start:.0f}–{item.end:.0f} s ({percent(item.share)})")
    more = f"; and {len(spans) - len(chosen)} shorter stretches" if len(spans) > len(chosen) else ""
    return "; ".join(parts) + more


def _equivalents(name: str, weights: Mapping[str, float]) -> list[dict[str, Any]]:
    ordered = sorted((weights or {name: 1.0}).items(), key=lambda item: -item[1])
    return [
        {"name": key, "title": title(key), "percent": round(100.0 * weight), "own": key == name}
        for key, weight in ordered
    ]


def _equivalence_note(finding: Finding, equivalents: Sequence[Mapping[str, Any]]) -> str:
    if finding.gate <= 0.0:
        return "Seen in the values themselves, before any model: no other effect was compared with it."
    if finding.by_forecasts:
        return "Decided by forecasts of what was left out of the fit: no other effect was compared with it."
    if len(equivalents) > 1:
        others = " or ".join(in_sentence(item["name"]) for item in equivalents if not item["own"])
        return f"These recordings do not separate it from {others}: weights by resampling the windows."
    from ddagr_gym.physics.effects.registry import effect_kinds

    kind = effect_kinds().get(finding.name)
    rivals = ", ".join(in_sentence(other) for other in (kind.confused_with if kind else ()))
    usual = f" It is often confused with {rivals}; not here." if rivals else ""
    return f"Nothing else in the library explains these windows nearly as well.{usual}"


def condition_rows(localisation: Localisation | None, findings: Sequence[Finding]) -> list[dict[str, str]]:
    """Operating conditions that stand out, of what was found, of the mismatch and of what remains."""
    sources = [(title(f.name), f.where) for f in findings if f.where is not None]
    if localisation is not None:
        sources += [("what is explained", localisation.mismatch)] if len(findings) > 1 else []
        sources.append(("what remains", localisation.remaining))
    return [
        {
            "what": what,
            "where": _range(item),
            "share": percent(min(item.weight_inside, 1.0)),
            "time": percent(item.time_inside),
            "p": number(item.p, 1),
        }
        for what, where in sources
        for item in where.regimes
        if item.clear
    ]


def _range(item: OperatingConditionShare) -> str:
    if item.name == "place":
        x, y, radius = item.edges
        return f"within {number(radius)} m of ({x:.2f}, {y:.2f}) m"
    return range_in_words(item.name, item.low, item.high)


def gate_note(gates: GatesUsed, robot: str = "", soil: str = "") -> str:
    """Null drives behind the gates, and whether they are of another robot or soil than the diagnosis.

    Args:
        gates: of the diagnosis.
        robot: of the diagnosis; "" where unknown.
        soil: of the diagnosis; "" where unknown.
    """
    if not gates.nulls:
        return "no null drives were used for it here."
    drives = _NULLS.get(gates.kind or "", "null drives")
    made = f"set by {gates.nulls} {drives} at a level of {percent(gates.level)} false alarms over the whole library."
    pairs = ((gates.robot, robot), (gates.soil, soil))
    others = [f"{theirs} instead of {own}" for theirs, own in pairs if theirs and own and theirs != own]
    return f"{made} They are of {' and '.join(others)}: the level is not known to hold here." if others else made


def wrench_rows(localisation: Localisation | None) -> list[list[str]]:
    """Table of the residual wrench."""
    return [
        [
            f"{item.component} [{item.unit}]",
            *(number(v, 2) for v in (item.before, item.after, item.deviation, item.chi_before, item.chi_after)),
        ]
        for item in (() if localisation is None else localisation.wrench)
    ]


def fit_table(fit: Certificate) -> dict[str, Any]:
    """Held-out errors as rows of text."""
    rows = []
    for channel, horizons in fit.channels.items():
        name = CHANNEL_NAMES.get(channel, channel.replace("_", " "))
        for horizon, errors in horizons.items():
            unit = errors.unit.replace("^2", "²")
            cells = [_error(item) for item in (errors.raw, errors.refitted, errors.corrected, errors.ceiling)]
            rows.append([f"{name} after {float(horizon):g} s [{unit}]", *cells])
    gain = ", ".join(_share_text(*item) for item in sorted(_gain_shares(fit), key=lambda item: item[0]))
    return {"rows": rows, "judged": _JUDGED[fit.folds], "note": fit.note, "gain": gain}


def _gain_shares(fit: Certificate) -> list[tuple[float, Measured]]:
    """Horizon [s] and share where there is one, the middle horizon first: of the motion, else of the readings."""
    for by_horizon in (fit.gain_share, fit.gain_share_readings):
        shares = [(float(h), share) for h, share in by_horizon.items() if share is not None]
        if shares:
            return sorted(shares, key=lambda item: abs(math.log(item[0] / _MIDDLE)))
    return []


def _share_text(horizon: float, share: Measured) -> str:
    span = "" if share.interval is None else f" ({percent(share.interval[0])} to {percent(share.interval[1])})"
    return f"{percent(share.value)}{span} after {horizon:g} s"


def _error(item: Measured) -> str:
    span = "" if item.interval is None else f" ({number(item.interval[0])} to {number(item.interval[1])})"
    return f"{number(item.value, 3)}{span}"


def unnamed(item: UnnamedTerms | None) -> dict[str, Any] | None:
    """What has no name as text; its equation is "" where none was stable."""
    if item is None:
        return None
    acts = "Where it acts most" if item.equation else "Where most is left"
    return {
        "equation": item.equation,
        "where": f"{acts}: {item.where}." if item.where else "",
        "rows": [_term_row(term) for term in item.terms],
        "ceiling": percent(item.ceiling_share),
    }


def _term_row(term: UnnamedTerm) -> list[str]:
    span = f"{number(term.interval[0])} to {number(term.interval[1])}"
    return [term.regressor, term.target, number(term.coefficient, 3), span, term.unit, percent(term.stability)]


def next_drive(item: NextDrivePlan | None) -> dict[str, Any] | None:
    """The proposed manoeuvre as text, or why there is none."""
    if item is None:
        return None
    return {
        "manoeuvre": item.manoeuvre or "No drive of the standard ones",
        "why": item.why,
        "separates": [" from ".join(in_sentence(name) for name in pair) for pair in item.separates],
        "gain_rate": number(item.power, 2) if item.manoeuvre else "",
        "alternatives": [other.manoeuvre for other in item.alternatives],
    }


def shown_gates(diagnosis: Diagnosis) -> Mapping[str, float]:
    """Gates by effect where no finding shows its own; empty elsewhere."""
    return {} if diagnosis.findings else diagnosis.thresholds.gates


def detectable(
    table: Mapping[str, Mapping[str, float | None]], gates: Mapping[str, float] | None = None
) -> list[dict[str, str]]:
    """Least sizes by effect and field, beside the effect's gate.

    Args:
        table: ``detectable`` of a diagnosis.
        gates: gains by effect; "–" stands for one that is not among them.
    """
    from ddagr_gym.physics.effects.registry import effect_kinds

    rows = []
    for name, sizes in table.items():
        kind = effect_kinds().get(name)
        for key, value in sizes.items():
            unit = str(kind.parameter(key).metadata["unit"]) if kind and key in kind.size_names() else "-"
            amount = Amount(value, unit) if value is not None and math.isfinite(value) else None
            field = "" if len(sizes) == 1 else f", {key.replace('_', ' ')}"
            gate = number((gates or {}).get(name, math.nan), 3)
            rows.append({"title": f"{title(name)}{field}", "size": _detectable_size(kind, amount), "gate": gate})
    return rows


def _detectable_size(kind: type[Effect] | None, amount: Amount | None) -> str:
    if kind is not None and kind.categorical:
        return "does not show" if amount is None else "shows"
    if kind is not None and not kind.differentiable:
        return "no limit that was tried" if amount is None else f"limits up to {size(amount)}"
    return "none, however large" if amount is None else size(amount)


def sources(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Recordings, gates and version behind the numbers."""
    gates = diagnosis.thresholds
    rows = [(item.source, f"{item.seconds:.0f} s, SHA-256 {item.sha256}") for item in diagnosis.data]
    rows = rows or [("Recordings", ", ".join(diagnosis.recordings))]
    seed = "" if diagnosis.options.seed is None else str(diagnosis.options.seed)
    rows += [pair for pair in (("Robot", diagnosis.robot), ("Soil", diagnosis.soil), ("Seed", seed)) if pair[1]]
    rows += [
        ("Gates", f"{gates.nulls} null drives, level {gates.level}"),
        ("Null bank", gates.bank),
        ("Intervals", "90 %, by resampling windows"),
        ("Version", f"ddagr-gym {diagnosis.version}, schema {diagnosis.schema}"),
        ("Time taken", f"{diagnosis.seconds:.0f} s"),
    ]
    return rows


def nuisances(values: Mapping[str, float]) -> list[tuple[str, str]]:
    """Refitted nominal parameters."""
    return [
        (name.replace("_", " "), f"{value:+.3g}".replace("-", "−") if math.isfinite(value) else "–")
        for name, value in values.items()
    ]
