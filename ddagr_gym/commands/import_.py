"""``ddagr import``: a recording of any kind as one Parquet file in the common schema."""

from __future__ import annotations

import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from tyro.conf import Positional

from ddagr_gym.errors import InputError

EXAMPLES = (
    "ddagr import drive.csv.gz --map drive_steps --robot warthog --output run.parquet",
    "ddagr import field.bag --robot husky --output run.parquet",
    "ddagr import drive.mcap --map my_topics.yaml --robot husky --output run.parquet",
    "ddagr import my_bag --guess --robot husky --output run.parquet",
    "ddagr import my_bag --guess --namespace /robot1 --map-output my_topics.yaml --robot husky --output run.parquet",
)


@dataclass(frozen=True)
class Arguments:
    """Turn a recording (CSV, Parquet, ROS bag, MCAP) into a Parquet file in the common schema.

    Every other command reads that file.

    Attributes:
        source: recording: CSV or gzip CSV, Parquet, .bag, .db3, a ROS 2 bag's folder (also split or zstd-compressed),
            or .mcap.
        output: Parquet file to write; it is replaced only when the import succeeded.
        map: shipped map by name (schema, drive_steps, drive_continuous, concealed, topics_default) or the path of one's
            own YAML file; a table without one takes the shipped map that fits its columns, a bag topics by message
            type.
        robot: robot that drove (see `ddagr robots`), for body-speed commands; the map's own when it is left out.
        guess: propose which topics of a bag are IMU, wheels, command and pose, show the reasons, write the map, and ask
            whether to import with it. Where nobody can answer, nothing is imported.
        map_output: YAML file for the proposed map; beside --output with the ending .topics.yaml when it is left out.
        yes: import with the proposed map without asking.
        namespace: which robot of a bag that holds several, such as /robot1; with --guess.
        maximum_rows: refuse a recording with more rows or messages.
        maximum_bytes: refuse a recording that unpacks to more bytes.
    """

    source: Positional[Path]
    output: Annotated[Path, tyro.conf.arg(aliases=("-o",))]
    map: str = ""
    robot: str = ""
    guess: bool = False
    map_output: Path | None = None
    yes: bool = False
    namespace: str = ""
    maximum_rows: int = 2_000_000
    maximum_bytes: int = 4 * 2**30


def run(arguments: Arguments) -> int:
    """Guess the map where that is asked for, then read, convert, validate, write; 1 where the guess is declined."""
    _check(arguments)
    if not arguments.guess:
        _import(arguments, arguments.map)
        return 0
    target = arguments.map_output or arguments.output.with_suffix(".topics.yaml")
    _propose(arguments, target)
    if not arguments.yes and not _confirmed(arguments, target):
        print(f"not imported: correct {target}, then `{_next_command(arguments, target)}`")
        return 1
    _import(arguments, str(target))
    return 0


def _check(arguments: Arguments) -> None:
    """Refuse what cannot be written, and options that do not go together."""
    if arguments.output.suffix != ".parquet":
        raise InputError(f"--output is {arguments.output}: give a file that ends in .parquet.")
    if arguments.guess and arguments.map:
        raise InputError(f"--map {arguments.map} and --guess are both given: keep one of them.")
    if arguments.map_output is not None and arguments.map_output.suffix not in (".yaml", ".yml"):
        raise InputError(f"--map-output is {arguments.map_output}: give a file that ends in .yaml.")
    alone = {
        "--map-output": arguments.map_output,
        "--yes": arguments.yes,
        "--namespace": arguments.namespace,
    }
    for option, value in alone.items():
        if value and not arguments.guess:
            raise InputError(f"{option} is given without --guess: add --guess, or leave it out.")


def _propose(arguments: Arguments, target: Path) -> None:
    """Show a proposed map and write it; one that somebody has edited stays."""
    import ddagr_gym

    guess = ddagr_gym.guess_topic_map(
        arguments.source,
        arguments.robot or None,
        namespace=arguments.namespace,
        maximum_rows=arguments.maximum_rows,
        maximum_bytes=arguments.maximum_bytes,
    )
    print(guess)
    # errors are replaced, so that what is no UTF-8 text differs too
    if target.exists() and not (target.is_file() and target.read_text("utf-8", errors="replace") == guess.yaml()):
        raise InputError(
            f"{target} exists and differs from the proposal: go on with `{_next_command(arguments, target)}`, or give "
            "another --map-output."
        )
    guess.to_yaml(target)
    print(f"\nproposed map: {target}")


def _confirmed(arguments: Arguments, target: Path) -> bool:
    """Whether somebody at a terminal says yes.

    Raises:
        InputError: there is no terminal.
    """
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise InputError(
            f"nothing was imported, since nobody could confirm the proposed map: read {target}, correct it where it is "
            f"wrong, and go on with `{_next_command(arguments, target)}`, or add --yes."
        )
    try:
        answer = input("import with this map? [y/N] ")
    except EOFError:
        answer = ""
    return answer.strip().lower() in ("y", "yes")


def _next_command(arguments: Arguments, target: Path) -> str:
    robot = ["--robot", arguments.robot] if arguments.robot else []
    words = ["ddagr", "import", str(arguments.source), "--map", str(target), *robot, "--output", str(arguments.output)]
    return shlex.join(words)


def _import(arguments: Arguments, map_name: str) -> None:
    import ddagr_gym
    from ddagr_gym.recordings.storage import save_parquet

    recording = ddagr_gym.load_recording(
        arguments.source,
        map_name or None,
        arguments.robot or None,
        arguments.maximum_rows,
        arguments.maximum_bytes,
    )
    save_parquet(recording, arguments.output)
    print(
        f"{arguments.output}: {len(recording)} rows, {len(recording.meta.spans)} spans, "
        f"{len(recording.meta.segments)} segments"
    )
    rates = ", ".join(f"{name} {rate:.3g} Hz" for name, rate in recording.rates().items())
    print(f"new samples: {rates}")
    for note in recording.meta.notes:
        print(f"note: {note}")
    for sentence in recording.validate():
        print(f"doubt: {sentence}")
