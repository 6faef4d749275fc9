"""``./ddagr test``: everything that continuous integration runs."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree

from ddagr_gym.errors import InputError
from tools import CHECKOUT, wheel

EXAMPLES = (
    "ddagr test",
    "ddagr test --slow",
    "ddagr test --only types",
    "ddagr test --paths tests/test_config.py",
)

# named at the end, so that one sees what a run's time goes into
_SLOWEST = ("--durations=20", "--durations-min=10")
# These take one processor each, one after another beside the tests: none is idle while the last of them ends.
_BESIDE = ("wheel", "types", "docs")
# pytest's exit code when a selection holds no test
_NOTHING_SELECTED = 5

# A file's tests stay in one process: what its fixtures make is made once. In the order of the files: sorted by their
# number of tests, those with few that take long would come last.
_SHARED_OUT = ("--dist", "loadfile", "--no-loadscope-reorder")

# import-linter has no module to run with -m
_LINT_IMPORTS = """
import sys
from importlinter.cli import lint_imports

sys.path.insert(0, ".")
sys.exit(lint_imports(no_logo=True))
"""


@dataclass(frozen=True)
class Arguments:
    """Run everything that continuous integration runs.

    Lint, format, import contracts and tests (all but the slow ones); beside them, one after another, the tests of the
    wheel installed in an environment of its own outside the checkout, types, and the documentation site with broken
    links as errors. What those have to say is printed when they end. The exit code is 1 when anything failed.

    Attributes:
        slow: run the tests marked slow instead of everything else.
        workers: processes that share the tests; with one, nothing is run beside them.
        only: one check instead of all.
        paths: test files or folders instead of all tests; nothing but tests is run then.
    """

    slow: bool = False
    workers: int = 2
    only: Literal["all", "lint", "format", "types", "contracts", "tests", "docs", "wheel"] = "all"
    paths: tuple[Path, ...] = ()


@dataclass(frozen=True)
class Outcome:
    """What a check came to: how many of its parts passed, failed and were skipped."""

    passed: int = 0
    failed: int = 0
    skipped: int = 0


def run(arguments: Arguments) -> int:
    """Run the checks, print a summary that ends with ``N passed, N failed``, and return the exit code."""
    if arguments.workers < 1:
        raise InputError(f"--workers is {arguments.workers}: give 1 or more.")
    checks = _checks(CHECKOUT, arguments)
    selected = checks if arguments.only == "all" else {arguments.only: checks[arguments.only]}
    if arguments.slow or arguments.paths:
        selected = {"tests": checks["tests"]}
    beside = {name: check for name, check in selected.items() if name in _BESIDE and arguments.workers > 1}
    with ThreadPoolExecutor(1) as pool:
        begun = {name: pool.submit(_timed, name, check) for name, check in beside.items()}
        try:
            alone = {name: _timed(name, check) for name, check in selected.items() if name not in beside}
            outcomes = alone | {name: future.result() for name, future in begun.items()}
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    _print_summary(outcomes)
    return 1 if any(outcome.failed for outcome, _ in outcomes.values()) else 0


def _timed(name: str, check: Callable[[], Outcome]) -> tuple[Outcome, float]:
    print(f"\n==== {name} begins", flush=True)
    start = time.monotonic()
    return check(), time.monotonic() - start


def _checks(root: Path, arguments: Arguments) -> dict[str, Callable[[], Outcome]]:
    return {
        "lint": lambda: _tool("lint", root, "-m", "ruff", "check", "."),
        "format": lambda: _tool("format", root, "-m", "ruff", "format", "--check", "."),
        "contracts": lambda: _tool("contracts", root, "-c", _LINT_IMPORTS),
        "tests": lambda: _tests(root, arguments),
        "wheel": lambda: _installed_wheel(root),
        "types": lambda: _tool("types", root, "-m", "mypy"),
        "docs": lambda: _site(root),
    }


def _site(root: Path) -> Outcome:
    """Build the documentation site into a folder that is thrown away."""
    with tempfile.TemporaryDirectory(prefix="ddagr-site-") as temporary:
        return _tool("docs", root, "-m", "tools", "docs", "--output", temporary)


def _tool(name: str, root: Path, *words: str) -> Outcome:
    command = [sys.executable, *words]
    return Outcome(passed=1) if _printed_whole(name, command, root) == 0 else Outcome(failed=1)


def _printed_whole(name: str, command: list[str], folder: Path) -> int:
    """Exit code of a command, whose output is printed when it ends: others print at the same time."""
    done = subprocess.run(
        command, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    if done.stdout:
        print(f"\n==== {name} says\n{done.stdout}", end="", flush=True)
    return done.returncode


def _tests(root: Path, arguments: Arguments) -> Outcome:
    paths = [str(path.resolve()) for path in arguments.paths]
    marker = "slow" if arguments.slow else "not slow"
    parallel = ["-n", str(arguments.workers), *_SHARED_OUT] if arguments.workers > 1 else []
    return _pytest([sys.executable], root, "-m", marker, *parallel, *paths, may_be_empty=arguments.slow)


def _pytest(python: list[str], folder: Path, *words: str, may_be_empty: bool = False, beside: str = "") -> Outcome:
    with tempfile.TemporaryDirectory(prefix="ddagr-test-") as temporary:
        report = Path(temporary) / "report.xml"
        command = [*python, "-m", "pytest", "-q", *_SLOWEST, f"--junitxml={report}", *words]
        if beside:
            code = _printed_whole(beside, command, folder)
        else:
            code = subprocess.run(command, cwd=folder, stdin=subprocess.DEVNULL).returncode
        if code == _NOTHING_SELECTED and may_be_empty:
            return Outcome()
        outcome = _read_report(report) if report.is_file() else Outcome(failed=1)
    # pytest can end with an error after all tests passed (a plugin, a collection error).
    return Outcome(outcome.passed, 1, outcome.skipped) if code and not outcome.failed else outcome


def _read_report(report: Path) -> Outcome:
    suites = ElementTree.parse(report).getroot().iter("testsuite")
    counts = [{k: int(suite.get(k, 0)) for k in ("tests", "failures", "errors", "skipped")} for suite in suites]
    total, failures, errors, skipped = (sum(c[k] for c in counts) for k in ("tests", "failures", "errors", "skipped"))
    failed = failures + errors
    return Outcome(passed=total - failed - skipped, failed=failed, skipped=skipped)


def _installed_wheel(root: Path) -> Outcome:
    """Build the wheel, install it with its core dependencies outside the checkout, and run tests/installed on it."""
    with tempfile.TemporaryDirectory(prefix="ddagr-wheel-") as temporary:
        folder = Path(temporary).resolve()
        try:
            python = wheel.install(root, folder)
        except subprocess.CalledProcessError as error:
            print(f"{error.stdout}{' '.join(error.cmd)} ended with exit code {error.returncode}.", file=sys.stderr)
            return Outcome(failed=1)
        tests = wheel.copy_tests(root, folder)
        environment = ["env", "-u", "PYTHONPATH", str(python), "-P"]
        return _pytest(environment, tests, "-p", "no:cacheprovider", "--import-mode=importlib", ".", beside="wheel")


def _print_summary(outcomes: dict[str, tuple[Outcome, float]]) -> None:
    print("\n==== summary")
    for name, (outcome, seconds) in outcomes.items():
        verdict = "FAILED" if outcome.failed else "ok"
        skipped = f", {outcome.skipped} skipped" if outcome.skipped else ""
        counts = f"{outcome.passed} passed, {outcome.failed} failed{skipped}"
        print(f"{name:<10} {verdict:<7} {seconds:6.1f} s  {counts}")
    passed = sum(outcome.passed for outcome, _ in outcomes.values())
    failed = sum(outcome.failed for outcome, _ in outcomes.values())
    print(f"{passed} passed, {failed} failed", flush=True)
