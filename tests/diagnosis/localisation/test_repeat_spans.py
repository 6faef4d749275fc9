"""When a sensor was held: whole drives, stretches of them, and the time they cover."""

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.localisation.repeat_spans import where_readings_repeat
from ddagr_gym.diagnosis.preprocessing.repeated_readings import RepeatedReadings, find_repeated_readings
from ddagr_gym.recordings.schema import Recording

PERIOD, COUNT = 0.02, 2000


def drive(held: np.ndarray, channel: str = "yaw_rate", seed: int = 1) -> Recording:
    """40 s in which a channel repeats the reading before where ``held`` says so."""
    rng = np.random.default_rng(seed)
    t = PERIOD * np.arange(COUNT)
    columns = {"t": t, "command_right": np.sin(t), "command_left": np.cos(t)}
    for name in ("specific_force_x", "specific_force_y", "yaw_rate"):
        columns[name] = np.sin(3.0 * t) + 0.03 * rng.standard_normal(COUNT)
    source = np.where(held, 0, np.arange(COUNT))
    columns[channel] = columns[channel][np.maximum.accumulate(source)]
    return Recording.from_columns(columns)


def test_a_sensor_slower_than_the_log_is_held_everywhere() -> None:
    recordings = [drive(np.arange(COUNT) % 5 > 0)]
    found = where_readings_repeat(recordings, find_repeated_readings(recordings))
    assert found is not None
    assert len(found.spans) == 1
    assert found.time_share == pytest.approx(1.0, abs=0.01)
    assert found.spans[0].share == 1.0
    assert found.spans[0].size == pytest.approx(1.0, abs=0.05)
    assert found.phrase == "gyro: everywhere"


def test_freezes_are_found_where_they_are() -> None:
    """Two recordings; the second freezes for 12 s and for 3 s, but for a new reading every second."""
    held = np.zeros(COUNT, dtype=bool)
    held[501:1100] = held[1501:1650] = True
    held[::50] = False
    recordings = [drive(np.zeros(COUNT, dtype=bool)), drive(held, seed=2)]
    found = where_readings_repeat(recordings, (RepeatedReadings("gyro", 0.3, 0.3, 2000),))
    assert found is not None
    assert [span.recording for span in found.spans] == [1, 1]
    edges = [(span.start, span.end) for span in found.spans]
    assert edges == [pytest.approx((10.0, 21.98)), pytest.approx((30.0, 32.98))]
    assert found.spans[0].share == pytest.approx(0.8, abs=1e-9)
    assert found.time_share == pytest.approx(14.96 / (2 * PERIOD * (COUNT - 1)))
    assert found.phrase == "gyro: in 2 stretches, 19 % of the time"


def test_nothing_held_has_no_place() -> None:
    assert where_readings_repeat([drive(np.zeros(COUNT, dtype=bool))], ()) is None


def test_two_sensors_cover_their_time_once() -> None:
    one = np.arange(COUNT) % 4 > 0
    both = drive(one)
    channels = dict(both.channels)
    for name in ("specific_force_x", "specific_force_y"):
        channels[name] = channels[name][np.arange(COUNT) // 4 * 4]
    recordings = [replace(both, channels=channels)]
    found = where_readings_repeat(recordings, find_repeated_readings(recordings))
    assert found is not None
    assert len(found.spans) == 2
    assert found.time_share == pytest.approx(1.0, abs=0.01)
    assert found.phrase == "accelerometer and gyro: everywhere"
