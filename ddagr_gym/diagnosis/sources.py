"""Hash of the sources on which thresholds depend."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path


@cache
def source_digest() -> str:
    """SHA-256 over the package's diagnosis, replay, physics, sensors and simulator sources."""
    package = Path(__file__).resolve().parents[1]
    folders = ("diagnosis", "replay", "physics", "sensors")
    files = [path for folder in folders for path in (package / folder).rglob("*.py")]
    files += [package / "simulator.py", package / "simulator_kernel.py", package / "parameters.py"]
    digest = hashlib.sha256()
    for path in sorted(files):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()
