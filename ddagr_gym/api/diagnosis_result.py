"""Result of ``ddagr_gym.diagnose``: the answer, the corrected simulator, and their files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from ddagr_gym.api.diagnosis_report import DiagnosisReport
from ddagr_gym.api.results import Table
from ddagr_gym.errors import InputError
from ddagr_gym.files import write_text

if TYPE_CHECKING:
    from ddagr_gym.calibration.run import Outcome as CalibrationOutcome
    from ddagr_gym.diagnosis.pipeline import Outcome
    from ddagr_gym.parameters import Robot, Soil
    from ddagr_gym.viewers.drive_traces import DriveTraces

PAGE = "index.html"


@dataclass(frozen=True, eq=False, repr=False)
class DiagnosisResult(DiagnosisReport):
    """Which physics the nominal simulator leaves out, how big and how sure.

    ``findings[0].parameters["angle"]`` is an estimate with ``value``, ``unit`` and a 90 % ``interval``; ``float()`` of
    it is its value.

    ``report`` writes diagnosis.json, evidence.npz, and what the simulator loads: effects.json and effects.yaml with the
    named effects, robot.yaml and soil.yaml with the refitted nominal parameters (left out where ``robot`` is None).
    Unless ``names_only`` it adds the page, index.html, and its figures, which need matplotlib and jinja2.

    Attributes:
        outcome: answer, session and search behind it (:mod:`ddagr_gym.diagnosis.pipeline`).
        drivetrain: calibration with the recordings, where the whole drivetrain was asked for; else None.
    """

    outcome: Outcome
    drivetrain: CalibrationOutcome | None = None

    @property
    def nominal(self) -> tuple[Robot, Soil]:
        """Robot and soil that the recordings were compared with."""
        return self.outcome.nominal

    @property
    def robot(self) -> Robot | None:
        """Robot with refitted parameters; None where the values make no valid one (see ``refit_note``)."""
        return self._refitted[0]

    @property
    def soil(self) -> Soil | None:
        """Soil with refitted parameters; None where the values make no valid one (see ``refit_note``)."""
        return self._refitted[1]

    @property
    def refit_note(self) -> str:
        """Why there is no refitted robot and soil; "" where there is."""
        return self._refitted[2]

    @cached_property
    def _refitted(self) -> tuple[Robot | None, Soil | None, str]:
        from ddagr_gym.identification.fitted_values import with_values

        try:
            return *with_values(*self.nominal, self.diagnosis.nuisances), ""
        except InputError as error:
            return None, None, f"the refitted values are no soil: {error}"

    def tables(self) -> Sequence[Table]:
        """Findings and parts of the drivetrain with sizes, and errors on unseen drives."""
        from ddagr_gym.reporting.diagnosis_text import FINDING_HEADER, FIT_HEADER, finding_rows, fit_rows
        from ddagr_gym.reporting.drivetrain_section import PART_HEADER, part_rows

        fit = self.diagnosis.fit
        found = (
            Table(FINDING_HEADER, finding_rows(self.diagnosis)),
            Table(PART_HEADER, part_rows(self.diagnosis)),
            Table(FIT_HEADER, [] if fit is None else fit_rows(fit)),
        )
        return [table for table in found if table.rows]

    def __str__(self) -> str:
        from ddagr_gym.reporting.diagnosis_text import outcome_text

        return outcome_text(self.diagnosis)

    def _traces(self) -> tuple[DriveTraces, ...]:
        from ddagr_gym.viewers.drive_traces import drive_traces

        session, found = self.outcome.session, self.outcome.found
        return drive_traces(session.problem, found.nominal.fitted, found.chosen.fitted, session.mended.given)

    def _fill(self, folder: Path, progress: Callable[[str], None] | None) -> None:
        from ddagr_gym.diagnosis.answer import evidence
        from ddagr_gym.reporting import diagnosis_page

        self._save_effects(folder)
        self._save_refitted(folder)
        self.to_json(folder / "diagnosis.json")
        self.outcome.evidence.save(folder / evidence.NAME)
        if not self.diagnosis.options.names_only:
            given = self.outcome.session.mended.given
            diagnosis_page.write_report(folder, self.diagnosis, self.outcome.evidence, recordings=given)
            (folder / diagnosis_page.PAGE).rename(folder / PAGE)
            self._save_drivetrain(folder)

    def _save_drivetrain(self, folder: Path) -> None:
        """The page of the calibration that found the drivetrain, which the diagnosis's page links to."""
        from ddagr_gym.reporting.calibration_page import write_page
        from ddagr_gym.reporting.drivetrain_section import DRIVETRAIN_FOLDER

        if self.drivetrain is not None:
            (folder / DRIVETRAIN_FOLDER).mkdir(exist_ok=True)
            write_page(folder / DRIVETRAIN_FOLDER, self.drivetrain.calibration, self.drivetrain.forecasts)

    def _save_refitted(self, folder: Path) -> None:
        from ddagr_gym.config import dump_config

        for name, fitted in (("robot.yaml", self.robot), ("soil.yaml", self.soil)):
            if fitted is not None:
                write_text(folder / name, f"# refitted: {self.sentence}\n{dump_config(fitted)}")
