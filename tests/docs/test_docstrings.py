"""Docstrings in the reference: roles, simple tables, literal blocks and shared entries become Markdown."""

from __future__ import annotations

from tools.documentation.docstrings import to_markdown

TABLE = """Units.

====  =========  ========
No.   what       unit
====  =========  ========
1     speed      m/s
2     a long     rad/s
      name
====  =========  ========

End.
"""


def test_a_table_with_a_head_and_a_row_over_two_lines():
    rows = [line for line in to_markdown(TABLE).splitlines() if line.startswith("|")]
    assert rows == [
        "| No. | what | unit |",
        "| --- | --- | --- |",
        "| 1 | speed | m/s |",
        "| 2 | a long name | rad/s |",
    ]


def test_a_table_without_a_head():
    rows = to_markdown("==  ==\na   b\n==  ==\n").split("\n")
    assert rows[1:4] == ["|  |  |", "| --- | --- |", "| a | b |"]


def test_roles_become_links_that_may_miss():
    text = to_markdown("See :func:`~ddagr_gym.simulator.simulate` and ``slip``.")
    link = '<autoref identifier="ddagr_gym.simulator.simulate" optional><code>simulate</code></autoref>'
    assert text == f"See {link} and `slip`."


def test_literal_blocks_are_fenced():
    assert to_markdown("Chain::\n\n    a -> b\n\nEnd.") == "Chain:\n\n```text\n    a -> b\n```\n\nEnd."


def test_shared_entries_are_told_apart():
    text = to_markdown("Args:\n    x, y: position\n        of the robot [m].\n    yaw: heading.")
    assert text.splitlines()[1:] == [
        "    x: position of the robot [m].",
        "    y: position",
        "        of the robot [m].",
        "    yaw: heading.",
    ]


def test_terms_with_indented_texts_are_definitions():
    text = to_markdown("Text of\ntwo lines.\n\nwindow\n    A piece\n    of a drive.\nArgs:\n    x: position.")
    assert text == "Text of\ntwo lines.\n\n\nwindow\n:   A piece\n    of a drive.\n\nArgs:\n    x: position."


def test_aligned_words_are_a_list():
    text = to_markdown(
        "Words\n    *gain*   fall of the cost\n             by an effect\n    *gate*   what it must exceed"
    )
    items = ["- *gain*: fall of the cost", "  by an effect", "- *gate*: what it must exceed"]
    assert [line for line in text.splitlines() if line] == ["**Words**", *items]


def test_what_stands_below_an_indented_table_goes_to_the_margin():
    text = to_markdown("Stages\n    ==  ==\n    a   b\n    ==  ==\n\n    More of it.\n\nEnd.")
    assert text.splitlines()[-3:] == ["More of it.", "", "End."]
