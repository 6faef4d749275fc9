"""The answer of a diagnosis and its JSON form, which ``docs/diagnosis_schema.md`` explains entry by entry."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from ddagr_gym.diagnosis.preprocessing.data_checks import DataDoubt
from ddagr_gym.diagnosis.result.schema import SCHEMA, check_form
from ddagr_gym.errors import InputError
from ddagr_gym.files import atomic_path

NONE = "none"
UNKNOWN = "unknown"


@dataclass(frozen=True)
class Estimate:
    """A parameter of a named effect.

    Attributes:
        value: in unit.
        unit: SI.
        interval: 90 %, resampled over windows and widened by the forms of simulators; None where it was not fitted.
    """

    value: float
    unit: str
    interval: tuple[float, float] | None = None

    def __float__(self) -> float:
        return self.value

    def __str__(self) -> str:
        unit = "" if self.unit == "-" else f" {self.unit}"
        between = "" if self.interval is None else f" ({self.interval[0]:.3g} to {self.interval[1]:.3g})"
        return f"{self.value:.3g}{unit}{between}"


@dataclass(frozen=True)
class Finding:
    """One named effect.

    Attributes:
        name: word of the verdict's table.
        parameters: by name.
        gain: fall of the cost over the dispersion when it was added (linear scan).
        gate: what the gain had to pass.
        score: cluster-robust, along the fitted direction.
        held_out: gain on left-out windows.
        channels: share of each channel in the fall of its misfit.
        equivalence_set: names that the same windows may mean, with their weights; itself included.
        where: where it shows: a mapping of :mod:`ddagr_gym.diagnosis.localisation.localise`; None where it was not
            asked.
        calibrated_p: share of null drives that reach its evidence; None where no bank was asked.
    """

    name: str
    parameters: Mapping[str, Estimate]
    gain: float
    gate: float
    score: float
    held_out: float
    channels: Mapping[str, float] = field(default_factory=dict)
    equivalence_set: Mapping[str, float] = field(default_factory=dict)
    where: Mapping[str, Any] | None = None
    calibrated_p: float | None = None


@dataclass(frozen=True)
class DataSource:
    """A recording that was used.

    Attributes:
        source: its name.
        sha256: of the file it came from, or of its values where it came from no file.
        rows: how many.
        seconds: from the first to the last.
    """

    source: str
    sha256: str
    rows: int
    seconds: float


@dataclass(frozen=True)
class Diagnosis:
    """What recordings say about the physics that the nominal simulator leaves out.

    Attributes:
        verdict: names of the table, or ("none",) or ("unknown",).
        complete: whether nothing more is left than in drives with nothing missing.
        findings: one per name, in the order in which they were found.
        sentence: the answer in words.
        misfit: mean square of each channel's residual for "nominal" and "corrected", and the null bank's "limit".
        detectable: least detectable distance from neutral by effect and field (None: none, however large), of effects
            without a name beside those that have one.
        nuisances: refitted nominal parameters by name.
        recordings: names of the sources.
        thresholds: nulls, hash and kind of the bank, level, and the gate of every effect.
        seconds: of the run.
        version: of the package.
        fit: errors of the models on drives that they were not fitted to
            (:mod:`ddagr_gym.diagnosis.certification.certify`).
        localisation: where something is missing (:mod:`ddagr_gym.diagnosis.localisation.localise`).
        unnamed: terms without a name, with their equations, where the verdict is incomplete or unknown.
        next_drive: the drive that would tell the remaining rivals apart best.
        data: the recordings, with hashes.
        robot: name of the nominal robot.
        soil: name of the nominal soil.
        options: windows, priors and seed, so that the same can be run again.
        checks: what the recordings say is wrong with themselves (:mod:`ddagr_gym.diagnosis.preprocessing.data_checks`).
        rejected: what fits best where that leaves too much to be named.
        detectable_alone: the same as ``detectable`` for all effects before any was named.
        schema: of this file.
    """

    verdict: tuple[str, ...]
    complete: bool
    findings: tuple[Finding, ...]
    sentence: str
    misfit: Mapping[str, Mapping[str, float]]
    detectable: Mapping[str, Mapping[str, float | None]]
    nuisances: Mapping[str, float]
    recordings: tuple[str, ...]
    thresholds: Mapping[str, Any]
    seconds: float
    version: str
    fit: Mapping[str, Any] | None = None
    localisation: Mapping[str, Any] | None = None
    unnamed: Mapping[str, Any] | None = None
    next_drive: Mapping[str, Any] | None = None
    data: tuple[DataSource, ...] = ()
    robot: str = ""
    soil: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)
    checks: tuple[DataDoubt, ...] = ()
    rejected: tuple[Finding, ...] = ()
    detectable_alone: Mapping[str, Mapping[str, float | None]] = field(default_factory=dict)
    schema: str = SCHEMA


def as_mapping(diagnosis: Diagnosis) -> dict[str, Any]:
    """Plain mapping as it stands in ``diagnosis.json``."""
    return json.loads(json.dumps(_finite(asdict(diagnosis))))


def _finite(value: Any) -> Any:
    """Infinite and undefined numbers as None, which JSON can hold."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return value


def validate(mapping: Mapping[str, Any]) -> None:
    """Check a mapping against the schema.

    Raises:
        InputError: another schema, a missing or wrong entry, names that no library has.
    """
    from ddagr_gym.physics.effects.registry import effect_kinds

    if mapping.get("schema") != SCHEMA:
        raise InputError(f"the diagnosis has schema {mapping.get('schema')!r}: this version reads {SCHEMA!r}.")
    check_form(mapping)
    known = {NONE, UNKNOWN, *effect_kinds()}
    wrong = [name for name in mapping["verdict"] if name not in known]
    if wrong or not mapping["verdict"]:
        raise InputError(
            f"the diagnosis has the verdict {mapping['verdict']!r}: give names of effects, none or unknown."
        )
    named = [finding["name"] for finding in mapping["findings"]]
    names = [name for name in mapping["verdict"] if name not in (NONE, UNKNOWN)]
    if sorted(named) != sorted(names):
        raise InputError(f"the diagnosis names {mapping['verdict']!r} and has findings on {named!r}: make them agree.")


def save(diagnosis: Diagnosis, path: Path) -> None:
    """Write ``diagnosis.json``, all or nothing, after validation."""
    mapping = as_mapping(diagnosis)
    validate(mapping)
    with atomic_path(path) as part:
        part.write_text(json.dumps(mapping, indent=1, allow_nan=False) + "\n")


def load(path: Path) -> dict[str, Any]:
    """Read and validate a ``diagnosis.json``.

    Raises:
        InputError: no such file, no JSON, or not of this schema.
    """
    try:
        mapping = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read as a diagnosis ({error}): make it with `ddagr diagnose`.") from None
    if not isinstance(mapping, dict):
        raise InputError(f"{path} holds no mapping: make it with `ddagr diagnose`.")
    validate(mapping)
    return mapping
