"""Pages whose examples are run: blocks of Python and of commands, what they print, and the pictures they make.

A page is Markdown. Its fenced blocks mean, in their order and within one folder that is empty at first:

=====================  ==============================================================================================
block                  what happens
=====================  ==============================================================================================
python                 is run; all blocks of a page share their names
sh                     each line is a command, ``./ddagr ...``, and is run
any, title="FILE"      is written to FILE and not run
.text .printed         is what the block before it prints; numbers may differ by TOLERANCE
=====================  ==============================================================================================

A picture that the page takes from its own folder (``![](first_turn/path.png)`` in ``first_turn.md``) is one that the
run writes, here ``path.png``.
"""

from __future__ import annotations

import json
import math
import os
import re
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TUTORIALS = ROOT / "docs" / "tutorials"
WIDEST = 1400
"""Pixels: twice the width of a page, for fine screens."""
TOLERANCE = 0.02
"""Relative difference of a printed number from the page's: other processors round differently (ours)."""

NOTHING = 1e-9
"""Printed numbers below this are rounding (ours)."""

_BLOCK = re.compile(r"^```(?P<head>[^\n`]*)\n(?P<body>.*?)^```[ ]*$", re.DOTALL | re.MULTILINE)
_TITLE = re.compile(r'title="([^"]+)"')
_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_RUN_TIME = re.compile(r"\d+(?:\.\d+)? (?:s of|times real time on) one core")
_PICTURE = re.compile(r"!\[[^\]]*\]\(([^)\s]+)\)")


@dataclass(frozen=True)
class Block:
    """A fenced block.

    Attributes:
        language: first word of its head, without dot.
        title: file to write, empty for none.
        printed: whether it is what the block before it prints.
        text: between the fences.
        line: number of its first line in the page, from 1.
        span: where it stands in the page, fences included.
    """

    language: str
    title: str
    printed: bool
    text: str
    line: int
    span: tuple[int, int]

    @property
    def runs(self) -> bool:
        """Whether it is run."""
        return not self.title and not self.printed and self.language in ("python", "sh")


def blocks(page: str) -> list[Block]:
    """Fenced blocks of a page that begin at the left margin."""
    found = []
    for match in _BLOCK.finditer(page):
        head = match["head"]
        words = re.findall(r"[\w-]+", _TITLE.sub("", head))
        title = _TITLE.search(head)
        line = page.count("\n", 0, match.start("body")) + 1
        name = title[1] if title else ""
        found.append(Block(words[0] if words else "", name, "printed" in words, match["body"], line, match.span()))
    return found


def command_lines(block: str) -> list[list[str]]:
    """Words after ``./ddagr`` of each command of a block; a backslash at the end of a line goes on in the next.

    Raises:
        ValueError: a line that is no such command.
    """
    commands = []
    for line in block.replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        if words and words[0] != "./ddagr":
            raise ValueError(f"{line!r} is not a command of ddagr: begin it with ./ddagr.")
        if words:
            commands.append(words[1:])
    return commands


def pictures(page: str, stem: str) -> list[str]:
    """Pictures that the run of page ``stem`` makes, relative to the folder of its run."""
    return [path.removeprefix(f"{stem}/") for path in _PICTURE.findall(page) if path.startswith(f"{stem}/")]


def pages_that_run() -> dict[str, Path]:
    """The tutorials by name: pages whose blocks are run."""
    return {path.stem: path for path in sorted(TUTORIALS.glob("*.md")) if any(b.runs for b in blocks(path.read_text()))}


def keep_pictures(page: Path, folder: Path) -> None:
    """Copy the pictures of a run beside its page, in 128 colours and at most WIDEST pixels wide, which is small.

    Args:
        page: that was run.
        folder: of its run.
    """
    from PIL import Image

    for name in pictures(page.read_text(), page.stem):
        target = page.parent / page.stem / name
        target.parent.mkdir(parents=True, exist_ok=True)
        picture = Image.open(folder / name).convert("RGB")
        if picture.width > WIDEST:
            size = (WIDEST, round(picture.height * WIDEST / picture.width))
            picture = picture.resize(size, Image.Resampling.LANCZOS)
        picture.quantize(128, dither=Image.Dither.NONE).save(target, optimize=True)


def run_page(page: Path, folder: Path) -> dict[int, str]:
    """Run a page in a process of its own.

    Args:
        page: the Markdown file.
        folder: that exists and is empty.

    Returns:
        What each block that was run printed, by the block's line.

    Raises:
        RuntimeError: a block failed; its output is part of the sentence.
    """
    environment = os.environ | {"PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg", "OMP_NUM_THREADS": "1"}
    words = [sys.executable, "-m", "tools.documentation.run_blocks", str(page.resolve())]
    done = subprocess.run(words, cwd=folder, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{page.name} does not run:\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}")
    return {int(line): text for line, text in json.loads(done.stdout).items()}


def differences(page: str, printed: dict[int, str]) -> list[str]:
    """Sentences on what a page shows and its run did not print, or the other way round."""
    sentences = []
    for block, shown in _with_shown(page):
        expected, found = "" if shown is None else shown.text, printed[block.line]
        if not same_text(expected, found):
            sentences.append(f"line {block.line}: the page shows\n{expected}\nand the run prints\n{found}")
    return sentences


def with_printed(page: str, printed: dict[int, str]) -> str:
    """The page with what its run printed in the blocks for it; where a block shows the same, it stays."""
    for block, shown in reversed(_with_shown(page)):
        text = printed[block.line]
        if shown is not None and same_text(shown.text, text):
            continue
        start, end = (block.span[1], block.span[1]) if shown is None else shown.span
        new = f"```{{ .text .printed }}\n{text.rstrip()}\n```" if text.strip() else ""
        page = page[:start] + ("\n\n" if shown is None and new else "") + new + page[end:]
    return page


def _with_shown(page: str) -> list[tuple[Block, Block | None]]:
    """Each block that is run and the block with what it prints."""
    found = blocks(page)
    following = [*found[1:], None]
    pairs = zip(found, following, strict=True)
    return [(block, after if after and after.printed else None) for block, after in pairs if block.runs]


def same_text(expected: str, found: str) -> bool:
    """Whether two outputs agree but for run times: the same words, numbers within TOLERANCE or a last place."""
    expected, found = (_RUN_TIME.sub("", text) for text in (expected, found))
    ours, theirs = _NUMBER.findall(expected), _NUMBER.findall(found)
    words = [" ".join(re.sub(r"-{2,}", "--", _NUMBER.sub("#", text)).split()) for text in (expected, found)]
    return words[0] == words[1] and all(_close(a, b) for a, b in zip(ours, theirs, strict=True))


def _close(expected: str, found: str) -> bool:
    decimals = len(expected.partition(".")[2]) if "e" not in expected.lower() else 0
    last_place = 10.0**-decimals if decimals else NOTHING
    return math.isclose(float(expected), float(found), rel_tol=TOLERANCE, abs_tol=1.01 * last_place)
