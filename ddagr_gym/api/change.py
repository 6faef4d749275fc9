"""``ddagr_gym.diagnose(..., calibration=...)`` and ``before=...``: what changed against ordinary drives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ddagr_gym.api.diagnosis_report import DiagnosisReport
from ddagr_gym.api.results import Table
from ddagr_gym.files import write_text

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.change.run import Outcome
    from ddagr_gym.parameters import Robot, Soil
    from ddagr_gym.recordings.schema import Recording
    from ddagr_gym.viewers.drive_traces import DriveTraces


@dataclass(frozen=True, eq=False, repr=False)
class ChangeResult(DiagnosisReport):
    """What changed against the ordinary drives of a calibrated robot, how much and how sure.

    ``report`` writes diagnosis.json, effects.json and effects.yaml with the named effects at their fitted sizes, for
    the calibrated robot, and the page, index.html; against drives from before also robot.yaml and soil.yaml as fitted
    to these.

    Attributes:
        outcome: the answer and the models behind it (:mod:`ddagr_gym.diagnosis.change.run`).
        with_page: whether ``report`` writes the page, which needs matplotlib and jinja2.
        nominal: robot and soil as fitted to drives from before; None with a calibration, which has them.
    """

    outcome: Outcome
    with_page: bool = True
    nominal: tuple[Robot, Soil] | None = None

    def tables(self) -> Sequence[Table]:
        """Findings with sizes, and shifts of all effects."""
        from ddagr_gym.reporting.change_text import CHANGED_HEADER, SHIFT_HEADER, changed_rows, shift_rows

        found = [Table(CHANGED_HEADER, changed_rows(self.diagnosis))] if self.findings else []
        return [*found, Table(SHIFT_HEADER, shift_rows(self.diagnosis))]

    def __str__(self) -> str:
        from ddagr_gym.reporting.change_text import change_text

        return change_text(self.diagnosis)

    def _traces(self) -> tuple[DriveTraces, ...]:
        from ddagr_gym.viewers.drive_traces import drive_traces

        outcome, models = self.outcome, self.outcome.named.models
        return drive_traces(outcome.problem, models[0].fitted, models[-1].fitted, outcome.mended.given)

    def _fill(self, folder: Path, progress: Callable[[str], None] | None) -> None:
        from ddagr_gym.config import dump_config
        from ddagr_gym.reporting.change_page import write_page

        self._save_effects(folder)
        self.to_json(folder / "diagnosis.json")
        for name, fitted in zip(("robot.yaml", "soil.yaml"), self.nominal or (), strict=False):
            write_text(folder / name, f"# fitted to the drives before: {self.sentence}\n{dump_config(fitted)}")
        if self.with_page:
            write_page(folder, self.diagnosis)


def changed(
    recordings: Sequence[Recording],
    calibration: Path,
    ground: str,
    *,
    seed: int,
    threads: int,
    with_page: bool,
    progress: Callable[[str], None],
) -> ChangeResult:
    """Compare drives with the ordinary ones of a calibration; see :func:`ddagr_gym.diagnose`."""
    from ddagr_gym.calibration.ordinary_robot import load_ordinary_robot
    from ddagr_gym.diagnosis.change.run import what_changed

    ordinary = load_ordinary_robot(calibration)
    outcome = what_changed(recordings, ordinary, ground, seed=seed, threads=threads, progress=progress)
    return ChangeResult(outcome, with_page)


def changed_since(
    recordings: Sequence[Recording],
    before: Sequence[Recording],
    robot: Robot,
    soil: Soil,
    *,
    same_ground: bool,
    window: float | None,
    seed: int,
    threads: int,
    with_page: bool,
    progress: Callable[[str], None],
) -> ChangeResult:
    """Compare drives with those from before; see :func:`ddagr_gym.diagnose`."""
    from ddagr_gym.diagnosis.change.before_drives import GROUND, WINDOW
    from ddagr_gym.diagnosis.change.run import what_changed_since

    outcome, known = what_changed_since(
        recordings, before, robot, soil, same_ground=same_ground, window=WINDOW if window is None else window,
        seed=seed, threads=threads, progress=progress,
    )  # fmt: skip
    return ChangeResult(outcome, with_page, (known.robot, known.soils[GROUND]))
