"""Long commands that go on where they were stopped."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def resumable(parts: Path) -> Iterator[None]:
    """Work whose finished steps are kept in a folder until it is done.

    Args:
        parts: the folder; removed after the work. It stays where the work ended in an error or was stopped.

    Raises:
        KeyboardInterrupt: the work was stopped; says how it goes on.
    """
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"the same command goes on from {parts}") from None
    shutil.rmtree(parts, ignore_errors=True)
