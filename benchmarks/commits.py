"""Which commit of the checkout made a result."""

import subprocess
from pathlib import Path


def commit_of(checkout: Path) -> str:
    """Commit of a checkout, with a mark where tracked files differ from it; empty outside version control.

    Args:
        checkout: folder of it.
    """

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], capture_output=True, text=True, cwd=checkout, check=False).stdout.strip()

    return git("rev-parse", "HEAD") + ("+changes" if git("status", "--porcelain", "--untracked-files=no") else "")
