"""README: short, with pictures that exist, examples that run and commands that the command line takes."""

from __future__ import annotations

import re

import pytest

from ddagr_gym import cli, commands
from tools.documentation.pages import blocks, command_lines

LARGEST = 8_000
"""Characters: a front page that is read at once."""
LARGEST_PICTURE = 300_000
"""Bytes."""
CHEAP = ("simulate", "check")
"""Commands of the README that take seconds; the others are run by the slow tests of the tutorials."""


@pytest.fixture(scope="module")
def readme(repository):
    return (repository / "README.md").read_text()


def shell_commands(readme):
    return [words for block in blocks(readme) if block.language == "sh" for words in command_lines(block.text)]


def test_is_short(readme):
    assert len(readme) < LARGEST


def test_pictures_and_links_exist(readme, repository):
    targets = re.findall(r"\]\(([^)#:]+)\)", readme)
    pictures = [target for target in targets if target.endswith(".png")]
    assert len(pictures) == 3
    assert [target for target in targets if not (repository / target).exists()] == []
    assert all((repository / picture).stat().st_size < LARGEST_PICTURE for picture in pictures)


def run_example(readme, word, tmp_path, monkeypatch, capsys):
    """What the one Python example that holds ``word`` prints."""
    monkeypatch.chdir(tmp_path)
    (block,) = (block for block in blocks(readme) if block.language == "python" and word in block.text)
    exec(compile("\n" * (block.line - 1) + block.text, "README.md", "exec"), {})
    return capsys.readouterr().out.splitlines()


def test_the_turn_succeeds(readme, tmp_path, monkeypatch, capsys):
    (line,) = run_example(readme, "env.step", tmp_path, monkeypatch, capsys)
    assert line.startswith("True ")


@pytest.mark.slow
def test_the_diagnosis_finds_the_slope(readme, tmp_path, monkeypatch, capsys):
    _, line = run_example(readme, "diagnose", tmp_path, monkeypatch, capsys)
    assert line.startswith("('slope',) True 0.0")
    # the simulated slope, and a tenth of it: the interval of the size
    assert float(line.split()[-1]) == pytest.approx(0.04, abs=0.004)


def test_shell_examples_are_commands(readme):
    lines = shell_commands(readme)
    assert {words[0] for words in lines} >= {"simulate", "replay", "diagnose", "train", "evaluate"}
    for words in lines:
        command = commands.load(words[0])
        assert isinstance(cli._parse(command, words[1:]), command.arguments)


def test_cheap_shell_examples_run(readme, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    cheap = [words for words in shell_commands(readme) if words[0] in CHEAP]
    # what reads the output of a diagnosis cannot be run without one
    cheap = [words for words in cheap if not any("diagnosis/" in word for word in words)]
    assert [cli.main(words) for words in cheap] == [0] * len(cheap)
    assert len(cheap) >= 2
