"""Progress: a bar on a terminal, one line per ten percent elsewhere. Never any colour.

Functions take a callable that is given one line of text at a time (``print`` will do). :func:`counting` shows counted
steps on it: as lines, or as a bar where the callable is a :class:`LinePrinter` on a terminal.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import TextIO, cast

_BAR_WIDTH = 30  # [characters] (ours): label and times still fit a line of 80
_SECONDS_BETWEEN_DRAWS = 0.1  # (ours) as often as an eye follows


class Progress:
    """Counts steps of a known number and shows them.

    Use as a context manager::

        with Progress(len(soils), "simulating") as progress:
            for soil in soils:
                ...
                progress.advance()

    Only plain text and carriage returns are written, so NO_COLOR and dumb terminals need no special case.

    Args:
        total: number of steps, at least 1.
        label: what is being done.
        stream: where to show it; standard error when None.
    """

    def __init__(self, total: int, label: str, *, stream: TextIO | None = None) -> None:
        if total < 1:
            raise ValueError(f"total is {total}: a progress bar needs at least one step")
        self.total = total
        self.done = 0
        self._label = label
        self._stream = sys.stderr if stream is None else stream
        self._terminal = self._stream.isatty()
        self._start = time.monotonic()
        self._last_draw = -1.0
        self._last_tenth = 0
        self._width = 0

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._terminal and self._width:
            self._draw()
            self._write("\n")

    def advance(self, steps: int = 1) -> None:
        """Count ``steps`` as done and show it."""
        self.done = min(self.total, self.done + steps)
        if self._terminal:
            self._draw_if_due()
        else:
            self._report_tenths()

    def _draw_if_due(self) -> None:
        now = time.monotonic()
        if self.done == self.total or now - self._last_draw >= _SECONDS_BETWEEN_DRAWS:
            self._last_draw = now
            self._draw()

    def _draw(self) -> None:
        filled = _BAR_WIDTH * self.done // self.total
        text = f"{self._label} [{'#' * filled}{'.' * (_BAR_WIDTH - filled)}] {self._state()}"
        self._write("\r" + text.ljust(self._width))
        self._width = max(self._width, len(text))

    def _report_tenths(self) -> None:
        tenth = 10 * self.done // self.total
        if tenth > self._last_tenth:
            self._last_tenth = tenth
            self._write(f"{self._label}: {self._state()}\n")

    def _state(self) -> str:
        elapsed = time.monotonic() - self._start
        text = f"{100 * self.done // self.total} % ({self.done}/{self.total}, {elapsed:.0f} s"
        if 0 < self.done < self.total:
            text += f", about {elapsed / self.done * (self.total - self.done):.0f} s left"
        return text + ")"

    def _write(self, text: str) -> None:
        self._stream.write(text)
        self._stream.flush()


class LinePrinter:
    """Prints lines of progress on a stream.

    Args:
        prefix: at the beginning of each line.
        stream: standard error when None.
    """

    def __init__(self, prefix: str = "", *, stream: TextIO | None = None) -> None:
        self.stream = sys.stderr if stream is None else stream
        self._prefix = prefix

    def __call__(self, line: str) -> None:
        """Print one line."""
        print(f"{self._prefix}{line}", file=self.stream, flush=True)


def counting(total: int, label: str, progress: Callable[[str], None] | None) -> Progress:
    """Counter of steps that is shown where ``progress`` says.

    Args:
        total: number of steps, at least 1.
        label: what is being done.
        progress: called with one line per ten percent; a :class:`LinePrinter` gets a bar on its stream. None shows
            nothing.
    """
    stream = progress.stream if isinstance(progress, LinePrinter) else cast(TextIO, _Lines(progress))
    return Progress(total, label, stream=stream)


class _Lines:
    """What :class:`Progress` needs of a stream, over a callable that takes lines."""

    def __init__(self, take: Callable[[str], None] | None) -> None:
        self._take = take

    def isatty(self) -> bool:
        return False

    def write(self, text: str) -> None:
        if self._take is not None:
            self._take(text.rstrip("\n"))

    def flush(self) -> None:
        """Lines are given at once."""
