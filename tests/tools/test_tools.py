"""The tools of the checkout: their list, their help, and how they are started."""

from __future__ import annotations

import subprocess
import sys

import pytest

import tools
from ddagr_gym import cli, commands


def test_overview_lists_every_tool(capsys):
    assert cli.main(["--help"], tools) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "usage: ./ddagr TOOL [OPTIONS]"
    for name in tools.NAMES:
        (line,) = (line for line in lines if line.split()[:1] == [name])
        assert len(line.split()) > 2


@pytest.mark.parametrize("name", tools.NAMES)
def test_help_of_a_tool_has_examples_that_parse(name, capsys):
    assert cli.main([name, "--help"], tools) == 0
    output = capsys.readouterr().out
    tool = commands.load(name, tools)
    assert tool.examples
    for example in tool.examples:
        assert example in output
        words = example.split()
        assert words[:2] == ["ddagr", name]
        assert isinstance(cli._parse(tool, words[2:]), tool.arguments)


def test_a_command_is_not_a_tool(capsys):
    assert cli.main(["demo"], tools) == 2
    assert "'demo'" in capsys.readouterr().err


def test_python_m_starts_them(repository):
    done = subprocess.run(
        [sys.executable, "-m", "tools", "test", "--worker", "3"], cwd=repository, capture_output=True, text=True
    )
    assert done.returncode == 2
    assert done.stderr == "ddagr: Unrecognized options: --worker, 3: did you mean --workers; see ddagr test --help.\n"


def test_the_script_starts_every_tool(repository):
    script = (repository / "ddagr").read_text()
    body = script[script.index("program_of() {") : script.index("checkout_of() {")]
    (line,) = (line for line in body.splitlines() if line.endswith("echo tools ;;"))
    assert set(line.partition(")")[0].replace("|", " ").split()) == set(tools.NAMES)
