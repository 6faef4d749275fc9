"""The demonstration's evaluation: the ladder of controllers and the trained policies on a few frozen scenarios."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ddagr_gym.commands.output import Section

LADDER = ("B0", "B1", "B2", "B3", "B4", "B6")
POLICIES = ("ppo_ekf", "ppo_history", "ppo_raw")
"""The ladder's arms beside the default (theory: control, section 3); ablations are in the full evaluation."""
SET = "V"
SCENARIOS = 8
"""The first ones of the validation set: enough for a look, not for a result."""


def evaluation_step(folder: Path, scenarios: int = SCENARIOS, workers: int = 2) -> Section:
    """Drive controllers and policies over the same soils and noise; page, videos and files into ``folder/evaluation``.

    Args:
        folder: of the demonstration, which exists.
        scenarios: how many of the set.
        workers: processes.
    """
    from ddagr_gym.commands.evaluate import results_table
    from ddagr_gym.commands.evaluation_report import write_files, write_report
    from ddagr_gym.commands.output import format_table
    from ddagr_gym.evaluation.campaign import run_campaign
    from ddagr_gym.evaluation.controllers import DEFAULT, controller_title
    from ddagr_gym.evaluation.dataset import EPISODES
    from ddagr_gym.evaluation.summary import summaries
    from ddagr_gym.policies.shipped import selected_policies
    from ddagr_gym.reporting.evaluation_page import PAGE, PICTURE

    controllers = [*LADDER, DEFAULT, *(name for name in POLICIES if name in selected_policies())]
    print(f"Driving {len(controllers)} controllers over {scenarios} scenarios of set {SET} ...", flush=True)
    target = folder / "evaluation"
    target.mkdir()
    rows = run_campaign(controllers, [SET], target / EPISODES, processes=workers, count=scenarios)
    summary: dict[str, Any] = summaries(rows)
    write_files(target, rows, summary)
    write_report(target, rows, summary, workers=workers)
    named = "; ".join(f"<b>{name}</b>: {controller_title(name)}" for name in controllers)
    html = f"""<p>The first {scenarios} scenarios of set {SET}: a look, not a result. All of it:
<code>ddagr evaluate --scenarios S1</code>.</p>
<div class="wide"><a href="evaluation/{PAGE}"><img src="evaluation/{PICTURE}.png" alt="Turn radius error by controller">
</a></div>
<p>{named}. The error is of the turned radius, in percent of the commanded one.</p>
<p>Everything about it, with paths, the filter's estimate and the worst turns: <a href="evaluation/{PAGE}">page</a>,
<a href="evaluation/summary.json">summary</a>, <a href="evaluation/episodes.parquet">episodes</a>.</p>"""
    return Section("Which controller turns closest", format_table(*results_table(summary)), html)
