"""How long a diagnosis takes: the scan of the whole library, and every step of a run to the end.

    python -m benchmarks.diagnosis_speed DIR/case_001 DIR/case_002 --threads 2

Cases are folders of three drives of the project's own generator (``benchmarks/concealed/README.md``). Seconds are of
the clock, so nothing else should run. Machines differ by a factor of three in the simulator, which does nearly all of
the work: beside the seconds stands what one evaluation of the contact kernel costs here, ours and compiled C.
``speed.json`` has the same figures of the machine that it was made on.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.ablations.examine import ROBOT, SOIL, read_runs
from benchmarks.speeds.kernel_time import against_c
from ddagr_gym.diagnosis.gates.threshold_files import default_thresholds
from ddagr_gym.diagnosis.gates.thresholds import Thresholds
from ddagr_gym.diagnosis.pipeline import diagnose
from ddagr_gym.diagnosis.preprocessing.session import prepare
from ddagr_gym.diagnosis.search.scan import scan
from ddagr_gym.diagnosis.search.starting_models import refit_nominal
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.reporting.figures import house_style, save_figure

RESULT = Path(__file__).resolve().parent / "results" / "diagnosis_speed.json"
AIMS = {"scan": 10.0, "whole": 180.0}
"""Of three drives of 60 s on two cores [s]."""


@dataclass(frozen=True)
class Timed:
    """Seconds of one case.

    Attributes:
        case: name.
        seconds_driven: of all drives together.
        probes: of the library.
        scan: of one scan of the library at the refitted nominal model.
        steps: of every step of a run to the end, the page left out.
        verdict: of that run.
    """

    case: str
    seconds_driven: float
    probes: int
    scan: float
    steps: dict[str, float]
    verdict: tuple[str, ...]

    def as_mapping(self) -> dict[str, Any]:
        """As it stands in the result."""
        return {**vars(self), "verdict": list(self.verdict), "whole": sum(self.steps.values())}


def timed(folder: Path, thresholds: Thresholds, threads: int) -> Timed:
    """Scan and diagnose one case.

    Args:
        folder: of the case.
        thresholds: of the null bank.
        threads: of the simulator.
    """
    robot, soil, runs = get_robot(ROBOT), get_soil(SOIL), tuple(read_runs(folder))
    setting = Setting(threads=threads).with_windows(thresholds.duration)
    problem = prepare(runs, robot, soil, thresholds, setting).problem
    _, refitted = refit_nominal(problem)
    scan(problem, refitted)  # what is compiled or read from the disk on first use
    began = time.perf_counter()
    terms = scan(problem, refitted)
    scanned = time.perf_counter() - began
    marks: list[tuple[str, float]] = []
    outcome = diagnose(
        runs, robot, soil, thresholds, setting, on_step=lambda name, kept: marks.append((name, time.perf_counter()))
    )
    ends = [mark for _, mark in marks[1:]] + [time.perf_counter()]
    steps = {name: end - start for (name, start), end in zip(marks, ends, strict=True)}
    driven = sum(float(recording.t[-1] - recording.t[0]) for recording in runs)
    probes = sum(len(candidate.columns) for candidate in terms.candidates)
    return Timed(folder.name, driven, probes, scanned, steps, outcome.diagnosis.verdict)


def draw(result: dict[str, Any], path: Path) -> None:
    """Bars of the steps of each case, with the aims."""
    import matplotlib.pyplot as plt

    cases = result["cases"]
    names = [f"{case['case']}: {', '.join(case['verdict'])}".replace("_", " ") for case in cases]
    with house_style():
        figure, (whole, scans) = plt.subplots(1, 2, figsize=(10.0, 1.8 + 0.4 * len(cases)), width_ratios=(2.5, 1.0))
        left = [0.0] * len(cases)
        for number, step in enumerate(cases[0]["steps"]):
            widths = [case["steps"][step] for case in cases]
            whole.barh(names, widths, left=left, label=step, color=plt.colormaps["tab10"](number))
            left = [a + b for a, b in zip(left, widths, strict=True)]
        scans.barh(names, [case["scan"] for case in cases], color="0.5")
        scans.set_yticks([])
        for panel, aim, title in ((whole, "whole", "a run to the end"), (scans, "scan", "scan of the library")):
            panel.axvline(AIMS[aim], color="black", linewidth=1.0, linestyle="--")
            panel.set_xlabel(f"seconds, {title} (dashed: aim)")
            panel.invert_yaxis()
        figure.legend(*whole.get_legend_handles_labels(), loc="upper center", ncols=4, frameon=False)
        figure.tight_layout(rect=(0.0, 0.0, 1.0, 1.0 - 0.6 / figure.get_figheight()))
        save_figure(figure, path)
        plt.close(figure)


def main(arguments: Sequence[str] | None = None) -> int:
    """Time the cases, write the result and its figure, print them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", type=Path, nargs="+")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--output", type=Path, default=RESULT)
    given = parser.parse_args(arguments)
    missing = [str(case) for case in given.cases if not any(case.glob("run_*.csv.gz"))]
    if missing:
        parser.error(f"no run_*.csv.gz in {missing[0]}: name folders of cases")
    thresholds = default_thresholds(ROBOT)
    found = []
    for case in given.cases:
        found.append(timed(case, thresholds, given.threads).as_mapping())
        print(f"{case.name}: scan {found[-1]['scan']:.1f} s, whole {found[-1]['whole']:.0f} s", flush=True)
    kernel = against_c(repeats=9, evaluations=100_000)
    result = {"threads": given.threads, "aims": AIMS, "kernel_beside_c": kernel, "cases": found}
    write_atomically(given.output, lambda to: to.write_text(json.dumps(result, indent=1, allow_nan=False) + "\n"))
    draw(result, given.output.with_suffix(".png"))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
