"""Entries of an observation have the same names and order wherever they are named."""

from __future__ import annotations

import pytest

from ddagr_gym.control import observation as layout


@pytest.mark.parametrize(
    ("named", "entries"),
    [
        (layout.TurnObservation, layout.OBSERVATION),
        (layout.TurnColumns, layout.OBSERVATION),
        (layout.FilterColumns, layout.EKF_FEATURES),
        (layout.PathColumns, layout.PATH_FEATURES),
    ],
)
def test_names_are_those_of_the_layout(named, entries):
    assert named._fields == tuple(name for name, _, _ in entries)


def test_soil_of_a_filter_is_four_logs_and_their_deviations():
    known = layout.FilterColumns(*(name for name, _, _ in layout.EKF_FEATURES))
    assert all(name.startswith("log_") for name in known.log_soil)
    assert known.deviations == tuple(f"deviation_{name}" for name in known.log_soil)
