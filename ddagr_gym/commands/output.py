"""What the commands share for writing: files that are whole or absent, output folders, tables.

Progress bars are in :mod:`ddagr_gym.commands.progress`.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from ddagr_gym.errors import InputError
from ddagr_gym.files import atomic_path, make_folder

__all__ = [
    "atomic_path",
    "check_output_folder",
    "format_fields",
    "format_table",
    "format_value",
    "make_folder",
    "output_folder",
    "write_bytes",
    "write_text",
]

FOLDER_MARK = ".ddagr-output"
"""Empty file in every folder that a command wrote; only such a folder is ever replaced."""


def write_bytes(path: str | os.PathLike[str], data: bytes) -> None:
    """Write ``data`` so that ``path`` holds all of it or what it held before."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(data)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write ``text`` (UTF-8, its line ends as they are) so that ``path`` holds all of it or what it held before."""
    write_bytes(path, text.encode())


@contextmanager
def output_folder(path: str | os.PathLike[str], *, overwrite: bool = False) -> Iterator[Path]:
    """Folder to fill in place of ``path``, moved there when the block ends without an error.

    After an error it is removed and ``path`` is as it was.

    Args:
        path: folder to end up with; parents are made.
        overwrite: replace a folder that an earlier command wrote. One that holds anything else is never touched.

    Raises:
        InputError: ``path`` is a file, holds the current folder, or has content that may not be replaced.
    """
    final = Path(path).expanduser().resolve()
    _check_replaceable(final, overwrite)
    make_folder(final.parent)
    temporary = Path(tempfile.mkdtemp(prefix=f".{final.name}-", dir=final.parent))
    try:
        yield temporary
        (temporary / FOLDER_MARK).touch()
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o777 & ~mask)
        _check_replaceable(final, overwrite)
        _replace_folder(temporary, final)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def check_output_folder(path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Refuse before long work what :func:`output_folder` would refuse after it; the same InputError."""
    _check_replaceable(Path(path).expanduser().resolve(), overwrite)


def _check_replaceable(folder: Path, overwrite: bool) -> None:
    if not folder.exists():
        return
    if not folder.is_dir():
        raise InputError(f"{folder} is a file: give the path of a folder.")
    if folder == Path.cwd() or folder in Path.cwd().parents:
        raise InputError(f"{folder} holds the current folder: give the name of a new one.")
    if not any(folder.iterdir()):
        return
    if not (folder / FOLDER_MARK).exists():
        raise InputError(f"{folder} holds files that no ddagr command wrote: choose another folder.")
    if not overwrite:
        raise InputError(f"{folder} holds an earlier output: choose another folder or add --overwrite.")


def _replace_folder(temporary: Path, final: Path) -> None:
    if not final.exists():
        os.rename(temporary, final)
        return
    old = Path(tempfile.mkdtemp(prefix=f".{final.name}-old-", dir=final.parent))
    os.rename(final, old)
    os.rename(temporary, final)
    shutil.rmtree(old)


def format_value(value: object) -> str:
    """Numbers with six significant digits, tuples and mappings as lists of their values, the rest as text."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {format_value(item)}" for name, item in value.items())
    if isinstance(value, tuple):
        return ", ".join(map(format_value, value))
    return str(value)


def format_table(header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Plain-text table: two spaces between columns, numbers to the right, text to the left.

    Args:
        header: column titles.
        rows: one sequence per row, each as long as ``header``.
    """
    cells = [[format_value(value) for value in row] for row in rows]
    widths = [max(len(line[i]) for line in [list(header), *cells]) for i in range(len(header))]
    numeric = [all(isinstance(row[i], int | float) for row in rows) and bool(rows) for i in range(len(header))]

    def line(values: Sequence[str]) -> str:
        padded = (v.rjust(w) if n else v.ljust(w) for v, w, n in zip(values, widths, numeric, strict=True))
        return "  ".join(padded).rstrip()

    return "\n".join([line(header), "  ".join("-" * width for width in widths), *map(line, cells)])


def format_fields(instance: Any) -> str:
    """A parameter dataclass as lines of name, value and unit; nested ones are indented."""
    return "\n".join(_field_lines(instance, ""))


def _field_lines(instance: Any, indent: str) -> Iterator[str]:
    width = max(len(item.name) for item in fields(instance))
    for item in fields(instance):
        value = getattr(instance, item.name)
        children = value if isinstance(value, tuple) else (value,)
        if children and is_dataclass(children[0]):
            # Equal parts (four wheels of one kind) are shown once.
            for number, child in enumerate(dict.fromkeys(children), 1):
                yield f"{indent}{item.name} {number}" if len(set(children)) > 1 else f"{indent}{item.name}"
                yield from _field_lines(child, indent + "  ")
        else:
            unit = item.metadata.get("unit", "-")
            yield f"{indent}{item.name:<{width}}  {format_value(value)} {unit if unit != '-' else ''}".rstrip()
