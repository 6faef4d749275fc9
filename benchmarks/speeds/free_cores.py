"""Whether a second core is really free: on shared machines it may be half of the first one for minutes.

The control takes the same work as what is measured, but done by two threads that share nothing. Where these two take
longer than one of them alone, no program can have two cores, and what was measured beside says nothing of the program.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from benchmarks.speeds.timing import Contestant, turn
from ddagr_gym.physics import layout
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import Simulator

FREE = 0.95
"""Least part of a second core that counts as all of it."""


class SecondCore:
    """Measures how much of a second core there is at the moment.

    Args:
        count: robots that each of the two threads drives.
        samples: of a measurement, about 3 us each and robot.
    """

    def __init__(self, count: int = 16, samples: int = 200) -> None:
        robot = get_robot("ddagr")
        self._simulators = [Simulator(count), Simulator(count)]
        for simulator in self._simulators:
            for n in range(count):
                simulator.configure(n, robot, get_soil("thesis_a1"))
            simulator.reset()
        self._noise = np.zeros((count, samples, layout.NOISE_CHANNELS))
        self._commands = np.tile([1.0, 1.5], (count, 1, 1))
        self._helper = ThreadPoolExecutor(1)

    def _drive(self, which: int) -> None:
        count, samples = self._noise.shape[:2]
        readings, record = np.empty((count, samples, len(layout.READINGS))), np.empty((count, samples, 0))
        none = np.zeros(0, dtype=np.int64)
        self._simulators[which].advance(self._commands, self._noise, none, readings, record)

    def measure(self) -> float:
        """Time that one thread takes alone over that of two threads with twice the work: 1 with two free cores."""
        start = time.perf_counter()
        self._drive(0)
        alone = time.perf_counter()
        other = self._helper.submit(self._drive, 1)
        self._drive(0)
        other.result()
        return (alone - start) / (time.perf_counter() - alone)


def turns_beside_control(one: Contestant, two: Contestant, turns: int, most: int) -> dict[str, Any]:
    """Let two contestants take turns, with the control before and after each pair of turns.

    Args:
        one: with one thread.
        two: with two.
        turns: with two free cores that are wanted.
        most: turns of each, after which no more are made.

    Returns:
        Gain by the wall clock: all of them, and which were made with two free cores: ``gain`` (turns,), ``free``
        (turns,) and what the control said, ``second_core`` (turns,).
    """
    control = SecondCore()
    gains: list[float] = []
    seconds: list[float] = []
    for contestant in (one, two):
        turn(contestant)
    while len(gains) < most and sum(s >= FREE for s in seconds) < turns:
        pair = (one, two) if len(gains) % 2 else (two, one)
        before = control.measure()
        rates = {contestant.name: turn(contestant)[1] for contestant in pair}
        seconds.append(min(before, control.measure()))
        gains.append(rates[two.name] / rates[one.name])
    found = np.array(seconds)
    return {"gain": np.array(gains), "free": found >= FREE, "second_core": found}
