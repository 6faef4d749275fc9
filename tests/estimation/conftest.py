"""A robot for the filter's tests, the thesis's (Table 6.1), and a turn of it."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.envs.options import make_settings
from ddagr_gym.estimation import FilterModel, layout
from ddagr_gym.evaluation.controllers import find_controller
from ddagr_gym.evaluation.runs import drive_turn
from ddagr_gym.presets import get_robot


@pytest.fixture(scope="session")
def robot():
    return get_robot("ddagr")


@pytest.fixture(scope="session")
def model(robot):
    return FilterModel(robot)


@pytest.fixture(scope="session")
def driven():
    """Function (effects) -> a turn of the nominal robot by B6, which stands for 0.8 s first."""

    def drive(effects=()):
        settings = make_settings(randomisation=False, side="left", soil="thesis_a1", effects=effects)
        tracker = find_controller("B6", settings.draw(np.random.default_rng(0)).turn)
        return drive_turn(tracker, settings, 5)

    return drive


@pytest.fixture(scope="session")
def level(driven):
    """Such a turn on level ground."""
    return driven()


@pytest.fixture
def turning_state(model):
    """A state in mid-turn, and the initial covariance."""
    state, covariance = model.initial()
    state[:5] = [0.155, 0.004, 0.21, 1.19, 0.05]
    return state, covariance


@pytest.fixture
def rng():
    return np.random.default_rng(20240611)


@pytest.fixture(scope="session")
def load():
    """Function that puts a state and a covariance into a kernel workspace."""

    def fill(state, covariance=None):
        work = np.zeros(layout.WORK_SIZE)
        work[layout.X : layout.X + layout.STATE_SIZE] = state
        if covariance is not None:
            matrix(work, layout.P, layout.STATE_SIZE)[:] = covariance
        return work

    return fill


def matrix(work, first, rows):
    """View (rows, 12) of a matrix in a workspace."""
    size = rows * layout.STRIDE
    return work[first : first + size].reshape(rows, layout.STRIDE)[:, : layout.STATE_SIZE]


@pytest.fixture(scope="session")
def view():
    """Function that views a matrix of a workspace: (work, first, rows) -> (rows, 12)."""
    return matrix
