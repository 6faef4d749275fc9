"""What all results share: a headline and tables, as text and in a notebook."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from ddagr_gym.errors import InputError
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


def at_least(**bounds: tuple[float | None, float]) -> None:
    """Refuse numbers below their least value; those that are None pass.

    Args:
        bounds: value and least value by name.

    Raises:
        InputError: with the first one that is below, or no number.
    """
    for name, (given, least) in bounds.items():
        if given is not None and not given >= least:
            raise InputError(f"{name} is {given}: give at least {least}.")


def names_of(given: str | Sequence[str]) -> tuple[str, ...]:
    """One name or several, as a tuple."""
    return (given,) if isinstance(given, str) else tuple(given)
