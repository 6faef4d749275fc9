"""What results of ``ddagr_gym.diagnose`` share, with a calibration and without."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from ddagr_gym.api.results import Report

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.answer.verdict import Diagnosis, Finding
    from ddagr_gym.physics.effects import Effect


class Answered(Protocol):
    """What a diagnosis came to, whichever stages it went through."""

    @property
    def diagnosis(self) -> Diagnosis: ...  # noqa: D102

    @property
    def effects(self) -> tuple[Effect, ...]: ...  # noqa: D102


class DiagnosisReport(Report):
    """A report on a :class:`~ddagr_gym.diagnosis.answer.verdict.Diagnosis` and the effects that it names."""

    if TYPE_CHECKING:

        @property
        def outcome(self) -> Answered:
            """Given by the result's own field."""

    @property
    def diagnosis(self) -> Diagnosis:
        """The whole answer, as ``diagnosis.json`` holds it."""
        return self.outcome.diagnosis

    @property
    def verdict(self) -> tuple[str, ...]:
        """Names of effects, or ("none",), or ("unknown",)."""
        return self.diagnosis.verdict

    @property
    def complete(self) -> bool:
        """Whether nothing else is left; see :class:`~ddagr_gym.diagnosis.answer.verdict.Diagnosis`."""
        return self.diagnosis.complete

    @property
    def sentence(self) -> str:
        """The answer in words."""
        return self.diagnosis.sentence

    @property
    def findings(self) -> tuple[Finding, ...]:
        """One per named effect, in the order in which they were found."""
        return self.diagnosis.findings

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Named effects at their fitted sizes, as ``gym.make(effects=...)``, simulate and replay take them."""
        return self.outcome.effects

    @property
    def headline(self) -> str:
        """The answer in words."""
        return self.sentence

    def to_json(self, path: str | os.PathLike[str]) -> None:
        """Write diagnosis.json (``docs/diagnosis_schema.md``), whole or not at all."""
        from ddagr_gym.diagnosis.result.files import save

        save(self.diagnosis, Path(path))

    def _save_effects(self, folder: Path) -> None:
        from ddagr_gym.diagnosis.pipeline import data_hash, effect_intervals
        from ddagr_gym.physics.effects.files import save_effects

        for name in ("effects.json", "effects.yaml"):
            save_effects(
                folder / name,
                self.effects,
                intervals=effect_intervals(self.diagnosis, self.effects),
                data_hash=data_hash(self.diagnosis),
                source=self.sentence,
            )
