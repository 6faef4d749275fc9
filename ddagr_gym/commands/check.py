"""``ddagr check``: whether clocks, signs, units and sensors of recordings are sound, before anything is concluded."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tyro.conf import Positional

from ddagr_gym.commands.output import format_table, output_folder
from ddagr_gym.errors import InputError
from ddagr_gym.progress import Progress

if TYPE_CHECKING:
    from ddagr_gym.recordings.checks.findings import CheckReport, Finding
    from ddagr_gym.recordings.schema import Recording

EXAMPLES = (
    "ddagr check run.parquet",
    "ddagr check drive.csv.gz --map drive_steps --robot warthog --output checked",
    "ddagr check run_1.csv.gz run_2.csv.gz run_3.csv.gz --map concealed --robot ddagr --output checked",
)


@dataclass(frozen=True)
class Arguments:
    """Check recordings: rates, gaps, clocks, signs, scales, stuck and held channels, noise.

    Every question is answered with pass, suspicious or not testable, and what to do. Values carry 99 % intervals; one
    is suspicious only when its whole interval lies outside its sound range. The exit code is 1 when anything is
    suspicious.

    Attributes:
        runs: recordings: Parquet of `ddagr import`, or any source that it takes. Several runs of one robot are also
            judged together.
        map: shipped map by name or the path of one's own YAML file, for sources that are not imported yet.
        robot: robot that drove (see `ddagr robots`), for checks that need its wheel radius and track.
        output: folder for one figure and one JSON report for each run.
        overwrite: replace an output folder that an earlier check wrote.
        all: list the questions that passed, too.
        seed: of the resampled intervals.
        maximum_rows: refuse a recording with more rows or messages.
        maximum_bytes: refuse a recording that unpacks to more bytes.
    """

    runs: Positional[tuple[Path, ...]]
    map: str = ""
    robot: str = ""
    output: Path | None = None
    overwrite: bool = False
    all: bool = False
    seed: int = 0
    maximum_rows: int = 2_000_000
    maximum_bytes: int = 4 * 2**30


def run(arguments: Arguments) -> int:
    """Check every run, print the tables, write figures and reports; 1 when anything is suspicious."""
    import numpy as np

    from ddagr_gym.recordings.checks.across import across_runs
    from ddagr_gym.recordings.checks.run import check_recording

    recordings = _load(arguments)
    reports = []
    for recording in recordings:
        report = check_recording(recording, np.random.default_rng(arguments.seed))
        print(report_text(report, arguments.all))
        reports.append(report)
    together = across_runs(recordings, reports)
    if together:
        print(f"\nall {len(reports)} runs together")
        print(findings_text(together, arguments.all))
    if arguments.output is not None:
        _write(arguments, recordings, reports, together)
    found = any(report.suspicious or report.sentences for report in reports)
    return 1 if found or any(f.status == "suspicious" for f in together) else 0


def _load(arguments: Arguments) -> list[Recording]:
    from ddagr_gym.recordings.files import Limits
    from ddagr_gym.recordings.load import load_recording

    if not arguments.runs:
        raise InputError("no recording is given: name one or more files.")
    limits = Limits(arguments.maximum_rows, arguments.maximum_bytes)
    recordings = [load_recording(r, arguments.map or None, arguments.robot or None, limits) for r in arguments.runs]
    robots = {recording.meta.robot for recording in recordings}
    if len(robots) > 1:
        raise InputError(f"the runs are of the robots {', '.join(sorted(robots))}: check one robot at a time.")
    return recordings


def report_text(report: CheckReport, everything: bool = False) -> str:
    """A report as text: verdict, doubts, and the table.

    Args:
        report: of one run.
        everything: list what passed, too.
    """
    robot = f", {report.robot}" if report.robot else ""
    lines = [f"\n{report.source}{robot}: {report.rows} rows, {report.seconds:.0f} s"]
    lines += [f"  doubt: {sentence}" for sentence in report.sentences]
    return "\n".join([*lines, findings_text(report.findings, everything)])


def findings_text(findings: Sequence[Finding], everything: bool = False) -> str:
    """Findings as a table with what to do below; passes are only counted unless ``everything``."""
    shown = [f for f in findings if everything or f.status != "pass"]
    rows = [(str(f.status).replace("_", " "), f.check, f.channel, _number(f), f.meaning) for f in shown]
    lines = [format_table(("status", "check", "channel", "value", "meaning"), rows)] if rows else []
    lines += [f"  -> {f.check}, {f.channel}: {f.remedy}" for f in shown if f.status == "suspicious"]
    count = {kind: sum(f.status == kind for f in findings) for kind in ("pass", "suspicious", "not_testable")}
    lines.append(f"{count['pass']} pass, {count['suspicious']} suspicious, {count['not_testable']} not testable")
    return "\n".join(lines)


def _number(finding: Finding) -> str:
    if finding.value is None:
        return ""
    unit = "" if finding.unit in ("-", "SI") else f" {finding.unit}"
    if finding.interval is None or finding.interval[0] == finding.interval[1]:
        return f"{finding.value:.3g}{unit}"
    return f"{finding.value:.3g} ({finding.interval[0]:.3g} to {finding.interval[1]:.3g}){unit}"


def _write(
    arguments: Arguments, recordings: list[Recording], reports: list[CheckReport], together: list[Finding]
) -> None:
    import numpy as np

    from ddagr_gym.reporting.check_figure import save_check_figure

    assert arguments.output is not None
    stems = [Path(report.source).name.split(".", 1)[0] or "run" for report in reports]
    names = _unique(["together", *stems])[1:]
    with output_folder(arguments.output, overwrite=arguments.overwrite) as folder:
        with Progress(len(reports), "drawing") as progress:
            for name, recording, report in zip(names, recordings, reports, strict=True):
                rng = np.random.default_rng(arguments.seed)
                save_check_figure(recording, report, rng, folder / f"{name}.png")
                _write_json(folder / f"{name}.json", report.to_json())
                progress.advance()
        if together:
            _write_json(folder / "together.json", {"schema_version": 1, "findings": [f.to_json() for f in together]})
    print(f"\nfigures and reports: {arguments.output}")


def _unique(names: list[str]) -> list[str]:
    """Names with a number where one occurs again."""
    return [f"{n}_{names[:i].count(n) + 1}" if names.count(n) > 1 else n for i, n in enumerate(names)]


def _write_json(path: Path, content: dict[str, Any]) -> None:
    path.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")
