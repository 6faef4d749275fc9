"""Degrees and milliseconds that the heading and the gyro tell together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.recordings.heading_units import near, times_gyro
from ddagr_gym.recordings.schema import Recording

T = np.arange(0.0, 60.0, 0.02)
YAW = 0.8 * np.sin(0.5 * T)
"""A weave between -46 and 46 degrees."""


def weave(heading, rate, every=10):
    heading = np.where(np.arange(T.size) % every, np.nan, heading)
    return Recording.from_columns({"t": T, "yaw_rate": rate, "pose_yaw": heading})


def said(recording):
    return [sentence for sentence in recording.validate() if "holds no samples" not in sentence]


@pytest.mark.parametrize("every", [1, 10, 50])
@pytest.mark.parametrize("gyro", [1.0, 1.3, -0.8])
@pytest.mark.parametrize("wrapped", [lambda yaw: yaw, lambda yaw: (yaw + 180) % 360 - 180, lambda yaw: 90.0 - yaw])
def test_degrees_are_recognised_without_a_jump(wrapped, gyro, every):
    degrees = wrapped(np.degrees(YAW))
    (sentence,) = said(weave(degrees, gyro * 0.4 * np.cos(0.5 * T), every=every))
    assert sentence.endswith("times as much as the gyro turns: degrees? Say unit: deg in the map.")


@pytest.mark.parametrize(
    "heading",
    [YAW, np.pi / 2 - YAW, (3 * YAW + np.pi) % (2 * np.pi) - np.pi, 20.0 + YAW, np.where(T < 30, YAW, np.nan)],
)
@pytest.mark.parametrize("scale", [1.0, 0.3, 3.0, 0.0])
def test_radians_are_not_doubted_whatever_the_scale_of_the_gyro(heading, scale):
    assert said(weave(heading, scale * 0.4 * np.cos(0.5 * T))) == []


def test_degrees_are_recognised_on_many_rounds():
    assert "degrees?" in said(weave(np.degrees(0.2 * T), np.full(T.size, 0.2)))[0]


@pytest.mark.parametrize("rate", [1000, 4000])
def test_milliseconds_of_fast_rows_are_recognised(rate):
    t = np.arange(0.0, 30.0, 1 / rate)
    columns = {"t": 1e3 * t, "yaw_rate": 0.4 * np.cos(0.5 * t)}
    columns["pose_yaw"] = np.where(np.arange(t.size) % (rate // 5), np.nan, 0.8 * np.sin(0.5 * t))
    (sentence,) = said(Recording.from_columns(columns))
    assert "say unit: ms under time" in sentence
    assert said(Recording.from_columns({**columns, "t": t})) == []


@pytest.mark.parametrize("turn", [0.0, 0.1, 0.5, 1.0, 2.0])
def test_logs_of_one_row_a_second_are_no_milliseconds(turn):
    t = np.arange(7200.0)
    yaw = (turn * t + 0.5 * np.sin(0.1 * t) + np.pi) % (2 * np.pi) - np.pi
    assert said(Recording.from_columns({"t": t, "yaw_rate": turn + 0.05 * np.cos(0.1 * t), "pose_yaw": yaw})) == []


def test_a_straight_or_short_drive_tells_no_ratio(make_drive):
    drive = make_drive()
    assert times_gyro(drive.t, drive["pose_yaw"], drive["yaw_rate"], drive.spans()) == pytest.approx(1.0, abs=0.05)
    assert said(
        replace(drive, channels={k: np.degrees(v) if k == "pose_yaw" else v for k, v in drive.channels.items()})
    )
    ratio = times_gyro(drive.t, drive["pose_yaw"], 0.0 * drive["yaw_rate"], drive.spans())
    assert np.isnan(ratio)
    assert not near(ratio, 57.3)
    assert np.isnan(times_gyro(np.empty(0), np.empty(0), np.empty(0), []))
