"""``./ddagr docs``: the documentation site, with broken links as errors."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from ddagr_gym.errors import InputError
from tools import CHECKOUT

EXAMPLES = (
    "ddagr docs",
    "ddagr docs --serve",
)


@dataclass(frozen=True)
class Arguments:
    """Build the documentation site from docs/ and the docstrings; a broken link is an error.

    Attributes:
        serve: instead show it on http://127.0.0.1:8000, built anew after every change.
        output: folder for the site.
    """

    serve: bool = False
    output: Path = CHECKOUT / "site"


def run(arguments: Arguments) -> int:
    """Build or serve the site and return the exit code of mkdocs."""
    plan = CHECKOUT / "mkdocs.yml"
    if not plan.is_file():
        raise InputError(f"{plan} is missing: restore it with git, it says what the site is made of.")
    words = ["serve"] if arguments.serve else ["build", "--site-dir", str(arguments.output.resolve())]
    command = [sys.executable, "-m", "mkdocs", *words, "--strict", "-f", str(plan)]
    return subprocess.run(command, cwd=CHECKOUT).returncode
