"""Files and folders that are whole or absent."""

from __future__ import annotations

import json
import os
import shutil
import stat
import struct
import tempfile
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ddagr_gym.errors import InputError

FOLDER_MARK = ".ddagr-output"
"""List of files in every folder that a command wrote; only such a folder is ever replaced, and only while it holds
nothing else."""

MAXIMUM_JSON = 50_000_000
"""Bytes of the largest JSON file that is read (ours): an answer on thousands of drives has fewer."""

MAXIMUM_JSON_LINES = 1_000_000_000
"""The same of a file with one JSON value a line (ours): a million episodes have fewer."""

DAMAGED_ARRAYS = (
    zipfile.BadZipFile, zlib.error, struct.error, tokenize.TokenError, ValueError, KeyError, EOFError,
    NotImplementedError, RuntimeError, SyntaxError, TypeError, MemoryError,
)  # fmt: skip
"""What numpy raises for an .npz file that is damaged, or none at all."""


def expanded(path: str | os.PathLike[str]) -> Path:
    """Path with ``~`` and ``~user`` written out.

    Raises:
        InputError: a NUL byte, or a user without a home folder.
    """
    if "\0" in os.fspath(path):
        raise InputError(f"the path {os.fspath(path)!r} holds a NUL byte: give the name of a file.")
    try:
        return Path(path).expanduser()
    except RuntimeError:
        raise InputError(f"{os.fspath(path)} names the home folder of no user: write the path out.") from None


def check_output_file(path: str | os.PathLike[str]) -> None:
    """Refuse what cannot be written as a file, before any work is done for it.

    Raises:
        InputError: ``path`` is a folder or a device.
    """
    final = expanded(path)
    if final.is_dir():
        raise InputError(f"{final} is a folder: give the path of a file.")
    if final.exists() and not stat.S_ISREG(final.stat().st_mode):
        raise InputError(f"{final} is not a regular file: give another path.")


def read_text(path: str | os.PathLike[str], maximum: int, refusal: Callable[[str], InputError]) -> str:
    """Text (UTF-8) of a regular file; a pipe or a device is never opened, since it may have no end.

    Args:
        path: of the file.
        maximum: size that is read [bytes].
        refusal: error for a reason such as "no such file or directory".

    Raises:
        InputError: what ``refusal`` makes of another kind of file, a larger one, other text, or a missing right.
    """
    try:
        with _regular_file(path, maximum, refusal) as file:
            return file.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise refusal(f"it is not UTF-8 text, at byte {error.start}") from None


def read_named_text(path: Path, maximum: int, remedy: str) -> str:
    """Text of a file that its user named.

    Args:
        path: of a regular file.
        maximum: of its size [bytes].
        remedy: what the error says to do.

    Raises:
        InputError: no file, or one that :func:`read_text` refuses.
    """
    if not path.exists():
        raise InputError(f"{path} does not exist: {remedy}.")
    return read_text(path, maximum, lambda reason: InputError(f"{path} cannot be read ({reason}): {remedy}."))


def read_bytes(path: str | os.PathLike[str], maximum: int, refusal: Callable[[str], InputError]) -> bytes:
    """Bytes of a regular file; arguments and errors are those of :func:`read_text`."""
    with _regular_file(path, maximum, refusal) as file:
        return file.read_bytes()


@contextmanager
def _regular_file(path: str | os.PathLike[str], maximum: int, refusal: Callable[[str], InputError]) -> Iterator[Path]:
    """Path of a regular file that is small enough to read; errors of the system become refusals."""
    file = expanded(path)
    try:
        status = file.stat()
        if not stat.S_ISREG(status.st_mode):
            raise refusal("it is not a regular file")
        if status.st_size > maximum:
            raise refusal(f"it has {status.st_size} bytes and may have {maximum} at most")
        yield file
    except OSError as error:
        raise refusal((error.strerror or "unknown error").lower()) from None


def read_json(
    path: str | os.PathLike[str], fault: str = "cannot be read as JSON", remedy: str = "give a JSON file"
) -> Any:
    """Content of a JSON file.

    Args:
        path: of a regular file of at most :data:`MAXIMUM_JSON` bytes.
        fault: what the error says of the file, before the reason.
        remedy: and after it.

    Raises:
        InputError: unreadable file, or text that is not JSON; one sentence with file and reason.
    """

    def refusal(reason: str) -> InputError:
        return InputError(f"{os.fspath(path)} {fault} ({reason}): {remedy}.")

    return parse_json(read_text(path, MAXIMUM_JSON, refusal), refusal)


def parse_json(text: str | bytes, refusal: Callable[[str], InputError]) -> Any:
    """Content of JSON text; InputError that ``refusal`` makes of a reason."""
    try:
        return json.loads(text)
    except RecursionError:
        raise refusal("it is nested too deeply") from None
    except ValueError as error:
        raise refusal(str(error)) from None


def read_json_lines(path: str | os.PathLike[str], fault: str, remedy: str) -> list[dict[str, Any]]:
    """Mappings of a file with one JSON value a line; a line that is no JSON was cut off when it was written.

    Args:
        path: of a regular file of at most :data:`MAXIMUM_JSON_LINES` bytes.
        fault: as of :func:`read_json`.
        remedy: likewise.

    Raises:
        InputError: unreadable file, or a line with another value; one sentence with file and reason.
    """

    def refusal(reason: str) -> InputError:
        return InputError(f"{os.fspath(path)} {fault} ({reason}): {remedy}.")

    found = []
    for number, line in enumerate(read_text(path, MAXIMUM_JSON_LINES, refusal).splitlines(), 1):
        try:
            value = json.loads(line)
        except json.JSONDecodeError:
            continue
        except RecursionError:
            value = None
        if not isinstance(value, dict):
            raise refusal(f"line {number} holds no mapping")
        found.append(value)
    return found


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Path to write to in place of ``path``, moved there when the block ends without an error.

    The temporary file is in the same folder and keeps the suffix (writers choose a format by it); parent folders
    are made. After an error it is removed and ``path`` is as it was. What was written is on the disk before it is
    moved, so that a power cut leaves no empty file.

    Raises:
        InputError: ``path`` is a folder or a device, or a part of it is a file.
    """
    final = expanded(path)
    final = final.resolve() if final.is_symlink() else final
    check_output_file(final)
    make_folder(final.parent)
    handle, name = tempfile.mkstemp(prefix=f".{final.stem}-", suffix=final.suffix, dir=final.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        _to_disk(temporary)
        os.chmod(temporary, _mode_of(final))
        os.replace(temporary, final)
    except OSError as error:
        if error.errno is not None and error.filename is None:
            error.filename = str(final)  # a full disk is met while writing, where nobody knows the name
        raise
    finally:
        temporary.unlink(missing_ok=True)


def _to_disk(path: Path) -> None:
    """Wait until the content of a file is on the disk."""
    # opened anew: writers close their own handle, and some replace the file
    handle = os.open(path, os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _mode_of(path: Path) -> int:
    """Permissions of the file that is replaced; those that the umask gives when there is none."""
    if path.exists():
        return stat.S_IMODE(path.stat().st_mode)
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


def make_folder(path: str | os.PathLike[str]) -> Path:
    """Folder at ``path`` with its parents, made where absent; InputError when a file is in the way."""
    folder = expanded(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise InputError(f"{folder} cannot be a folder, a file is in the way: choose another path.") from None
    return folder


def write_bytes(path: str | os.PathLike[str], data: bytes) -> None:
    """Write ``data`` so that ``path`` has all of it, or still its old content."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(data)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write ``text`` (UTF-8, line ends unchanged) so that ``path`` has all of it, or still its old content."""
    write_bytes(path, text.encode())


def write_json(path: str | os.PathLike[str], content: Any) -> None:
    """Write ``content`` as JSON, whole or not at all; numbers that are not finite raise ValueError."""
    write_text(path, json.dumps(content, indent=1, allow_nan=False) + "\n")


@contextmanager
def output_folder(path: str | os.PathLike[str], *, overwrite: bool = False) -> Iterator[Path]:
    """Folder to fill in place of ``path``, moved there when the block ends without an error.

    After an error it is removed and ``path`` is as it was.

    Args:
        path: folder to end up with; parents are made.
        overwrite: replace a folder that an earlier command wrote. One that holds anything else, files that were put
            there later among it, is never touched.

    Raises:
        InputError: ``path`` is a file, holds the current folder, or has content that may not be replaced.
    """
    final = expanded(path).resolve()
    _check_replaceable(final, overwrite)
    make_folder(final.parent)
    temporary = Path(tempfile.mkdtemp(prefix=f".{final.name}-", dir=final.parent))
    try:
        yield temporary
        (temporary / FOLDER_MARK).write_text("".join(f"{name}\n" for name in _files_in(temporary)))
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o777 & ~mask)
        _check_replaceable(final, overwrite)
        _replace_folder(temporary, final)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def check_output_folder(path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Refuse before long work what :func:`output_folder` would refuse after it; the same InputError."""
    _check_replaceable(expanded(path).resolve(), overwrite)


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
        raise InputError(
            f"{folder} holds an earlier output: choose another folder, or add --overwrite (overwrite=True in Python)."
        )
    # a version before left its mark empty
    written = (folder / FOLDER_MARK).read_text().splitlines()
    added = [name for name in _files_in(folder) if name not in {FOLDER_MARK, *written}] if written else []
    if added:
        raise InputError(
            f"{folder} also holds {added[0]}, which no ddagr command wrote: move it, or choose another folder."
        )


def _files_in(folder: Path) -> list[str]:
    """Files below a folder by their relative paths, in order."""
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir())


def _replace_folder(temporary: Path, final: Path) -> None:
    if not final.exists():
        os.rename(temporary, final)
        return
    old = Path(tempfile.mkdtemp(prefix=f".{final.name}-old-", dir=final.parent))
    os.rename(final, old)
    os.rename(temporary, final)
    shutil.rmtree(old)


def shipped_folder(kind: str) -> Path:
    """Folder of what was trained: ``agents/<kind>`` of the checkout, else the installed package's ``data/<kind>``."""
    package = Path(__file__).resolve().parent
    checkout = package.parent / "agents" / kind
    if checkout.is_dir() and (package.parent / "pyproject.toml").is_file():
        return checkout
    return package / "data" / kind
