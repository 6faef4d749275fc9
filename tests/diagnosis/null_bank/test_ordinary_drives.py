"""Ordinary drives are cut into pieces with enough commands that the robot received."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.diagnosis.null_bank.ordinary_drives import longer_runs, pieces_of
from ddagr_gym.presets import get_robot
from ddagr_gym.recordings.schema import Recording

PERIOD = 0.05


def drive(valid: np.ndarray, segments: list[tuple[int, int]] | None = None) -> Recording:
    count = len(valid)
    columns = {name: np.linspace(0.0, 1.0, count) for name in ("command_right", "command_left", "yaw_rate")}
    columns["t"] = PERIOD * np.arange(1, count + 1)
    return Recording.from_columns(columns, get_robot("warthog"), command_valid=valid, segments=segments)


def seconds_of_commands(piece: Recording) -> float:
    return float(piece.command_valid.sum()) * PERIOD


def test_a_long_drive_is_cut_by_the_time_of_its_commands():
    valid = np.arange(6000) % 100 < 40  # 120 of 300 s
    pieces = pieces_of(drive(valid), 50.0)
    assert [seconds_of_commands(piece) for piece in pieces] == pytest.approx([50.0, 50.0], abs=0.1)
    pieces = pieces_of(drive(valid), 40.0)
    assert [seconds_of_commands(piece) for piece in pieces] == pytest.approx([40.0, 40.0, 40.0], abs=0.1)


@pytest.mark.parametrize(("period", "length"), [(0.02, 20.0), (0.01, 30.0), (0.05, 20.02)])
def test_rounding_joins_no_pieces(period, length):
    """Sums of periods lie a little beside whole seconds."""
    count = int(400.0 / period)
    columns = {name: np.linspace(0.0, 1.0, count) for name in ("command_right", "command_left")}
    recording = Recording.from_columns({"t": period * np.arange(count), **columns}, get_robot("warthog"))
    pieces = pieces_of(recording, length)
    assert [len(piece) * period for piece in pieces[:-1]] == pytest.approx([length] * (len(pieces) - 1), abs=period)


def test_segments_stay_whole():
    segments = [(k * 120, (k + 1) * 120) for k in range(20)]  # 6 s each
    pieces = pieces_of(drive(np.ones(2400, dtype=bool), segments), 20.0)
    assert [len(piece) for piece in pieces] == [480] * 5
    assert all(len(piece.meta.segments) == 4 for piece in pieces)


def test_time_of_every_piece_begins_at_zero():
    pieces = pieces_of(drive(np.ones(2400, dtype=bool)), 40.0)
    assert [piece.t[0] for piece in pieces] == [0.0, 0.0, 0.0]
    assert [piece.meta.start_time for piece in pieces] == pytest.approx([PERIOD, 40.0 + PERIOD, 80.0 + PERIOD])
    np.testing.assert_allclose(pieces[1].t, PERIOD * np.arange(800), atol=1e-9)


def test_longer_runs_are_pieces_of_twice_the_length_and_the_drive():
    lengths = [len(run) * PERIOD for run in longer_runs(drive(np.ones(4800, dtype=bool)), 60.0)]
    assert lengths == pytest.approx([120.0] * 2 + [240.0], abs=0.1)


def test_what_is_a_piece_already_is_no_longer_run():
    assert longer_runs(drive(np.ones(1200, dtype=bool)), 60.0) == []
    segments = [(0, 2600), (2600, 5200)]  # 130 s each
    whole = drive(np.ones(5200, dtype=bool), segments)
    assert [len(piece) for piece in pieces_of(whole, 60.0)] == [2600, 2600]
    assert [len(run) for run in longer_runs(whole, 60.0)] == [5200]


def test_a_drive_without_commands_gives_nothing():
    assert pieces_of(drive(np.zeros(2000, dtype=bool)), 20.0) == []
