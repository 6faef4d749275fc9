"""What the page of a diagnosis says in words and numbers, from ``diagnosis.json``."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ddagr_gym.diagnosis.localisation.operating_conditions import REGIME_EXCESS, REGIME_LEVEL
from ddagr_gym.diagnosis.wording import (
    DEGREES,
    Amount,
    amounts,
    describe,
    in_sentence,
    number,
    quantity,
    range_in_words,
    title,
)
from ddagr_gym.reporting.diagnosis_figures import LABELS

if TYPE_CHECKING:
    from ddagr_gym.physics.effects import Effect

Entry = Mapping[str, Any]

_MOST_SPANS = 8

_MIDDLE = 5.0  # [s] the horizon that stands for all

_JUDGED = {
    "by recording": "Errors on each recording, by models whose sizes were fitted to the others",
    "by time": "Errors on each half of the one recording, by models whose sizes were fitted to the other half",
}

_NULLS = {
    "simulated": "simulated drives with nothing missing, made by structurally different simulators,",
    "ordinary": "pieces of real drives that are taken to be ordinary,",
}


def tiles(diagnosis: Entry, seconds: float) -> list[dict[str, str]]:
    """The few numbers under the headline.

    Args:
        diagnosis: content of ``diagnosis.json``.
        seconds: of drive.
    """
    verdict = ", ".join(title(name) if name not in ("none", "unknown") else name for name in diagnosis["verdict"])
    left = "something is left" if diagnosis["verdict"] != ["none"] else "not every channel speaks"
    status = "complete: nothing else shows" if diagnosis["complete"] else f"incomplete: {left}"
    explained = (diagnosis.get("localisation") or {}).get("explained")
    shares = _gain_shares(diagnosis.get("fit") or {})
    found = [
        {"value": verdict, "label": status},
        {"value": f"{seconds:.0f} s", "label": f"of drive in {len(diagnosis['recordings'])} recordings"},
        {"value": str(diagnosis["thresholds"].get("nulls", "–")), "label": "null drives behind the gates"},
    ]
    if explained is not None and any(finding.get("gate") for finding in diagnosis.get("findings") or []):
        found.insert(1, {"value": percent(explained), "label": "of the mismatch above the noise explained"})
    if shares:
        horizon, share = shares[0]
        label = f"of what is explicable where no size was fitted, {horizon:g} s ahead"
        found.insert(2, {"value": percent(share["value"]), "label": label})
    return found


def percent(share: float) -> str:
    """A share in percent."""
    return f"{100.0 * share:.0f} %"


def checks(items: Sequence[Entry] | None) -> list[dict[str, str]]:
    """What is wrong with the data themselves: where, and in words."""
    found = []
    for item in items or []:
        recording = str(item.get("recording") or "Several recordings together")
        place = f"{recording}, {item['channel']}" if item.get("channel") else recording
        found.append({"place": place, "sentence": str(item["sentence"])})
    return found


def phrase(where: Entry | None) -> str:
    """Where something lies, in words; "" where nothing says."""
    return str((where or {}).get("phrase") or "")


def finding_card(finding: Entry, recordings: Sequence[str]) -> dict[str, Any]:
    """One finding in words.

    Args:
        finding: of ``diagnosis.json``.
        recordings: names of the sources.
    """
    name, parameters = str(finding["name"]), amounts(finding["parameters"])
    sentence = describe(name, parameters)
    equivalents = _equivalents(name, finding.get("equivalence_set") or {})
    where = finding.get("where") or {}
    return {
        "title": title(name),
        "sentence": f"{sentence[:1].upper()}{sentence[1:]}.",
        "where": where.get("phrase") or "not located",
        "evidence": _evidence(finding),
        "sizes": [f"{key.replace('_', ' ')} {size(item)}" for key, item in parameters.items()],
        "spans": _spans(where.get("spans") or [], recordings),
        "equivalents": equivalents,
        "equivalence_note": _equivalence_note(name, equivalents, seen=not finding.get("gate")),
    }


def rejected(items: Sequence[Entry] | None) -> list[dict[str, str]]:
    """What fits best where nothing may be named: in words, and why it is no name."""
    return [{"title": title(str(item["name"])), "evidence": _evidence(item)} for item in items or []]


def size(amount: Amount) -> str:
    """A parameter with its interval and unit; angles in degrees."""
    unit = amount.unit.replace("^2", "²")
    if unit == "rad":
        return quantity(amount.scaled(DEGREES), "degrees", signed=amount.value < 0.0)
    return quantity(amount, "" if unit == "-" else unit, signed=amount.value < 0.0)


def _evidence(finding: Entry) -> str:
    gate = finding.get("gate") or 0.0
    parts = [f"gain {number(finding['gain'], 3)}"]
    if gate > 0.0:
        parts.append(f"{number(finding['gain'] / gate)} times its gate of {number(gate, 3)}")
    parts.append(f"{number(finding['held_out'], 3)} on left-out windows")
    parts.append(f"score {number(finding['score'], 2)}")
    if finding.get("calibrated_p") is not None:
        parts.append(f"p = {number(finding['calibrated_p'], 2)} against the null drives")
    return ", ".join(parts)


def _spans(spans: Sequence[Entry], recordings: Sequence[str]) -> str:
    """The stretches that hold most of the gain, in the order of time."""
    chosen = sorted(spans, key=lambda item: -item["share"])[:_MOST_SPANS]
    parts = []
    for item in sorted(chosen, key=lambda item: (item["recording"], item["start"])):
        index = int(item["recording"])
        name = recordings[index] if index < len(recordings) else f"recording {index + 1}"
        parts.append(f"{name} {item['start']:.0f}–{item['end']:.0f} s ({percent(item['share'])})")
    more = f"; and {len(spans) - len(chosen)} shorter stretches" if len(spans) > len(chosen) else ""
    return "; ".join(parts) + more


def _equivalents(name: str, weights: Mapping[str, float]) -> list[dict[str, Any]]:
    ordered = sorted((weights or {name: 1.0}).items(), key=lambda item: -item[1])
    return [
        {"name": key, "title": title(key), "percent": round(100.0 * weight), "own": key == name}
        for key, weight in ordered
    ]


def _equivalence_note(name: str, equivalents: Sequence[Entry], seen: bool) -> str:
    if seen:
        return "Seen in the values themselves, before any model: no other effect was held against it."
    if len(equivalents) > 1:
        others = " or ".join(in_sentence(item["name"]) for item in equivalents if not item["own"])
        return f"These recordings do not separate it from {others}: weights by resampling the windows."
    from ddagr_gym.physics.effects.registry import effect_kinds

    kind = effect_kinds().get(name)
    rivals = ", ".join(in_sentence(other) for other in (kind.confused_with if kind else ()))
    usual = f" It is often confused with {rivals}; not here." if rivals else ""
    return f"Nothing else in the library explains these windows nearly as well.{usual}"


def regime_rows(localisation: Entry, findings: Sequence[Entry]) -> list[dict[str, str]]:
    """Regimes that stand out, of what was found, of the mismatch and of what remains."""
    sources = [(title(str(f["name"])), f.get("where") or {}) for f in findings]
    sources += [("what is explained", localisation.get("mismatch") or {})] if len(findings) > 1 else []
    sources.append(("what remains", localisation.get("remaining") or {}))
    rows = []
    for what, where in sources:
        for item in where.get("regimes") or []:
            if item["p"] < REGIME_LEVEL and item["excess"] >= REGIME_EXCESS:
                inside = min(item["weight_inside"], 1.0)
                rows.append(
                    {
                        "what": what,
                        "where": _range(item),
                        "share": percent(inside),
                        "time": percent(item["time_inside"]),
                        "p": number(item["p"], 1),
                    }
                )
    return rows


def _range(item: Entry) -> str:
    if item["name"] == "place":
        x, y, radius = item["edges"]
        return f"within {number(radius)} m of ({x:.2f}, {y:.2f}) m"
    return range_in_words(str(item["name"]), item.get("low"), item.get("high"))


def gate_note(thresholds: Entry, robot: str = "", soil: str = "") -> str:
    """What the gates are made of, and whether that was something else than what is diagnosed.

    Args:
        thresholds: entry of ``diagnosis.json``.
        robot: of the diagnosis; "" where unknown.
        soil: of the diagnosis; "" where unknown.
    """
    nulls, level = thresholds.get("nulls") or 0, thresholds.get("level")
    if not nulls or level is None:
        return "no null drives stand behind it here."
    drives = _NULLS.get(str(thresholds.get("kind")), "null drives")
    made = f"set by {nulls} {drives} at a level of {percent(level)} false alarms over the whole library."
    pairs = ((thresholds.get("robot"), robot), (thresholds.get("soil"), soil))
    others = [f"{theirs} instead of {own}" for theirs, own in pairs if theirs and own and theirs != own]
    return f"{made} They are of {' and '.join(others)}: the level is not known to hold here." if others else made


def wrench_rows(localisation: Entry) -> list[list[str]]:
    """Table of the residual wrench."""
    return [
        [
            f"{item['component']} [{item['unit']}]",
            *(number(item[key], 2) for key in ("before", "after", "deviation", "chi_before", "chi_after")),
        ]
        for item in localisation.get("wrench") or []
    ]


def fit_table(fit: Entry) -> dict[str, Any]:
    """Held-out errors as rows of text."""
    rows = []
    for channel, horizons in fit["channels"].items():
        for horizon, arms in horizons.items():
            unit = str(arms.get("unit") or "").replace("^2", "²")
            name = LABELS.get(channel, str(channel).replace("_", " "))
            cells = [_error(arms.get(arm)) for arm in ("raw", "refitted", "corrected", "ceiling")]
            rows.append([f"{name} after {float(horizon):g} s [{unit}]", *cells])
    gain = ", ".join(_share_text(*item) for item in sorted(_gain_shares(fit)))
    judged = _JUDGED.get(str(fit.get("folds")), "Errors where the models' sizes were not fitted")
    note = fit.get("note") or "Which effects are in the model was decided on all recordings."
    return {"rows": rows, "judged": judged, "note": str(note), "gain": gain}


def _gain_shares(fit: Entry) -> list[tuple[float, Entry]]:
    """Horizon [s] and share where there is one, the middle horizon first: of the motion, else of the readings."""
    for name in ("gain_share", "gain_share_readings"):
        shares = [(float(h), share) for h, share in (fit.get(name) or {}).items() if share is not None]
        if shares:
            return sorted(shares, key=lambda item: abs(math.log(item[0] / _MIDDLE)))
    return []


def _share_text(horizon: float, share: Entry) -> str:
    interval = share.get("interval")
    span = f" ({percent(interval[0])} to {percent(interval[1])})" if interval else ""
    return f"{percent(share['value'])}{span} after {horizon:g} s"


def _error(item: Entry | None) -> str:
    if not item or item.get("value") is None:
        return "–"
    interval = item.get("interval")
    return number(item["value"], 3) + (f" ({number(interval[0])} to {number(interval[1])})" if interval else "")


def unnamed(item: Entry | None) -> dict[str, Any] | None:
    """What has no name as text; its equation is "" where none was stable."""
    if not item:
        return None
    equation, place, share = item.get("equation") or "", item.get("where") or "", item.get("ceiling_share")
    acts = "Where it acts most" if equation else "Where most is left"
    return {
        "equation": equation,
        "where": f"{acts}: {place}." if place else "",
        "rows": [_term_row(term) for term in item.get("terms") or []],
        "ceiling": "" if share is None else percent(share),
    }


def _term_row(term: Entry) -> list[str]:
    interval = term.get("interval")
    span = "–" if not interval else f"{number(interval[0])} to {number(interval[1])}"
    stability = "–" if term.get("stability") is None else percent(term["stability"])
    return [term["regressor"], term["target"], number(term["coefficient"], 3), span, term["unit"], stability]


def next_drive(item: Entry | None) -> dict[str, Any] | None:
    """The proposed manoeuvre as text, or why there is none."""
    if not item or not item.get("why"):
        return None
    drive = str(item.get("manoeuvre") or "No drive of the standard ones")
    power = item.get("power") if item.get("manoeuvre") else None
    others = [_alternative(other) for other in item.get("alternatives") or []]
    return {
        "manoeuvre": drive.replace("_", " "),
        "why": item.get("why") or "",
        "separates": [" from ".join(in_sentence(str(name)) for name in pair) for pair in item.get("separates") or []],
        "gain_rate": "" if power is None else number(power, 2),
        "alternatives": others,
    }


def _alternative(other: Any) -> str:
    name = other.get("manoeuvre", other) if isinstance(other, Mapping) else other
    return str(name).replace("_", " ")


def shown_gates(diagnosis: Entry) -> Mapping[str, float]:
    """Gates by effect where no finding shows its own; empty elsewhere."""
    return {} if diagnosis.get("findings") else diagnosis["thresholds"].get("gates") or {}


def detectable(
    table: Mapping[str, Mapping[str, float | None]], gates: Mapping[str, float] | None = None
) -> list[dict[str, str]]:
    """Least sizes by effect and field, beside the effect's gate.

    Args:
        table: entry ``detectable`` of ``diagnosis.json``.
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


def sources(diagnosis: Entry) -> list[tuple[str, str]]:
    """Recordings, gates and version behind the numbers."""
    thresholds = diagnosis["thresholds"]
    data = diagnosis.get("data") or []
    rows = [(str(item["source"]), f"{item['seconds']:.0f} s, SHA-256 {item['sha256']}") for item in data]
    rows = rows or [("Recordings", ", ".join(diagnosis["recordings"]))]
    seed = (diagnosis.get("options") or {}).get("seed")
    for label, value in (("Robot", diagnosis.get("robot")), ("Soil", diagnosis.get("soil")), ("Seed", seed)):
        if value not in (None, ""):
            rows.append((label, str(value)))
    rows += [
        ("Gates", f"{thresholds.get('nulls', 0)} null drives, level {thresholds.get('level', '–')}"),
        ("Null bank", str(thresholds.get("bank", "–"))),
        ("Intervals", "90 %, by resampling windows"),
        ("Version", f"ddagr-gym {diagnosis['version']}, schema {diagnosis['schema']}"),
        ("Time taken", f"{diagnosis['seconds']:.0f} s"),
    ]
    return rows


def nuisances(values: Mapping[str, float | None]) -> list[tuple[str, str]]:
    """Refitted nominal parameters."""
    return [
        (name.replace("_", " "), "–" if value is None else f"{value:+.3g}".replace("-", "−"))
        for name, value in values.items()
    ]
