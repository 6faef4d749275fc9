"""Refusals that several functions share."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from ddagr_gym.errors import InputError, at_least


@pytest.mark.parametrize(
    ("given", "least", "reason"),
    [
        (-1, 0, "seed is -1: give at least 0."),
        (0.5, 1.0, "seed is 0.5: give at least 1.0."),
        (1.5, 0, "seed is 1.5: give a whole number of at least 0."),
        (2.0, 0, "seed is 2.0: give a whole number of at least 0."),
        (math.inf, 0, "seed is inf: give a whole number of at least 0."),
        (True, 0, "seed is True: give a whole number of at least 0."),
        (True, 1.0, "seed is True: give a finite number of at least 1.0."),
        ("2", 0, "seed is '2': give a whole number of at least 0."),
        (math.inf, 1.0, "seed is inf: give a finite number of at least 1.0."),
        (math.nan, 1.0, "seed is nan: give a finite number of at least 1.0."),
    ],
)
def test_what_is_no_such_number_is_refused(given, least, reason):
    with pytest.raises(InputError, match=f"^{re.escape(reason)}$"):
        at_least(seed=(given, least))


@pytest.mark.parametrize(
    ("given", "least"),
    [(None, 0), (0, 0), (np.int64(3), 0), (np.uint8(3), 1), (1, 1.0), (1.5, 1.0), (np.float32(1.5), 1.0)],
)
def test_a_number_that_is_large_enough_passes(given, least):
    at_least(seed=(given, least))
