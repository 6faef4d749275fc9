"""The command line: help, exit codes, one sentence for every kind of bad input."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import pytest

import tools
from ddagr_gym import __version__, cli, commands
from ddagr_gym.errors import InputError


@dataclass(frozen=True)
class Arguments:
    """Do nothing.

    Attributes:
        side: which side.
        speed: how fast [rad/s].
        count: how often.
    """

    side: str
    speed: float = 1.0
    count: int = 1


@pytest.fixture
def fake_command(monkeypatch):
    """Registers a command called fake-command whose work the test supplies."""

    def register(run):
        module = ModuleType("ddagr_gym.commands.fake_command")
        module.Arguments, module.EXAMPLES, module.run = Arguments, ("ddagr fake-command --side left",), run
        monkeypatch.setitem(sys.modules, module.__name__, module)
        monkeypatch.setattr(commands, "NAMES", (*commands.NAMES, "fake-command"))

    return register


def refused(capsys, *words: str) -> str:
    """Run a command line that must be refused and return its one sentence."""
    assert cli.main(words) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert output.err.startswith("ddagr: ")
    assert output.err.count("\n") == 1
    return output.err


def test_overview_lists_every_command_in_one_screen(capsys):
    assert cli.main(["--help"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) <= 40
    assert all(len(line) <= 110 for line in lines)
    for name in commands.NAMES:
        (line,) = (line for line in lines if line.split()[:1] == [name])
        assert len(line.split()) > 2


def test_no_words_show_the_overview(capsys):
    assert cli.main([]) == 0
    assert capsys.readouterr().out.startswith("usage: ddagr COMMAND")


def test_version(capsys):
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out == f"ddagr-gym {__version__}\n"


@pytest.mark.parametrize("name", commands.NAMES)
def test_help_of_a_command_has_examples_that_parse(name, capsys):
    assert cli.main([name, "--help"]) == 0
    output = capsys.readouterr().out
    command = commands.load(name)
    assert "Examples:" in output
    assert command.examples
    for example in command.examples:
        assert example in output
        words = example.split()
        assert words[:2] == ["ddagr", name]
        assert isinstance(cli._parse(command, words[2:]), command.arguments)


README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


def readme_lines() -> list[str]:
    """Command lines of README.md: those of its code blocks, then those inside its sentences."""
    blocks = re.findall(r"^```.*?\n(.*?)^```", README, flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"^```.*?^```", "", README, flags=re.MULTILINE | re.DOTALL)
    lines = [line for block in blocks for line in block.splitlines() if line.startswith("./ddagr")]
    return lines + [" ".join(code.split()) for code in re.findall(r"`(\./ddagr\b[^`]*)`", text)]


@pytest.mark.parametrize("name", commands.NAMES)
def test_help_shows_no_default_that_stands_for_nothing(name, capsys):
    assert cli.main([name, "--help"]) == 0
    shown = capsys.readouterr().out
    for nothing in ("None", "(default: )", "(default: '')"):
        assert nothing not in shown


def test_readme_shows_command_lines():
    named = {words[1] for line in readme_lines() if len(words := line.split()) > 1}
    assert {"demo", "simulate", "check", "replay", "diagnose", "train", "evaluate"} <= named


@pytest.mark.parametrize("line", readme_lines())
def test_command_lines_of_the_readme_parse(line):
    program, *words = shlex.split(line, comments=True)
    assert program == "./ddagr"
    if not words or words[0].startswith("-"):
        pytest.skip("names no command")
    command = commands.load(words[0], tools if words[0] in tools.NAMES else commands)
    if len(words) == 1 and f"`{line}`" in README:
        pytest.skip("a sentence names the command without its arguments")
    given = ["path" if re.fullmatch(r"[A-Z]{2,}(\.\.\.)?", word) else word for word in words[1:]]
    assert isinstance(cli._parse(command, given), command.arguments)


def test_unknown_command_names_the_closest(capsys):
    assert "'soils'" in refused(capsys, "soil")


@pytest.mark.parametrize("name", commands.CHECKOUT_TOOLS)
def test_a_tool_of_the_checkout_is_no_command(name, capsys):
    assert f"run ./ddagr {name} in the checkout" in refused(capsys, name)


def test_option_before_the_command(capsys):
    assert "'--soil'" in refused(capsys, "--soil", "simulate")


@pytest.mark.parametrize(
    ("words", "fragments"),
    [
        ((), ("--side",)),
        (("--side",), ("--side",)),
        (("--side", "left", "--speed", "fast"), ("--speed", "'fast'")),
        (("--side", "left", "--count", "1.5"), ("--count", "'1.5'")),
        (("--side", "left", "--spede", "3"), ("--spede", "did you mean --speed")),
        (("--side", "left", "right"), ("right",)),
        (("--syde", "left"), ("Unrecognized options: --syde",)),
    ],
)
def test_bad_options_are_one_sentence_with_the_value(fake_command, capsys, words, fragments):
    fake_command(lambda arguments: pytest.fail("must not run"))
    sentence = refused(capsys, "fake-command", *words)
    assert all(fragment in sentence for fragment in fragments), sentence
    assert sentence.endswith("; see ddagr fake-command --help.\n")
    assert not re.search("[╭│╰─]", sentence)


@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
def test_bad_options_read_the_same_in_every_encoding(encoding):
    done = subprocess.run(
        [sys.executable, "-m", "ddagr_gym", "evaluate", "--worker", "3"],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONIOENCODING": encoding},
    )
    assert done.returncode == 2
    complaint = "Unrecognized options: --worker, 3: did you mean --workers"
    assert done.stderr == f"ddagr: {complaint}; see ddagr evaluate --help.\n"


def test_of_missing_options_the_names_are_said(capsys):
    sentence = refused(capsys, "calibrate", "monday.csv")
    assert sentence == "ddagr: Missing from ddagr calibrate: --output, --robot; see ddagr calibrate --help.\n"


def test_negative_numbers_are_values_not_options(fake_command):
    seen = []
    fake_command(seen.append)
    assert cli.main(["fake-command", "--side", "left", "--speed", "-2.5e-1"]) == 0
    assert seen == [Arguments("left", -0.25)]


def test_exit_code_of_the_work_is_passed_on(fake_command):
    fake_command(lambda arguments: 1)
    assert cli.main(["fake-command", "--side", "left"]) == 1


def test_input_error_is_one_sentence(fake_command, capsys):
    def run(arguments):
        raise InputError("mass is -1 kg:\n give a positive one.")

    fake_command(run)
    assert refused(capsys, "fake-command", "--side", "left") == "ddagr: mass is -1 kg: give a positive one.\n"


@pytest.mark.parametrize("kind", ["absent", "folder", "under a file"])
def test_file_errors_are_one_sentence_with_the_path(fake_command, capsys, tmp_path, kind):
    (tmp_path / "file").write_text("")
    path = {"absent": tmp_path / "absent", "folder": tmp_path, "under a file": tmp_path / "file" / "x"}[kind]
    fake_command(lambda arguments: path.open())
    assert str(path) in refused(capsys, "fake-command", "--side", "left")


def test_permission_error_is_one_sentence(fake_command, capsys):
    def run(arguments):
        raise PermissionError(13, "Permission denied", "/nowhere/out.csv")

    fake_command(run)
    assert "/nowhere/out.csv: permission denied" in refused(capsys, "fake-command", "--side", "left")


def test_absent_optional_package_names_its_extra(fake_command, capsys, monkeypatch):
    def run(arguments):
        import pyarrow  # noqa: F401

    monkeypatch.setitem(sys.modules, "pyarrow", None)
    fake_command(run)
    assert ".[io]" in refused(capsys, "fake-command", "--side", "left")


def test_interrupt_gives_130(fake_command, capsys):
    def run(arguments):
        raise KeyboardInterrupt

    fake_command(run)
    assert cli.main(["fake-command", "--side", "left"]) == 130
    assert capsys.readouterr().err == "ddagr: interrupted.\n"


def test_interrupt_of_work_that_can_go_on_says_how(fake_command, capsys):
    def run(arguments):
        raise KeyboardInterrupt("the same command goes on from out.part")

    fake_command(run)
    assert cli.main(["fake-command", "--side", "left"]) == 130
    assert capsys.readouterr().err == "ddagr: interrupted; the same command goes on from out.part.\n"


@pytest.mark.parametrize(
    "bug", [ZeroDivisionError("x"), ValueError("x"), OSError("x"), ModuleNotFoundError(name="ddagr_gym.x")]
)
def test_bugs_keep_their_traceback(fake_command, bug):
    def run(arguments):
        raise bug

    fake_command(run)
    with pytest.raises(type(bug)):
        cli.main(["fake-command", "--side", "left"])


def test_reader_that_leaves_the_pipe_is_no_error():
    command = f"'{sys.executable}' -m ddagr_gym soils | head -n 1; exit 0"
    done = subprocess.run(["/bin/sh", "-c", command], capture_output=True, text=True)
    assert done.stdout.startswith("soil")
    assert done.stderr == ""


def test_soils_and_robots_show_their_presets(capsys):
    from ddagr_gym.presets import robot_names, soil_names

    for command, names in (("soils", soil_names()), ("robots", robot_names())):
        assert cli.main([command]) == 0
        listed = [line.split()[0] for line in capsys.readouterr().out.splitlines()[2:]]
        assert listed == list(names)
        assert cli.main([command, names[0]]) == 0
        assert "source" in capsys.readouterr().out
    assert "'thesis_a1'" in refused(capsys, "soils", "thesis_a")


def test_the_list_of_soils_says_how_strong_and_how_firm_they_are(capsys):
    """Thesis Table A.1: 13 degrees; (13.19 / b + 692) 0.01^0.5 kPa under a plate of b = 0.203 m."""
    assert cli.main(["soils"]) == 0
    row = next(line.split() for line in capsys.readouterr().out.splitlines() if line.startswith("thesis_a1"))
    assert row[1:5] == ["4.14", "13.0", "75.7", "6"]


def test_python_m_is_the_same_command(tmp_path: Path):
    done = subprocess.run(
        [sys.executable, "-m", "ddagr_gym", "robots", "no-such"],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
    )
    assert done.returncode == 2
    assert done.stderr.startswith("ddagr: unknown robot 'no-such'")
    assert "Traceback" not in done.stderr


FULL = """
import resource, sys
from ddagr_gym.cli import main
words = ["simulate", "--output", sys.argv[1]]
assert main(words) == 0
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
sys.exit(main(words))
"""
"""Writes a drive, and again where no file may be longer than 4 kB, as on a disk that fills."""


def test_a_disk_that_fills_is_one_sentence_and_keeps_the_file_of_before(tmp_path):
    pytest.importorskip("resource", reason="limits of POSIX")
    path = tmp_path / "drive.csv"
    done = subprocess.run([sys.executable, "-c", FULL, str(path)], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert f"ddagr: {path}: file too large: choose another path or make room." in done.stderr
    assert "Traceback" not in done.stderr
    assert path.stat().st_size > 4096
    assert [item.name for item in tmp_path.iterdir()] == ["drive.csv"]
