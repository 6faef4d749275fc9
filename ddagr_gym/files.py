"""Files that are whole or absent."""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ddagr_gym.errors import InputError


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Path to write to in place of ``path``, moved there when the block ends without an error.

    The temporary file stands in the same folder and keeps the suffix (writers choose a format by it); parent folders
    are made. After an error it is removed and ``path`` is as it was.

    Raises:
        InputError: ``path`` is a folder or a device, or a part of it is a file.
    """
    final = Path(path).expanduser()
    final = final.resolve() if final.is_symlink() else final
    if final.is_dir():
        raise InputError(f"{final} is a folder: give the path of a file.")
    if final.exists() and not stat.S_ISREG(final.stat().st_mode):
        raise InputError(f"{final} is not a regular file: give another path.")
    make_folder(final.parent)
    handle, name = tempfile.mkstemp(prefix=f".{final.stem}-", suffix=final.suffix, dir=final.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        os.chmod(temporary, _mode_of(final))
        os.replace(temporary, final)
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
    """Folder at ``path`` with its parents, made where absent; InputError when a file stands in the way."""
    folder = Path(path).expanduser()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise InputError(f"{folder} cannot be a folder, a file stands in the way: choose another path.") from None
    return folder
