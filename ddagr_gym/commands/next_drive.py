"""``ddagr next-drive``: the manoeuvre that would settle what a diagnosis leaves open."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from tyro.conf import Positional

from ddagr_gym.errors import InputError

EXAMPLES = (
    "ddagr next-drive diagnosis",
    "ddagr next-drive --rival slope=0.03 --rival accelerometer_bias=0.3 --robot ddagr --soil thesis_a1",
)


@dataclass(frozen=True)
class Arguments:
    """Name the drive that would tell the remaining explanations of a diagnosis apart.

    Every rival is simulated at its fitted size over every built-in manoeuvre; the others imitate it as well as they
    can, with soil and robot refitted. Manoeuvres are ranked by what is left per minute of driving.

    Attributes:
        diagnosis: folder or diagnosis.json of `ddagr diagnose`.
        rival: effects to tell apart instead, name=size; may be repeated.
        output: JSON file to write.
        robot: nominal robot; that of the diagnosis by default, ddagr without one. After a comparison with a calibration
            or with drives before give it: CALIBRATION/robot.yaml.
        soil: nominal soil; that of the diagnosis by default, thesis_a1 without one. Likewise:
            CALIBRATION/soil_GROUND.yaml.
        sensors: some of imu, encoders, pose; those of the diagnosis by default.
        seed: random seed of the sensor noise.
        threads: threads of the simulator.
    """

    diagnosis: Positional[Path | None] = None
    rival: Annotated[tuple[str, ...], tyro.conf.UseAppendAction] = ()
    output: Annotated[Path | None, tyro.conf.arg(aliases=("-o",))] = None
    robot: str | None = None
    soil: str | None = None
    sensors: tuple[str, ...] = ()
    seed: int = 0
    threads: int = 2


def run(arguments: Arguments) -> None:
    """Rank the manoeuvres and print the best."""
    import ddagr_gym

    if (arguments.diagnosis is None) == (not arguments.rival):
        raise InputError("give either the folder of a diagnosis, or some --rival name=size.")
    result = ddagr_gym.next_drive(
        arguments.rival if arguments.diagnosis is None else arguments.diagnosis,
        arguments.robot,
        arguments.soil,
        sensors=arguments.sensors,
        seed=arguments.seed,
        threads=arguments.threads,
    )
    if arguments.output is not None:
        result.to_json(arguments.output)
    print(result)
