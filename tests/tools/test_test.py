"""``ddagr test`` itself: what it counts, and that a failure of any check is a failure."""

from __future__ import annotations

import sys
import time
from threading import Event

import pytest

from tools import test as command
from tools.test import Arguments, Outcome

MIXED = """
import pytest

def test_passes(): pass

def test_fails(): assert False

@pytest.fixture
def broken(): raise RuntimeError

def test_error(broken): pass

@pytest.mark.skip
def test_skipped(): pass
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    return tmp_path


def pytest_on(folder, source: str, **options) -> Outcome:
    (folder / "test_it.py").write_text(source)
    return command._pytest([sys.executable], folder, "-p", "no:cacheprovider", **options)


def test_pytest_is_counted(folder):
    assert pytest_on(folder, MIXED) == Outcome(passed=1, failed=2, skipped=1)
    assert pytest_on(folder, "def test_passes(): pass") == Outcome(passed=1)


def test_collection_errors_and_empty_selections_fail(folder):
    assert pytest_on(folder, "import no_such_module").failed == 1
    assert pytest_on(folder, "").failed == 1
    assert pytest_on(folder, "", may_be_empty=True) == Outcome()


def test_a_failing_tool_is_counted(tmp_path):
    assert command._tool("it", tmp_path, "-c", "pass") == Outcome(passed=1)
    assert command._tool("it", tmp_path, "-c", "raise SystemExit(3)") == Outcome(failed=1)


def test_what_a_tool_says_is_printed_whole(tmp_path, capsys):
    command._tool("it", tmp_path, "-c", "import sys; print('found'); sys.exit('one error')")
    assert sorted(capsys.readouterr().out.splitlines()) == ["", "==== it says", "found", "one error"]


@pytest.mark.parametrize(("failing", "code"), [(None, 0), ("types", 1), ("wheel", 1)])
def test_summary_and_exit_code(monkeypatch, capsys, failing, code):
    names = ("lint", "format", "types", "contracts", "tests", "wheel")
    ran = []

    def check(name):
        ran.append(name)
        return Outcome(failed=1) if name == failing else Outcome(passed=2, skipped=1)

    monkeypatch.setattr(command, "_checks", lambda *_: {name: (lambda name=name: check(name)) for name in names})
    assert command.run(Arguments()) == code
    assert sorted(ran) == sorted(names)
    last = capsys.readouterr().out.splitlines()[-1]
    assert last == ("12 passed, 0 failed" if failing is None else "10 passed, 1 failed")


@pytest.mark.parametrize(("workers", "together"), [(2, True), (1, False)])
def test_the_wheel_is_checked_beside_the_tests(monkeypatch, workers, together):
    begun, met = Event(), []
    checks = {"tests": lambda: met.append(begun.wait(30.0 if together else 0.1)) or Outcome(passed=1)}
    checks["wheel"] = lambda: begun.set() or Outcome(passed=1)
    monkeypatch.setattr(command, "_checks", lambda *_: checks)
    assert command.run(Arguments(workers=workers)) == 0
    assert met == [together]


def test_an_interrupt_begins_nothing_more(monkeypatch):
    begun, ran = Event(), []

    def interrupted():
        assert begun.wait(30.0)
        raise KeyboardInterrupt

    def wheel():
        begun.set()
        time.sleep(0.2)
        return Outcome(passed=1)

    checks = {"tests": interrupted, "wheel": wheel}
    checks |= {name: (lambda name=name: ran.append(name) or Outcome(passed=1)) for name in ("types", "docs")}
    monkeypatch.setattr(command, "_checks", lambda *_: checks)
    with pytest.raises(KeyboardInterrupt):
        command.run(Arguments())
    assert ran == []


def test_selections(monkeypatch, capsys):
    ran = []
    names = ("lint", "types", "tests")
    monkeypatch.setattr(
        command,
        "_checks",
        lambda *_: {name: (lambda name=name: ran.append(name) or Outcome(passed=1)) for name in names},
    )
    command.run(Arguments(only="types"))
    command.run(Arguments(slow=True))
    assert ran == ["types", "tests"]
