"""What results of ``ddagr_gym.diagnose`` share, with a calibration and without."""

from __future__ import annotations

import os
from abc import abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from ddagr_gym.api.results import Report
from ddagr_gym.extras import need

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.answer.verdict import Diagnosis, Finding
    from ddagr_gym.physics.effects import Effect
    from ddagr_gym.viewers.drive_traces import DriveTraces


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
        """Named effects at their fitted sizes, as ``gym.make(effects=...)``, simulate and replay take them.

        With the factors of both banks that were fitted beside a drivetrain and are too much alike for a name.
        """
        return self.outcome.effects

    @property
    def headline(self) -> str:
        """The answer in words."""
        return self.sentence

    def to_json(self, path: str | os.PathLike[str]) -> None:
        """Write diagnosis.json (``docs/diagnosis_schema.md``), whole or not at all."""
        from ddagr_gym.diagnosis.result.files import save

        save(self.diagnosis, Path(path))

    def to_mcap(self, path: str | os.PathLike[str], *, progress: Callable[[str], None] | None = None) -> Path:
        """Write the drives for Foxglove and PlotJuggler, whole or not at all, and a layout of Foxglove beside them.

        The file has what was read and compared, the predictions of the nominal, the refitted and the corrected
        simulator, residuals over the noise, poses and paths, and findings with their stretches.

        Args:
            path: file to write, which ends in ``.mcap``; the layout is ``.layout.json`` in place of that.
            progress: called with a line of text from time to time.

        Returns:
            The file.

        Raises:
            InputError: another suffix, a folder or a device, or foxglove-sdk is not installed.
        """
        need("foxglove")
        from ddagr_gym.viewers.mcap_file import write_mcap

        write_mcap(path, self.diagnosis, self._traces(), progress)
        return Path(path)

    def to_rrd(self, path: str | os.PathLike[str]) -> Path:
        """Write the same for Rerun, whole or not at all.

        Args:
            path: file to write, which ends in ``.rrd``.

        Returns:
            The file.

        Raises:
            InputError: another suffix, a folder or a device, or rerun-sdk is not installed.
        """
        need("rerun")
        from ddagr_gym.viewers.rerun_file import write_rrd

        write_rrd(path, self.diagnosis, self._traces())
        return Path(path)

    @abstractmethod
    def _traces(self) -> tuple[DriveTraces, ...]:
        """What the models predict along each drive."""

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
