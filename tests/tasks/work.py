"""Functions for tasks; workers import them by name."""

from __future__ import annotations

import os
import signal
import threading
import time
from pathlib import Path

import numpy as np

from ddagr_gym.errors import InputError


def numbers(seed, size=200):
    """Numbers whose last bits depend on the order of operations."""
    drawn = np.random.default_rng(seed).standard_normal((size, size))
    return [float(x) for x in np.linalg.solve(drawn @ drawn.T + np.eye(size), drawn[0])[:8]]


def mean_of(values, number):
    return float(np.mean(values[number:]))


def text_of(path):
    return path.read_text()


def texts_of(folder):
    return {path.name: path.read_text() for path in folder.iterdir()}


def process():
    return os.getpid()


def raises(number):
    if number == 2:
        raise ZeroDivisionError("a wheel of radius 0")
    return number


def refuses(number):
    raise InputError(f"drive {number} has no clock: give one.")


def sleeps(seconds):
    time.sleep(seconds)
    return seconds


def sleeps_and_marks(folder, number, seconds):
    time.sleep(seconds)
    with open(Path(folder) / f"{number}.txt", "a") as file:
        file.write("driven\n")
    return number


def dies_once(folder, number):
    """Kills its worker the first time, for one of the numbers."""
    mark = Path(folder) / "died"
    if number == 3 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def dies(number):
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def takes_memory(megabytes):
    return int(np.ones(megabytes * 2**17).sum())


def unpicklable():
    return threading.Lock()
