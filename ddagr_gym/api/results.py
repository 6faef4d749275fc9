"""What all results share: a headline and tables, as text and in a notebook."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from ddagr_gym.files import output_folder
from ddagr_gym.reporting.text_table import format_value

_STYLE = "text-align:left;padding:0 .8em 0 0"
_NUMBER_STYLE = "text-align:right;padding:0 .8em 0 0"


@dataclass(frozen=True)
class Table:
    """Rows under a header.

    Attributes:
        header: titles of the columns.
        rows: each as long as the header.
        caption: above the table, "" for none.
    """

    header: Sequence[str]
    rows: Sequence[Sequence[object]]
    caption: str = ""


class Result(ABC):
    """A result with a headline and tables. ``print(result)`` shows what the command of its name prints."""

    @property
    @abstractmethod
    def headline(self) -> str:
        """The answer in a sentence."""

    @abstractmethod
    def tables(self) -> Sequence[Table]:
        """Tables of the notebook view."""

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.headline}>"

    def _repr_html_(self) -> str:
        """Headline and tables for a notebook; every text is escaped."""
        return f"<div><p><b>{escape(self.headline)}</b></p>{''.join(map(_html, self.tables()))}</div>"


def _html(table: Table) -> str:
    caption = f"<caption>{escape(table.caption)}</caption>" if table.caption else ""
    head = "".join(f'<th style="{_STYLE}">{escape(title)}</th>' for title in table.header)
    rows = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in table.rows)
    return f"<table>{caption}<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"


def _cell(value: object) -> str:
    style = _NUMBER_STYLE if isinstance(value, int | float) else _STYLE
    return f'<td style="{style}">{escape(format_value(value))}</td>'


class Report(Result):
    """A result that also writes a folder of files and figures."""

    def report(
        self,
        folder: str | os.PathLike[str],
        *,
        overwrite: bool = False,
        progress: Callable[[str], None] | None = None,
    ) -> Path:
        """Write files and figures, whole or not at all; the class says which. Figures need matplotlib.

        Args:
            folder: to make.
            overwrite: replace a folder that an earlier report wrote.
            progress: called with a line of text as figures are drawn, where there are many.

        Returns:
            The folder.

        Raises:
            InputError: the folder holds something else, or an earlier report without ``overwrite``.
        """
        with output_folder(folder, overwrite=overwrite) as filled:
            self._fill(filled, progress)
        return Path(folder)

    @abstractmethod
    def _fill(self, folder: Path, progress: Callable[[str], None] | None) -> None:
        """Write everything into an empty folder."""


def names_of(given: str | Sequence[str]) -> tuple[str, ...]:
    """One name or several, as a tuple."""
    return (given,) if isinstance(given, str) else tuple(given)
