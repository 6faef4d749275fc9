"""Episodes of a campaign as a Parquet dataset that other tools open, with its manifest.

A folder ``episodes`` with ``controller=NAME/set=NAME/part-HASH.parquet`` and ``_manifest.json``. A part is what one
task drove; it is written under another name, renamed, and never appended to, so that a reader sees whole parts only.
Its name is a hash of what is in it: the same rows are the same file, whoever writes them. Other tools read
``episodes/**/part-*.parquet``; names of controllers and sets are in the paths, as Hive has it, percent-encoded.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

from ddagr_gym.errors import InputError
from ddagr_gym.extras import need
from ddagr_gym.files import atomic_path, make_folder, read_json, read_json_lines, write_json
from ddagr_gym.version import __version__

EPISODES = "episodes"
"""Folder of the dataset in the output of a command."""
FORMAT = 1
MANIFEST = "_manifest.json"
PARTITIONS = ("controller", "set")
"""Columns that are in the paths and not in the files."""
IDENTITY = ("number", "made_of")
"""Columns that say with those of the paths which episode a row is, and of what it was made."""

_FLOATS = (
    "radius", "radius_error", "fit_residual", "radius_disagreement", "radial_error_rms", "radial_error_maximum",
    "exit_lateral_error", "exit_heading_error", "headland_depth", "duration", "slip_energy", "wheel_speed_variation",
    "estimator_speed_rms", "estimator_yaw_rate_rms", "estimator_slip_rms", "estimator_radius",
    "estimator_prediction_1s", "estimator_prediction_5s", "estimator_dead_reckoning", "estimator_innovation",
)  # fmt: skip
COLUMNS = (
    dict.fromkeys(("arm", "side", "status", "made_of"), "string")
    | dict.fromkeys(("run", "number", "ending", "bank_stalls", "robot_stalls"), "int64")
    | dict.fromkeys(_FLOATS, "double")
    | dict.fromkeys(("radius_consistent", "success", "within_practice"), "bool")
)
"""Type of every column of a part, also of one in which nothing is defined."""

Row = Mapping[str, Any]
Key = tuple[str, str, int]
"""Controller, set and number of an episode."""


def episode_key(row: Row) -> Key:
    """Which episode a row is."""
    return row["controller"], row["set"], row["number"]


class EpisodeDataset:
    """Rows of episodes in a folder.

    Args:
        folder: of the dataset, made where it is absent.
        earlier: JSON lines of an earlier version; their rows are taken over once, and the file is left as it is.

    Raises:
        InputError: pyarrow is not installed, the manifest is none, the dataset is of a later version, or the rows of
            ``earlier`` are of another one.
    """

    def __init__(self, folder: Path, earlier: Path | None = None) -> None:
        need("pyarrow")
        self.folder = make_folder(folder)
        if self._manifest().get("format", FORMAT) != FORMAT:
            raise InputError(
                f"{self.folder} is written in format {self._manifest()['format']} and this version reads {FORMAT}: "
                f"use the version that wrote it, or choose another folder."
            )
        if earlier is not None and earlier.exists() and not (self.folder / MANIFEST).is_file():
            self._take_over(earlier)
        self.write_manifest()

    def _manifest(self) -> dict[str, Any]:
        file = self.folder / MANIFEST
        if not file.exists():
            return {}
        fault, remedy = "is no manifest of episodes", "delete it, and it is made anew"
        content = read_json(file, fault, remedy)
        if not isinstance(content, dict):
            raise InputError(f"{file} {fault} (it holds no mapping): {remedy}.")
        return content

    def _take_over(self, earlier: Path) -> None:
        rows = read_lines(earlier)
        known = {*COLUMNS, *PARTITIONS}
        other = InputError(f"{earlier} has rows of another version: move it away and drive again.")
        if any(set(row) != known for row in rows):
            raise other
        try:
            self.append(rows)
        except (TypeError, ValueError):  # pyarrow's errors are among these
            raise other from None

    def parts(self) -> list[Path]:
        """Files of the rows, ordered by path."""
        return sorted(self.folder.glob("controller=*/set=*/part-*.parquet"))

    def append(self, rows: Sequence[Row]) -> None:
        """Add rows, a new part for each controller and set.

        Args:
            rows: with :data:`PARTITIONS` and :data:`COLUMNS`; others raise ValueError.
        """
        for (controller, set_name), group in groupby(
            sorted(rows, key=episode_key), key=lambda row: episode_key(row)[:2]
        ):
            self._write(controller, set_name, list(group))

    def _write(self, controller: str, set_name: str, rows: Sequence[Row]) -> Path:
        import pyarrow as pa
        from pyarrow import parquet

        unknown = {name for row in rows for name in row} ^ {*COLUMNS, *PARTITIONS}
        if unknown:
            raise ValueError(f"rows of episodes and columns differ in {', '.join(sorted(unknown))}")
        content = [{name: row[name] for name in COLUMNS} for row in rows]
        digest = hashlib.sha256(json.dumps(content).encode()).hexdigest()[:16]
        folder = self.folder / f"controller={quote(controller, safe='')}" / f"set={quote(set_name, safe='')}"
        path = folder / f"part-{digest}.parquet"
        with atomic_path(path) as temporary:
            parquet.write_table(pa.Table.from_pylist(content, schema=_schema()), temporary)
        return path

    def read(self, columns: Sequence[str] | None = None) -> list[dict[str, Any]]:
        """Rows of all parts, in their order.

        Args:
            columns: besides :data:`PARTITIONS`; all when None.

        Raises:
            InputError: a part cannot be read.
        """
        return [row for part in self.parts() for row in self._rows(part, columns)]

    @staticmethod
    def _rows(part: Path, columns: Sequence[str] | None) -> list[dict[str, Any]]:
        import pyarrow as pa
        from pyarrow import parquet

        controller, set_name = (unquote(folder.name.partition("=")[2]) for folder in (part.parents[1], part.parent))
        try:
            table = parquet.ParquetFile(part).read(None if columns is None else list(columns))
        except (OSError, pa.ArrowException) as error:
            raise InputError(f"{part} cannot be read ({error}): delete it to drive its episodes again.") from None
        return [{"controller": controller, "set": set_name} | row for row in table.to_pylist()]

    def keep(self, wanted: Callable[[Row], bool]) -> None:
        """Drop rows, and all but the first of an episode; parts without such rows are not touched.

        Args:
            wanted: says from the columns of :data:`PARTITIONS` and :data:`IDENTITY` whether a row stays.
        """
        seen: set[Key] = set()
        for part in self.parts():
            kept = []
            rows = self._rows(part, IDENTITY)
            for place, row in enumerate(rows):
                if wanted(row) and episode_key(row) not in seen:
                    seen.add(episode_key(row))
                    kept.append(place)
            if len(kept) < len(rows):
                self._shorten(part, kept)

    def _shorten(self, part: Path, kept: Sequence[int]) -> None:
        rows = self._rows(part, None) if kept else []
        if kept:
            self._write(rows[0]["controller"], rows[0]["set"], [rows[place] for place in kept])
        part.unlink()

    def write_manifest(self) -> None:
        """Say what is in the dataset: columns with types, and rows, parts and origin of each partition."""
        partitions: dict[tuple[str, str], dict[str, Any]] = {}
        for part in self.parts():
            rows = self._rows(part, IDENTITY)
            for row in rows:
                new = {"controller": row["controller"], "set": row["set"], "rows": 0, "parts": 0, "made_of": []}
                entry = partitions.setdefault(episode_key(row)[:2], new)
                entry["rows"] += 1
                entry["made_of"] = sorted({*entry["made_of"], row["made_of"] or ""})
            partitions[episode_key(rows[0])[:2]]["parts"] += 1
        content = {
            "format": FORMAT,
            "written_by": f"ddagr-gym {__version__}",
            "files": "**/part-*.parquet",
            "partitioned_by": list(PARTITIONS),
            "columns": COLUMNS,
            "partitions": list(partitions.values()),
        }
        if content != self._manifest():
            write_json(self.folder / MANIFEST, content)


def _schema() -> Any:
    import pyarrow as pa

    types = {"string": pa.string(), "int64": pa.int64(), "double": pa.float64(), "bool": pa.bool_()}
    return pa.schema([(name, types[kind]) for name, kind in COLUMNS.items()])


def read_lines(journal: Path) -> list[dict[str, Any]]:
    """Rows of JSON lines, as an earlier version wrote; a line that was cut off by an interruption is dropped.

    Raises:
        InputError: the file cannot be read, or a line is no row.
    """
    return read_json_lines(journal, "has no rows of episodes", "move it away and drive again")
