"""What a step of the demonstration shows on its page."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Section:
    """What one step shows.

    Attributes:
        title: of the section.
        text: table, printed and on the page.
        html: figures and links below it, relative to the page.
    """

    title: str
    text: str
    html: str
