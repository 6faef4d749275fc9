"""Two checkouts side by side: turns, ratios, and what is refused."""

import subprocess
import sys

import numpy as np
import pytest

from benchmarks import two_checkouts


class Clocked:
    """A side whose turns take known times."""

    def __init__(self, times: list[float], order: list[str], name: str) -> None:
        self.times, self.order, self.name = iter(times), order, name

    def seconds(self, workload: str) -> float:
        self.order.append(self.name)
        return next(self.times)


def test_sides_take_turns_and_the_first_turn_does_not_count():
    order: list[str] = []
    here, there = Clocked([9.0, 2.0, 3.0], order, "here"), Clocked([1.0, 1.0, 2.0], order, "there")
    assert two_checkouts.ratios(here, there, "any", 2).tolist() == [2.0, 1.5]
    assert order == ["there", "here", "here", "there", "there", "here"]


def test_the_summary_has_median_and_quartiles():
    found = two_checkouts.summary(np.array([1.0, 2.0, 3.0, 4.0, 5.0]))
    assert found == {"median": 3.0, "quartiles": [2.0, 4.0], "turns": 5}


def test_a_side_works_in_its_checkout(monkeypatch):
    side = two_checkouts.Side(two_checkouts.CHECKOUT)
    assert side.seconds("one environment") > 0.0
    side.close()
    assert side.process.returncode == 0


@pytest.mark.parametrize(
    ("arguments", "said"), [(["."], "has no folder ddagr_gym"), ([str(two_checkouts.CHECKOUT), "--turns", "0"], "is 0")]
)
def test_what_cannot_be_compared_is_one_sentence(tmp_path, arguments, said):
    command = [sys.executable, two_checkouts.__file__, *arguments]
    environment = {"PYTHONPATH": str(two_checkouts.CHECKOUT)}
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env=environment)
    assert (done.returncode, "Traceback" in done.stderr) == (2, False)
    assert said in done.stderr
