from __future__ import annotations

from collections.abc import Callable
from html.parser import HTMLParser
from typing import Any

import pytest

import ddagr_gym


@pytest.fixture(scope="session")
def drive() -> ddagr_gym.SimulationResult:
    """A sound drive of 36 s at 50 Hz with poses."""
    return ddagr_gym.simulate("arcs", rate=50.0, pose_rate=5.0)


class Page(HTMLParser):
    """Text of a fragment of HTML; closing tags must match."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text = ""
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


@pytest.fixture(scope="session")
def page_text() -> Callable[[Any], str]:
    """Function that gives the text of a result's notebook view, whose tags must be in order."""
    return lambda result: Page(result._repr_html_()).text
