"""Parquet tables of others, read through a column map in batches."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from ddagr_gym.errors import InputError
from ddagr_gym.recordings.column_map import ColumnMap
from ddagr_gym.recordings.conversion import RawTable
from ddagr_gym.recordings.csv_reader import Collector, check_unit_of_dates, time_columns, wanted_columns
from ddagr_gym.recordings.files import DEFAULT_LIMITS, Limits, damaged, open_source

if TYPE_CHECKING:
    import pyarrow as pa
    import pyarrow.parquet as pq

_BATCH = 65_536  # rows that are read at once (ours): a few megabytes


@contextmanager
def open_parquet(path: Path, limits: Limits) -> Iterator[pq.ParquetFile]:
    """Parquet file whose footer parses and promises no more than the limits.

    Raises:
        InputError: damaged, or larger than the limits.
    """
    import pyarrow as pa
    from pyarrow import parquet

    try:
        with open_source(path) as stream:
            file = parquet.ParquetFile(
                stream,
                thrift_string_size_limit=2**24,
                thrift_container_size_limit=2**20,
                page_checksum_verification=True,
            )
            limits.check_rows(file.metadata.num_rows, path)
            unpacked = sum(file.metadata.row_group(i).total_byte_size for i in range(file.metadata.num_row_groups))
            if unpacked > limits.bytes:
                raise InputError(
                    f"{path.name} unpacks to {unpacked:,} bytes, above {limits.bytes:,}: cut it into drives, or raise "
                    "--maximum-bytes."
                )
            yield file
    except (pa.ArrowException, OSError, MemoryError, UnicodeDecodeError) as error:
        raise damaged(path, error, "is a damaged Parquet file", "write it again") from None


def parquet_columns(path: Path, limits: Limits = DEFAULT_LIMITS) -> tuple[str, ...]:
    """Names of the columns of a Parquet file."""
    with open_parquet(path, limits) as file:
        return tuple(file.schema_arrow.names)


def read_parquet(path: Path, column_map: ColumnMap, limits: Limits = DEFAULT_LIMITS) -> RawTable:
    """Columns of a Parquet table that a map asks for.

    Args:
        path: Parquet file.
        column_map: which columns to read.
        limits: on rows and bytes.

    Raises:
        InputError: missing columns, columns that are not numbers, damage, or too large a file.
    """
    with open_parquet(path, limits) as file:
        numbers, labels = wanted_columns(path, column_map, tuple(file.schema_arrow.names))
        check_unit_of_dates(path, column_map, _dates(column_map, file.schema_arrow))
        collector = Collector(numbers, labels, limits, path)
        columns = list(dict.fromkeys((*numbers, *labels)))
        for batch in file.iter_batches(batch_size=_BATCH, columns=columns):
            collector.add(batch)
        return collector.table()


def _dates(column_map: ColumnMap, schema: pa.Schema) -> list[str]:
    """Columns of time whose type says their unit."""
    import pyarrow as pa

    names = (name for name in time_columns(column_map) if name in schema.names)
    return [name for name in names if pa.types.is_temporal(schema.field(name).type)]
