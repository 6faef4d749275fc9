"""Steps with clocks of their own: which of them go on where the one before ended."""

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.presets import get_robot
from ddagr_gym.recordings.continued import rows_by_segment
from ddagr_gym.recordings.schema import Recording

LENGTH = 40


def steps(*pieces: tuple[tuple[float, float], tuple[float, float]]) -> Recording:
    """Spans of LENGTH rows at 20 Hz, each with a command and the speed of both banks (first, last)."""
    count = LENGTH * len(pieces)
    command = np.concatenate([np.full(LENGTH, given) for (given, _), _ in pieces])
    speed = np.concatenate([np.linspace(first, last, LENGTH) for _, (first, last) in pieces])
    columns = {
        "t": 0.05 * np.arange(count), "command_right": command, "command_left": command, "encoder_right": speed,
        "encoder_left": np.where(np.arange(count) % 4 == 0, speed, np.nan),
    }  # fmt: skip
    made = Recording.from_columns(columns, get_robot("ddagr"))
    spans = tuple((k, k + LENGTH) for k in range(0, count, LENGTH))
    return replace(made, meta=replace(made.meta, spans=spans, segments=spans))


def test_rows_of_the_step_before_come_with_the_missing_sample() -> None:
    first, second, third = rows_by_segment(
        steps(((1.0, 1.0), (0.0, 1.0)), ((2.0, 2.0), (1.0, 2.0)), ((0.5, 0.5), (2.0, 0.5))), 100
    )
    assert not len(first.before)
    assert second.before.tolist() == [39, *range(39, -1, -1)]
    assert third.before.tolist() == [79, *range(79, 39, -1), 39, *range(39, -1, -1)]
    rows, known = second.at(np.array([-2, -1, 0, 38, 39, 40, 79, 90]))
    assert rows.tolist() == [0, 0, 1, 39, 39, 40, 79, 79]
    assert known.tolist() == [False, True, True, True, True, True, True, True]


def test_no_more_rows_are_kept_than_asked_for() -> None:
    *_, last = rows_by_segment(steps(*(((1.0, 1.0), (1.0, 1.0)) for _ in range(4))), 50)
    assert len(last.before) == 50
    assert last.before[[0, 1, 2, 41, 42]].tolist() == [119, 119, 118, 79, 79]


@pytest.mark.parametrize(("start", "goes_on"), [(2.05, True), (1.7, False), (2.4, False)])
def test_a_robot_that_was_stopped_in_between_did_not_go_on(start: float, goes_on: bool) -> None:
    _, second = rows_by_segment(steps(((2.0, 2.0), (2.0, 2.0)), ((1.0, 1.0), (start, 1.0))), 10)
    assert bool(len(second.before)) is goes_on


def test_commands_that_jump_and_then_change_are_of_another_drive() -> None:
    made = steps(((2.0, 2.0), (2.0, 2.0)), ((1.0, 1.0), (2.0, 1.0)))
    changing = made["command_right"].copy()
    changing[60:] = 1.5
    other = replace(made, channels={**made.channels, "command_right": changing})
    assert [len(rows.before) for rows in rows_by_segment(other, 10)] == [0, 0]
    changing[40:60] = 2.0
    carried = replace(other, channels={**made.channels, "command_right": changing, "command_left": changing})
    assert [len(rows.before) for rows in rows_by_segment(carried, 10)] == [0, 10]


def test_a_gap_in_one_clock_is_a_gap() -> None:
    made = steps(((2.0, 2.0), (2.0, 2.0)), ((2.0, 2.0), (2.0, 2.0)))
    one = replace(made, meta=replace(made.meta, spans=((0, 80),)))
    assert [len(rows.before) for rows in rows_by_segment(one, 10)] == [0, 0]


def test_without_wheel_speeds_nothing_is_known_to_go_on() -> None:
    made = steps(((2.0, 2.0), (2.0, 2.0)), ((2.0, 2.0), (2.0, 2.0)))
    bare = replace(made, channels={n: v for n, v in made.channels.items() if not n.startswith("encoder")})
    assert [len(rows.before) for rows in rows_by_segment(bare, 10)] == [0, 0]
