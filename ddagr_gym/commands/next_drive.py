"""``ddagr next-drive``: the manoeuvre that would settle what a diagnosis leaves open."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro
from tyro.conf import Positional

from ddagr_gym.commands.output import format_table, write_text
from ddagr_gym.commands.ranges import check_at_least
from ddagr_gym.errors import InputError

if TYPE_CHECKING:
    from ddagr_gym.diagnosis.setting import Setting

EXAMPLES = (
    "ddagr next-drive diagnosis",
    "ddagr next-drive --rival slope=0.03 --rival accelerometer_bias=0.3 --robot ddagr --soil thesis_a1",
)


ROBOT, SOIL = "ddagr", "thesis_a1"


@dataclass(frozen=True)
class Arguments:
    """Name the drive that would tell the remaining explanations of a diagnosis apart.

    Every rival is simulated at its fitted size over every built-in manoeuvre; the others imitate it as well as they
    can, with soil and robot refitted. Manoeuvres are ranked by what is left per minute of driving.

    Attributes:
        diagnosis: folder or diagnosis.json of `ddagr diagnose`.
        rival: effects to tell apart instead, name=size; may be repeated.
        output: JSON file to write.
        robot: nominal robot; that of the diagnosis by default, ddagr without one.
        soil: nominal soil; that of the diagnosis by default, thesis_a1 without one.
        sensors: some of imu, encoders, pose; those of the diagnosis by default.
        seed: of the sensor noise.
        threads: of the simulator.
    """

    diagnosis: Positional[Path | None] = None
    rival: Annotated[tuple[str, ...], tyro.conf.UseAppendAction] = ()
    output: Path | None = None
    robot: str | None = None
    soil: str | None = None
    sensors: tuple[str, ...] = ()
    seed: int = 0
    threads: int = 2


def run(arguments: Arguments) -> None:
    """Rank the manoeuvres and print the best."""
    from ddagr_gym.diagnosis.planning.next_drive import next_drive
    from ddagr_gym.presets import get_robot, get_soil

    check_at_least(arguments, threads=1, seed=0)
    if (arguments.diagnosis is None) == (not arguments.rival):
        raise InputError("give either a diagnosis or some --rival name=size, not both.")
    case = _case(arguments)
    robot, soil = get_robot(arguments.robot or case.robot), get_soil(arguments.soil or case.soil)
    sensors, setting = arguments.sensors or case.sensors, replace(case.setting, threads=arguments.threads)
    answer = next_drive(robot, soil, case.rivals, sensors=sensors, seed=arguments.seed, setting=setting)
    if arguments.output is not None:
        write_text(arguments.output, json.dumps(answer, indent=1, allow_nan=False) + "\n")
    print(answer_text(answer))


@dataclass(frozen=True)
class _Case:
    """What is to be told apart, with which sensors, for which robot on which soil, by which diagnosis."""

    rivals: list[Any]
    sensors: tuple[str, ...]
    robot: str
    soil: str
    setting: Setting


def _case(arguments: Arguments) -> _Case:
    from ddagr_gym.diagnosis.planning.next_drive import rivals_of_diagnosis, sensors_of_diagnosis, setting_of_diagnosis
    from ddagr_gym.diagnosis.planning.planned_drive import SENSORS
    from ddagr_gym.diagnosis.result.verdict import load
    from ddagr_gym.diagnosis.setting import Setting
    from ddagr_gym.physics.effects.registry import parse_effect

    if arguments.diagnosis is None:
        return _Case([parse_effect(text) for text in arguments.rival], tuple(SENSORS), ROBOT, SOIL, Setting())
    path = arguments.diagnosis
    mapping = load(path / "diagnosis.json" if path.is_dir() else path)
    named = mapping["options"].get("robot_file") or mapping["robot"] or ROBOT, mapping["soil"] or SOIL
    return _Case(rivals_of_diagnosis(mapping), sensors_of_diagnosis(mapping), *named, setting_of_diagnosis(mapping))


def answer_text(answer: dict[str, Any]) -> str:
    """The answer in words, with the runners-up."""
    if not answer["manoeuvre"]:
        return str(answer["why"])
    entries = [answer, *answer["alternatives"]]
    rows = [(e["manoeuvre"], f"{e['power']:.3g}", f"{60.0 * e['minutes']:.2g}") for e in entries]
    table = format_table(("manoeuvre", "gain per minute", "seconds needed"), rows)
    pairs = ", ".join(" from ".join(pair) for pair in answer["separates"])
    tells = f"It tells {pairs}.\n" if pairs else ""
    return f"Drive {answer['manoeuvre']}: {answer['why']}\n{tells}\n{table}"
