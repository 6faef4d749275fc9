"""The examples in the docstrings run and give what they say."""

from __future__ import annotations

import doctest
import inspect

import pytest

import ddagr_gym

FAST = ("load_recording", "simulate", "check", "estimate", "export")
SLOW = ("replay", "isolability", "next_drive", "diagnose", "calibrate", "adapt")
SKIPPED = ("diagnose_drives", "guess_topic_map")
"""Whose examples name folders that only a user has."""


def run_example(name: str) -> None:
    (example,) = doctest.DocTestFinder(recurse=False).find(getattr(ddagr_gym, name), name)
    assert example.examples
    assert doctest.DocTestRunner().run(example).failed == 0


@pytest.mark.parametrize("name", FAST)
def test_quick_examples(name):
    run_example(name)


@pytest.mark.slow
@pytest.mark.parametrize("name", SLOW)
def test_longer_examples(name):
    run_example(name)


def test_every_function_has_an_example():
    functions = {name for name in ddagr_gym.__all__ if name.islower() and name.isidentifier()}
    functions -= {"__version__", "register_environments"}
    assert functions == {*FAST, *SLOW, *SKIPPED}
    for name in functions:
        sections = inspect.getdoc(getattr(ddagr_gym, name)) or ""
        assert all(f"{title}:" in sections for title in ("Args", "Returns", "Raises", "Examples"))
