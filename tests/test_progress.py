"""Progress: a bar on a terminal, a line per ten percent elsewhere."""

from __future__ import annotations

import io
import re

import pytest

from ddagr_gym.progress import LinePrinter, Progress, counting


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def shown(stream: io.StringIO, total: int, steps: int = 1) -> str:
    with Progress(total, "simulating", stream=stream) as progress:
        while progress.done < total:
            progress.advance(steps)
    return stream.getvalue()


def test_ten_lines_without_a_terminal():
    lines = shown(io.StringIO(), 1000).splitlines()
    assert [int(re.match(r"simulating: (\d+) %", line).group(1)) for line in lines] == list(range(10, 101, 10))
    assert lines[-1].startswith("simulating: 100 % (1000/1000, ")
    assert "left" in lines[0]
    assert "left" not in lines[-1]


def test_few_steps_give_a_line_each():
    assert len(shown(io.StringIO(), 3).splitlines()) == 3


def test_terminal_shows_one_line_that_ends_full():
    text = shown(Terminal(), 500, 7)
    assert text.count("\n") == 1
    assert text.endswith("\n")
    last = text.rstrip("\n").rsplit("\r", 1)[1]
    assert last.startswith(f"simulating [{'#' * 30}] 100 % (500/500")


def test_terminal_draws_are_rationed():
    assert shown(Terminal(), 100_000).count("\r") < 100


def test_never_an_escape_sequence():
    assert "\x1b" not in shown(Terminal(), 50) + shown(io.StringIO(), 50)


def test_an_interrupted_bar_keeps_its_state():
    stream = Terminal()
    with pytest.raises(RuntimeError), Progress(10, "x", stream=stream) as progress:
        progress.advance(4)
        raise RuntimeError
    assert stream.getvalue().rsplit("\r", 1)[1].startswith(f"x [{'#' * 12}{'.' * 18}] 40 %")


def test_no_steps_are_a_bug():
    with pytest.raises(ValueError, match="total is 0"):
        Progress(0, "x")


def counted(progress, total: int = 2) -> None:
    with counting(total, "drawing", progress) as steps:
        for _ in range(total):
            steps.advance()


def test_a_callable_is_given_one_line_at_a_time():
    lines: list[str] = []
    counted(lines.append)
    assert [line.split(" (")[0] for line in lines] == ["drawing: 50 %", "drawing: 100 %"]
    assert not any("\n" in line for line in lines)


def test_nobody_who_listens_sees_nothing(capsys):
    counted(None)
    assert capsys.readouterr() == ("", "")


def test_a_printer_of_lines_has_a_bar_on_its_terminal_and_lines_elsewhere():
    terminal, file = Terminal(), io.StringIO()
    for stream in (terminal, file):
        printer = LinePrinter("ddagr: ", stream=stream)
        printer("begun")
        counted(printer)
    assert terminal.getvalue().startswith("ddagr: begun\n\rdrawing [")
    assert file.getvalue().splitlines()[:2][0] == "ddagr: begun"
    assert file.getvalue().splitlines()[1].startswith("drawing: 50 %")
