"""``ddagr_gym.check``: whether recordings are sound, before anything is concluded from them."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ddagr_gym.api.drive_names import numbered
from ddagr_gym.api.inputs import Sources, recordings_from
from ddagr_gym.api.nominal import RobotLike
from ddagr_gym.api.results import Report, Table
from ddagr_gym.errors import InputError, at_least
from ddagr_gym.files import write_json
from ddagr_gym.progress import counting

if TYPE_CHECKING:
    from ddagr_gym.recordings.checks.findings import CheckFinding, CheckReport
    from ddagr_gym.recordings.schema import Recording

SCHEMA_VERSION = 1
"""Of the JSON of :meth:`CheckResult.to_json` and of ``together.json``."""


@dataclass(frozen=True, eq=False, repr=False)
class CheckResult(Report):
    """Findings of the checks of recordings; ``report`` writes one figure and one JSON file for each recording.

    Attributes:
        reports: one per recording; each has ``findings``, ``suspicious`` and ``sentences``.
        together: findings that need several recordings.
        recordings: that were checked.
        seed: of the resampled intervals.
    """

    reports: tuple[CheckReport, ...]
    together: tuple[CheckFinding, ...]
    recordings: tuple[Recording, ...]
    seed: int

    @property
    def findings(self) -> tuple[CheckFinding, ...]:
        """Answers to all questions, one recording after the other, then those about all together."""
        return (*(finding for report in self.reports for finding in report.findings), *self.together)

    @property
    def suspicious(self) -> tuple[CheckFinding, ...]:
        """Findings that need attention."""
        return tuple(finding for finding in self.findings if finding.status == "suspicious")

    @property
    def sound(self) -> bool:
        """Whether nothing is suspicious and no value is missing or implausible."""
        return not self.suspicious and not any(report.sentences for report in self.reports)

    @property
    def headline(self) -> str:
        """How many findings are suspicious, of how many."""
        names = ", ".join(report.source for report in self.reports)
        doubts = sum(len(report.sentences) for report in self.reports)
        also = f", {doubts} doubts about values" if doubts else ""
        return f"{names}: {len(self.suspicious)} of {len(self.findings)} findings suspicious{also}"

    def tables(self) -> Sequence[Table]:
        """Findings that did not pass, by recording."""
        from ddagr_gym.reporting.check_text import FINDING_HEADER, finding_row

        groups = [(report.source, report.findings) for report in self.reports]
        groups += [(f"all {len(self.reports)} runs together", self.together)] if self.together else []
        return [
            Table(FINDING_HEADER, [finding_row(f) for f in findings if f.status != "pass"], caption)
            for caption, findings in groups
        ]

    def text(self, everything: bool = False) -> str:
        """Tables as ``ddagr check`` prints them; with those that passed where ``everything``."""
        from ddagr_gym.reporting.check_text import findings_text, report_text

        texts = [report_text(report, everything) for report in self.reports]
        if self.together:
            texts.append(f"\nall {len(self.reports)} runs together\n{findings_text(self.together, everything)}")
        return "\n".join(texts)

    def __str__(self) -> str:
        return self.text()

    def to_json(self, path: str | os.PathLike[str]) -> None:
        """Write all findings as one JSON file: ``schema_version``, ``runs`` (reports) and ``together`` (findings)."""
        runs, together = [report.to_json() for report in self.reports], [f.to_json() for f in self.together]
        write_json(Path(path), {"schema_version": SCHEMA_VERSION, "runs": runs, "together": together})

    def _fill(self, folder: Path, progress: Callable[[str], None] | None) -> None:
        import numpy as np

        from ddagr_gym.reporting.check_figure import save_check_figure

        stems = [Path(report.source).name.split(".", 1)[0] or "run" for report in self.reports]
        names = numbered(["together", *stems], "{}_{}")[1:]
        with counting(len(self.reports), "drawing", progress) as steps:
            for name, recording, report in zip(names, self.recordings, self.reports, strict=True):
                save_check_figure(recording, report, np.random.default_rng(self.seed), folder / f"{name}.png")
                write_json(folder / f"{name}.json", report.to_json())
                steps.advance()
        if self.together:
            findings = [finding.to_json() for finding in self.together]
            write_json(folder / "together.json", {"schema_version": SCHEMA_VERSION, "findings": findings})


def check(
    recordings: Sources,
    robot: RobotLike | None = None,
    seed: int = 0,
    *,
    column_map: str | os.PathLike[str] | None = None,
) -> CheckResult:
    """Check recordings: rates, gaps, clocks, signs, scales, stuck channels, repeated readings, noise.

    Every question is answered with pass, suspicious or not testable, and what to do. Values carry 99 % intervals; one
    is suspicious only when its whole interval lies outside its sound range. Several recordings of one robot are also
    judged together.

    Args:
        recordings: one or several recordings, tables with the schema's columns, paths of files or folders.
        robot: that drove (name, YAML file or object), for checks that need its wheel radius [m] and track [m]; the
            recordings' own when it is None.
        seed: of the resampled intervals.
        column_map: shipped map by name or the path of one's own, for files that are not imported yet.

    Returns:
        Findings with values, intervals and remedies.

    Raises:
        InputError: no recording, one that cannot be read, or recordings of two robots.

    Examples:
        >>> import ddagr_gym
        >>> drive = ddagr_gym.simulate("arcs", rate=50.0, pose_rate=5.0)
        >>> result = ddagr_gym.check(drive)
        >>> result.sound, len(result.suspicious)
        (True, 0)
    """
    import numpy as np

    from ddagr_gym.recordings.checks.across import across_runs
    from ddagr_gym.recordings.checks.run import check_recording

    at_least(seed=(seed, 0))
    found = recordings_from(recordings, robot, column_map)
    robots = sorted({recording.meta.robot for recording in found} - {""})
    if len(robots) > 1:
        raise InputError(
            f"the runs are of the robots {', '.join(robots)}: check one robot at a time, with --robot NAME."
        )
    reports = tuple(check_recording(recording, np.random.default_rng(seed)) for recording in found)
    return CheckResult(reports, tuple(across_runs(list(found), list(reports))), found, seed)
