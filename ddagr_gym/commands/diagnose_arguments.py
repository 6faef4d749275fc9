"""What ``ddagr diagnose`` takes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from tyro.conf import Positional

EXAMPLES = (
    "ddagr diagnose run_1.csv.gz run_2.csv.gz run_3.csv.gz --output diagnosis",
    "ddagr diagnose today.csv.gz --calibration calibration --ground sand --output changed",
    "ddagr diagnose today.csv.gz --before monday.csv.gz tuesday.csv.gz --same-ground --output changed",
    "ddagr diagnose today.csv.gz --output diagnosis --mcap today.mcap",
    "ddagr diagnose all_drives --calibration calibration --processes 2 --output over_time",
    "ddagr diagnose drives --robot ddagr --soil thesis_a1 --thresholds thresholds.json --output diagnosis",
)


@dataclass(frozen=True)
class Arguments:
    """Find the physics that a nominal simulator leaves out: where, what, how big, how sure.

    Several recordings of one robot on one ground are diagnosed together; each is then predicted by a model whose sizes
    were fitted to the others. With a single one its halves judge each other, which is weaker: place, day and biases are
    the same. A diagnosis that was stopped goes on after its last finished step when the command is given again.

    With --calibration the question is what changed against the ordinary drives of that robot: the page shows every
    effect against them, and from which size on a change would have been found. With --before the same is asked against
    drives from before, without a calibration. Either takes minutes; stopped, it begins anew.

    A folder with --calibration is many drives over time: each has an answer of its own, and the page shows all sizes as
    control charts and the first drive at which something changed. A drive that cannot be read or compared is a row with
    the reason, and the rest goes on. Answers are kept by content: after a stop, and with --overwrite and further drives
    in the folder, only missing ones are computed. Exit code 0 when every drive has an answer, 1 when some were refused,
    2 when all were, 130 after an interruption.

    Attributes:
        runs: recordings (Parquet of `ddagr import`, or any source that it takes), or folders of them.
        output: folder to write: index.html with its figures, diagnosis.json, evidence.npz, and what `gym.make`,
            `ddagr simulate` and `ddagr replay` load: effects.json or effects.yaml with the effects that were named, and
            robot.yaml and soil.yaml with the refitted nominal parameters. Of many drives: index.html, drives.csv,
            drives.json, and a diagnosis.json of each.
        robot: nominal robot (see `ddagr robots`), or the path of a YAML file with one's own; the one that the
            recordings name when it is left out.
        soil: nominal soil (see `ddagr soils`), or the path of a YAML file with one's own. When it is left out: the soil
            of the thresholds, given or shipped for the robot (thesis_a1 for the ddagr); without any, firm_ground at
            four times a soil's usual uncertainty, for ground that is not known.
        calibration: folder that `ddagr calibrate` wrote, whose robot, grounds and ordinary drives the recordings
            are compared with; robot, soil, thresholds, window and stride are left out then.
        ground: which of the calibration's grounds the recordings are on; left out for one that it does not know.
        before: drives of the same robot from before, when it was ordinary, all on one ground; with them robot and soil
            are where a fit to them begins.
        same_ground: the recordings are on the ground of the drives before.
        other_ground: the recordings are on another ground than the drives before: its soil is fitted, and no change of
            soil is named. Assumed when neither is said.
        map: shipped map by name or the path of one's own YAML file, for sources that are not imported yet.
        thresholds: file that `ddagr null-bank` wrote, from these or similar drives: what evidence for an effect must
            exceed before it is named; those that ship with the package when it is left out.
        soil_uncertainty: factor on how far the soil may be from the nominal one: 1 where a soil is named, larger where
            it is only guessed. Thresholds must have been made with the same.
        window: length of the windows that recordings are cut into [s]; that of the thresholds when it is left out, with
            --before 4 s.
        stride: seconds between the starts of windows; their length, which uses all samples, when it is left out.
        seed: random seed of the resampling.
        threads: threads of the simulator.
        mcap: file to write for Foxglove and PlotJuggler: drives, predictions of the nominal, the refitted and the
            corrected simulator, residuals over the noise, and findings with their stretches; a layout is put beside it.
            Needs foxglove-sdk.
        rrd: file to write for Rerun, with the same. Needs rerun-sdk.
        processes: for a folder with --calibration: how many drives at a time; each takes 0.3 to 1 GB.
        cluster: for a folder with --calibration: a Ray cluster to work on: "local" starts one of so many processors
            here, an address (ray://HOST:PORT) takes one that runs.
        names_only: only name what is missing: no errors on unseen drives, no unnamed terms, no next drive, no page.
        overwrite: replace an output folder that an earlier command wrote.
        maximum_rows: refuse a recording with more rows or messages.
        maximum_bytes: refuse a recording that unpacks to more bytes.
    """

    runs: Positional[tuple[Path, ...]]
    output: Annotated[Path, tyro.conf.arg(aliases=("-o",))]
    robot: str = ""
    soil: str = ""
    calibration: Path | None = None
    ground: str = ""
    before: tuple[Path, ...] = ()
    same_ground: bool = False
    other_ground: bool = False
    map: str = ""
    thresholds: Path | None = None
    soil_uncertainty: float | None = None
    window: float | None = None
    stride: float | None = None
    seed: int = 0
    threads: int = 2
    mcap: Path | None = None
    rrd: Path | None = None
    processes: int = 1
    cluster: str = ""
    names_only: bool = False
    overwrite: bool = False
    maximum_rows: int = 2_000_000
    maximum_bytes: int = 4 * 2**30
