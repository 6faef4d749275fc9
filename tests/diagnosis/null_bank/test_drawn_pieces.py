"""Null runs copy pieces of recordings, so that long recordings do not make long banks."""

from __future__ import annotations

import numpy as np

from ddagr_gym.diagnosis.null_bank.bank import NullBank
from ddagr_gym.diagnosis.null_bank.drives import DRIVES, drawn_pieces, drawn_templates
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording

ROBOT, SOIL = get_robot("warthog"), get_soil("firm_ground")
PERIOD = 0.05


def drive(seconds: float, still: float = 0.0, seed: int = 0) -> Recording:
    """A drive whose robot stands still at first [s], with a noisy gyro."""
    count = int(seconds / PERIOD)
    t = PERIOD * np.arange(1, count + 1)
    columns = {name: np.where(t > still, 1.0 + 0.01 * t, 0.0) for name in ("command_right", "command_left")}
    columns |= {"t": t, "yaw_rate": 0.02 * np.random.default_rng(seed).standard_normal(count)}
    return Recording.from_columns(columns, ROBOT, source=f"run_{seed}")


def test_every_run_has_three_pieces_of_its_own() -> None:
    recordings = [drive(600.0), drive(300.0, seed=1)]
    runs = drawn_pieces(recordings, 60.0, 40, seed=5)
    assert len(runs) == 40
    assert {len(pieces) for pieces in runs} == {DRIVES}
    assert {len(piece) for pieces in runs for piece in pieces} == {1200}
    begins = [tuple((piece.meta.source, piece.meta.start_time) for piece in pieces) for pieces in runs]
    assert len({begin for run in begins for begin in run}) == 15
    assert all(len(set(run)) == DRIVES for run in begins)
    assert len(set(begins)) > 30


def test_short_recordings_are_taken_as_they_are() -> None:
    recordings = [drive(60.0), drive(25.0, seed=1)]
    for pieces in drawn_pieces(recordings, 60.0, 20, seed=0):
        assert [len(piece) for piece in pieces] == [1200, 500]
        np.testing.assert_array_equal(pieces[1]["yaw_rate"], recordings[1]["yaw_rate"])


def test_pieces_in_which_the_robot_stands_are_left_out() -> None:
    runs = drawn_pieces([drive(400.0, still=130.0)], 60.0, 20, seed=0)
    assert all(piece.meta.start_time > 110.0 for pieces in runs for piece in pieces)
    standing = drawn_pieces([drive(120.0, still=1000.0)], 60.0, 20, seed=0)
    assert {len(pieces) for pieces in standing} == {2}


def test_the_same_seed_draws_the_same_pieces_and_another_makes_another_bank() -> None:
    recordings = [drive(600.0)]

    def key(seed: int) -> str:
        drawn = drawn_templates(recordings, ROBOT.outer_radius, 60.0, 20, seed)
        return NullBank(ROBOT, SOIL, Setting(), drawn, 0).key()

    assert key(0) == key(0)
    assert key(0) != key(1)


def test_noise_is_that_of_whole_recordings() -> None:
    """Each piece alone says less about it, and would give every run noise of its own."""
    templates = drawn_templates([drive(600.0)], ROBOT.outer_radius, 60.0, 20, 0)
    assert len({template.noise for template in templates}) == 1
    gyro = templates[0].noise[2]
    assert gyro is not None
    assert abs(gyro.sigma / 0.02 - 1.0) < 0.1
