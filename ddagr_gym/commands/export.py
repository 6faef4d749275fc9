"""``ddagr export``: a corrected simulator for MuJoCo, for Gazebo, or as ranges for randomisation."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from tyro.conf import Positional

from ddagr_gym.commands.output import check_output_folder
from ddagr_gym.extras import need
from ddagr_gym.progress import LinePrinter

EXAMPLES = (
    "ddagr export calibration --ground sand --to mujoco --output for_mujoco",
    "ddagr export diagnosis --to gazebo --speed 0.3 --output for_gazebo",
    "ddagr export diagnosis --to randomisation --draws 400 --output ranges",
)


@dataclass(frozen=True)
class Arguments:
    """Take a corrected simulator to MuJoCo or Gazebo, or write ranges for randomisation.

    What carries over is measured in steady drives of the corrected simulator about a working point. The page,
    index.html, says with which error it does and what does not carry over.

    Attributes:
        source: folder that `ddagr diagnose` or `ddagr calibrate` wrote.
        to: mujoco (robot.xml), gazebo (model.sdf) or randomisation (randomisation.yaml).
        output: folder to write.
        ground: which ground of a calibration that has several.
        robot: name or YAML file, for a diagnosis without robot.yaml (one against a calibration).
        soil: name or YAML file, likewise.
        speed: rim speed of the working point [m/s]; 0.3 times the largest by default.
        draws: number of draws that ranges come from.
        seed: random seed of the draws.
        overwrite: replace an output folder that an earlier command wrote.
    """

    source: Positional[Path]
    to: str
    output: Annotated[Path, tyro.conf.arg(aliases=("-o",))]
    ground: str = ""
    robot: str = ""
    soil: str = ""
    speed: float | None = None
    draws: int = 100
    seed: int = 0
    overwrite: bool = False


def run(arguments: Arguments) -> None:
    """Measure, compare, write the folder, print the tables."""
    import ddagr_gym

    check_output_folder(arguments.output, overwrite=arguments.overwrite)
    need("jinja2", "matplotlib")
    result = ddagr_gym.export(
        arguments.source,
        arguments.to,
        ground=arguments.ground,
        robot=arguments.robot or None,
        soil=arguments.soil or None,
        speed=arguments.speed,
        draws=arguments.draws,
        seed=arguments.seed,
        progress=LinePrinter("ddagr export: "),
    )
    result.report(arguments.output, overwrite=arguments.overwrite)
    print(result)
    print(f"\n{', '.join(result.files)} and index.html: {arguments.output}")
