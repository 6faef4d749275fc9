"""``./ddagr tune-controllers``: search the gains of the ladder's closed loops on the validation set."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from ddagr_gym.commands.output import write_text
from ddagr_gym.errors import at_least
from ddagr_gym.files import make_folder
from ddagr_gym.progress import Progress
from ddagr_gym.tasks import TaskRunner

EXAMPLES = (
    "ddagr tune-controllers --output gains",
    "ddagr tune-controllers --controllers B3,B4 --output gains --seed 1",
    "ddagr tune-controllers --output gains --cluster ray://head:10001",
)


@dataclass(frozen=True)
class Arguments:
    """Search the controllers' gains on the validation set, those of B6 on development plants.

    Every controller gets the same budget, scenarios and objective: see benchmarks.gain_search. An interrupted
    search continues when it is started again with the same folder. The result, ladder_gains.yaml and gain_search.json,
    takes effect in configs/evaluation.

    Attributes:
        controllers: names, separated by commas.
        output: folder for the journal and the result.
        seed: of the candidates.
        workers: processes, or processors of a local cluster.
        cluster: a Ray cluster to drive on: "local" starts one here, an address (ray://HOST:PORT) takes one that runs.
    """

    controllers: str = "B2,B3,B4,B5,B6,true_curvature,true_soil,true_path"
    output: Path = Path("ddagr_gains")
    seed: int = 0
    workers: int = 2
    cluster: str = ""


def run(arguments: Arguments) -> None:
    """Search, write, print what was found."""
    from benchmarks.gain_search import STAGES, GainSearch, check_names, episodes_of, write_gains

    names = check_names([name.strip() for name in arguments.controllers.split(",") if name.strip()])
    at_least(**{"--workers": (arguments.workers, 1), "--seed": (arguments.seed, 0)})
    folder = make_folder(arguments.output)
    records = []
    runner = TaskRunner(arguments.workers, cluster=arguments.cluster)
    with runner, Progress(len(names) * episodes_of(STAGES), "searching") as progress:
        for name in names:
            journal = folder / f"{name}_seed_{arguments.seed}.jsonl"
            search = GainSearch(name, journal, seed=arguments.seed, progress=progress.advance, runner=runner)
            records.append(search.run())
    write_gains(records, folder / "ladder_gains.yaml")
    write_text(folder / "gain_search.json", json.dumps(records, indent=1) + "\n")
    for record in records:
        print(f"{record['controller']:15s} objective {record['objective']:.4f}  {record['best']}")
    print(f"\nGains and record are in {folder.resolve()}")
