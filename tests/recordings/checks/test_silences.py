"""Nothing is joined across a silence of a sensor while the robot drives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.recordings.checks.signals import filled, integral, standstills
from ddagr_gym.recordings.checks.silences import heard_rows, heard_spans
from ddagr_gym.recordings.schema import FloatArray, Recording

PERIOD = 0.05
COUNT = 1200
ROW = np.arange(COUNT)


def drive(changes: Mapping[str, FloatArray] | None = None, spans: list[tuple[int, int]] | None = None) -> Recording:
    """A minute of driving ahead with a steady turn."""
    columns = {name: np.full(COUNT, 2.0) for name in ("command_right", "command_left", "encoder_right", "encoder_left")}
    columns |= {"yaw_rate": np.full(COUNT, 0.5), "t": PERIOD * ROW, **(changes or {})}
    return Recording.from_columns(columns, spans=spans)


def with_hole(name: str, first: int, stop: int, recording: Recording | None = None) -> Recording:
    recording = recording or drive()
    values = np.where((first <= ROW) & (stop > ROW), np.nan, recording[name])
    return replace(recording, channels={**recording.channels, name: values})


def spans_of(recording: Recording) -> list[tuple[int, int]]:
    return [(span.start, span.stop) for span in heard_spans(recording)]


@pytest.mark.parametrize("name", ["yaw_rate", "encoder_left"])
def test_a_silence_while_driving_cuts_a_span(name: str) -> None:
    recording = with_hole(name, 400, 500)
    assert spans_of(recording) == [(0, 400), (500, COUNT)]
    assert not heard_rows(recording)[400:500].any()
    assert heard_rows(recording).sum() == COUNT - 100


def test_short_waits_and_both_ends_cut_nothing() -> None:
    for first, stop in ((400, 435), (0, 200), (900, COUNT)):
        assert spans_of(with_hole("yaw_rate", first, stop)) == [(0, COUNT)]


def test_slow_sensors_have_longer_waits() -> None:
    """Twelve of a channel's own periods are no silence."""
    slow = np.where(ROW % 10 == 0, 0.5, np.nan)
    assert spans_of(with_hole("yaw_rate", 401, 500, drive({"yaw_rate": slow}))) == [(0, COUNT)]
    assert spans_of(with_hole("yaw_rate", 401, 540, drive({"yaw_rate": slow}))) == [(0, 401), (540, COUNT)]


def test_encoders_that_report_changes_only_are_no_silence_while_the_robot_stands() -> None:
    stands = (ROW >= 400) & (ROW < 700)
    still = {name: np.where(stands, 0.0, 2.0) for name in ("command_right", "command_left")}
    encoders = {f"encoder_{bank}": np.where(stands & (ROW > 405), np.nan, np.where(stands, 0.0, 2.0)) for bank in
                ("right", "left")}  # fmt: skip
    recording = drive({**still, **encoders})
    assert spans_of(recording) == [(0, COUNT)]
    assert [(piece.start, piece.stop) for piece in standstills(recording)] == [(410, 690)]


def test_the_length_of_waits_is_that_of_the_whole_drive() -> None:
    """A short span with hardly any sample says nothing about how often they come."""
    spans = [(k, k + 120) for k in range(0, COUNT, 120)]
    recording = with_hole("encoder_right", 361, 470, drive(spans=spans))
    assert [span for span in spans_of(recording) if 360 <= span[0] < 480] == [(360, 361), (470, 480)]


def test_readings_and_integrals_begin_anew_after_a_silence() -> None:
    recording = with_hole("yaw_rate", 400, 500)
    turned = integral(recording, recording["yaw_rate"])
    assert turned[399] == pytest.approx(0.5 * PERIOD * 399)
    assert np.isnan(turned[400:500]).all()
    assert turned[500] == 0.0
    assert np.isnan(filled(recording, "yaw_rate")[400:500]).all()


def test_a_robot_that_nobody_heard_stopping_does_not_stand() -> None:
    """Commanded to stop in a silence of the encoders, it still rolls."""
    rolls = (ROW >= 500) & (ROW < 560)
    commands = {name: np.where(rolls, 0.0, 2.0) for name in ("command_right", "command_left")}
    recording = drive(commands)
    for name in ("encoder_right", "encoder_left"):
        recording = with_hole(name, 400, 560, recording)
    assert standstills(recording) == []


def test_a_channel_that_reports_changes_only_has_no_silences() -> None:
    changes = np.where(ROW % 120 < 3, 2.0 + 0.1 * (ROW // 120), np.nan)
    assert spans_of(drive({"encoder_right": changes})) == [(0, COUNT)]
