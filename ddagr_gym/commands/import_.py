"""``ddagr import``: a recording of any kind as one Parquet file in the common schema."""

from __future__ import annotations

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
)


@dataclass(frozen=True)
class Arguments:
    """Turn a recording (CSV, Parquet, ROS bag, MCAP) into a Parquet file in the common schema.

    Every other command reads that file.

    Attributes:
        source: recording: CSV or gzip CSV, Parquet, .bag, .db3, a ROS 2 bag's folder, or .mcap.
        output: Parquet file to write; it is replaced only when the import succeeded.
        map: shipped map by name (drive_steps, drive_continuous, concealed, topics_default) or the path of one's own
            YAML file; a table without one takes the shipped map that fits its columns, a bag topics by message type.
        robot: robot that drove (see `ddagr robots`), for body-speed commands; the map's own when it is left out.
        maximum_rows: refuse a recording with more rows or messages.
        maximum_bytes: refuse a recording that unpacks to more bytes.
    """

    source: Positional[Path]
    output: Annotated[Path, tyro.conf.arg(aliases=("-o",))]
    map: str = ""
    robot: str = ""
    maximum_rows: int = 2_000_000
    maximum_bytes: int = 4 * 2**30


def run(arguments: Arguments) -> None:
    """Read, convert, validate, write."""
    import ddagr_gym
    from ddagr_gym.recordings.storage import save_parquet

    if arguments.output.suffix != ".parquet":
        raise InputError(f"--output is {arguments.output}: give a file that ends in .parquet.")
    recording = ddagr_gym.load_recording(
        arguments.source,
        arguments.map or None,
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
