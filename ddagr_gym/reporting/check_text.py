"""Reports on recordings as text."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ddagr_gym.recordings.checks.findings import CheckFinding, CheckReport
from ddagr_gym.reporting.text_table import format_table


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


def findings_text(findings: Sequence[CheckFinding], everything: bool = False) -> str:
    """Findings as a table with what to do below; passes are only counted unless ``everything``."""
    shown = [f for f in findings if everything or f.status != "pass"]
    rows = [finding_row(f) for f in shown]
    lines = [format_table(FINDING_HEADER, rows)] if rows else []
    lines += [f"  -> {f.check}, {f.channel}: {f.remedy}" for f in shown if f.status == "suspicious"]
    lacking = dict.fromkeys(f.remedy for f in shown if f.status == "not_testable" and f.remedy)
    lines += [f"  to test more: {remedy}" for remedy in lacking]
    count = {kind: sum(f.status == kind for f in findings) for kind in ("pass", "suspicious", "not_testable")}
    lines.append(f"{count['pass']} pass, {count['suspicious']} suspicious, {count['not_testable']} not testable")
    return "\n".join(lines)


FINDING_HEADER = ("status", "check", "channel", "value", "meaning")


def finding_row(finding: CheckFinding) -> tuple[str, ...]:
    """A finding under :data:`FINDING_HEADER`."""
    return str(finding.status).replace("_", " "), finding.check, finding.channel, _number(finding), finding.meaning


def _number(finding: CheckFinding) -> str:
    if finding.value is None:
        return ""
    unit = "" if finding.unit in ("-", "SI") else f" {finding.unit}"
    if finding.interval is None or finding.interval[0] == finding.interval[1]:
        return f"{finding.value:.3g}{unit}"
    return f"{finding.value:.3g} ({_range(*finding.interval)}){unit}"


def _range(low: float, high: float) -> str:
    if math.isinf(high):
        return f"{low:.3g} or more"
    return f"{high:.3g} or less" if math.isinf(low) else f"{low:.3g} to {high:.3g}"
