"""``./ddagr docs``: the documentation site, with broken links and references as errors."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ddagr_gym.errors import InputError, unknown_name
from tools import CHECKOUT
from tools.documentation.pages import keep_pictures, pages_that_run, run_page, with_printed

EXAMPLES = (
    "ddagr docs",
    "ddagr docs --serve",
    "ddagr docs --run first_turn own_robot",
    "ddagr docs --run all",
)


@dataclass(frozen=True)
class Arguments:
    """Build the documentation site from docs/ and the docstrings; a broken link or reference is an error.

    The site opens from its folder, without a server and without network.

    Attributes:
        run: tutorials to run first, by name, or "all" (minutes each): what they print and draw is written into
            docs/tutorials where it changed.
        serve: show the site on http://127.0.0.1:8000 instead, built anew after every change.
        output: folder for the site.
    """

    run: tuple[str, ...] = ()
    serve: bool = False
    output: Path = CHECKOUT / "site"


def run(arguments: Arguments) -> int:
    """Run what was asked for, build or serve the site, and return the exit code of mkdocs."""
    plan = CHECKOUT / "mkdocs.yml"
    if not plan.is_file():
        raise InputError(f"{plan} is missing: restore it with git, it says what the site is made of.")
    for page in _chosen(arguments.run):
        print(f"Running {page.relative_to(CHECKOUT)} ...", flush=True)
        _refresh(page)
    words = ["serve"] if arguments.serve else ["build", "--site-dir", str(arguments.output.resolve())]
    command = [sys.executable, "-m", "mkdocs", *words, "--strict", "-f", str(plan)]
    # The hooks of mkdocs.yml are modules of the checkout.
    environment = os.environ | {"PYTHONPATH": str(CHECKOUT), "NO_MKDOCS_2_WARNING": "1"}
    code = subprocess.run(command, cwd=CHECKOUT, env=environment).returncode
    if code == 0 and not arguments.serve:
        print(f"Open {arguments.output.resolve() / 'index.html'}")
    return code


def _chosen(names: tuple[str, ...]) -> Iterator[Path]:
    pages = pages_that_run()
    for name in pages if names == ("all",) else names:
        if name not in pages:
            raise unknown_name("tutorial", name, pages)
        yield pages[name]


def _refresh(page: Path) -> None:
    """Run a page and write what it prints and draws beside its text."""
    with tempfile.TemporaryDirectory(prefix="ddagr-page-") as temporary:
        printed = run_page(page, Path(temporary))
        page.write_text(with_printed(page.read_text(), printed))
        keep_pictures(page, Path(temporary))
