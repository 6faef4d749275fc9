"""Hash of the sources on which thresholds depend."""

from __future__ import annotations

import hashlib
import inspect
from functools import cache
from pathlib import Path

from ddagr_gym.physics.effects.registry import effect_kinds

_PACKAGE = Path(__file__).resolve().parents[2]
_FOLDERS = ("diagnosis", "identification", "replay_analysis", "physics", "sensors", "recordings", "control")
_FILES = (
    "simulator.py",
    "simulator_kernel.py",
    "parameters.py",
    "frames.py",
    "jit.py",
)


def source_digest() -> str:
    """SHA-256 over the sources of diagnosis, replay, physics, sensors and simulator, and of effects from elsewhere."""
    digest = hashlib.sha256(_own_digest().encode())
    files = {inspect.getsourcefile(kind) for kind in effect_kinds().values()}
    for path in sorted(Path(name) for name in files if name is not None):
        if not path.resolve().is_relative_to(_PACKAGE):
            digest.update(path.read_bytes())
    return digest.hexdigest()


@cache
def _own_digest() -> str:
    files = [path for folder in _FOLDERS for path in (_PACKAGE / folder).rglob("*.py")]
    digest = hashlib.sha256()
    for path in sorted([*files, *(_PACKAGE / name for name in _FILES)]):
        digest.update(path.relative_to(_PACKAGE).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()
