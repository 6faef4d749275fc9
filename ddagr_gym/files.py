"""Files and folders that are whole or absent."""

from __future__ import annotations

import json
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ddagr_gym.errors import InputError

FOLDER_MARK = ".ddagr-output"
"""Empty file in every folder that a command wrote; only such a folder is ever replaced."""


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


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Path to write to in place of ``path``, moved there when the block ends without an error.

    The temporary file is in the same folder and keeps the suffix (writers choose a format by it); parent folders
    are made. After an error it is removed and ``path`` is as it was.

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
        os.chmod(temporary, _mode_of(final))
        os.replace(temporary, final)
    except OSError as error:
        if error.errno is not None and error.filename is None:
            error.filename = str(final)  # a full disk is met while writing, where nobody knows the name
        raise
    finally:
        temporary.unlink(missing_ok=True)


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
        overwrite: replace a folder that an earlier command wrote. One that holds anything else is never touched.

    Raises:
        InputError: ``path`` is a file, holds the current folder, or has content that may not be replaced.
    """
    final = expanded(path).resolve()
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
