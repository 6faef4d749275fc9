from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.recordings.checks.currents import CurrentKind, current_kind, currents, speed_exponent, wrong_sign
from ddagr_gym.recordings.checks.findings import Status
from ddagr_gym.recordings.checks.run import check_recording
from ddagr_gym.recordings.column_map import ColumnMap, ColumnSource, TimeSource
from ddagr_gym.recordings.conversion import RawTable, build_recording


def rng():
    return np.random.default_rng(0)


def with_channels(recording, **channels):
    return replace(recording, channels={**recording.channels, **channels})


def with_currents(recording, kind: CurrentKind, period: int = 50):
    """Currents of banks that push the robot and are held back in turns, a sample in every ``period`` rows."""
    right, left = recording["encoder_right"], recording["encoder_left"]
    made = {}
    for name, own, other in (("current_right", right, left), ("current_left", left, right)):
        torque = 5.0 * np.tanh(5.0 * own) + 8.0 * np.tanh(own - other)
        current = 0.1 * torque if kind is CurrentKind.MOTOR else 0.02 * torque * own
        current = current + 0.05 * np.random.default_rng(3).standard_normal(current.size)
        current[np.arange(current.size) % period != 0] = np.nan
        made[name] = current
    return with_channels(recording, **made)


def found(recording, check):
    return {f.channel: f for f in currents(recording, rng()) if f.check == check}


@pytest.mark.parametrize("kind", CurrentKind)
def test_sign_says_what_was_measured(make_drive, kind):
    recording = with_currents(make_drive(seconds=240.0), kind)
    assert current_kind(recording, rng()) is kind
    signs = found(recording, "current_sign")
    assert {f.status for f in signs.values()} == {Status.PASS}
    said = "supply" if kind is CurrentKind.SUPPLY else "motors' own current"
    assert all(said in f.meaning for f in signs.values())


@pytest.mark.parametrize("kind", CurrentKind)
def test_a_reversed_current_is_named_with_its_remedy(make_drive, kind):
    recording = with_currents(make_drive(seconds=240.0), kind)
    turned = with_channels(recording, current_left=-recording["current_left"])
    assert wrong_sign(turned, "current_left", rng())
    assert not wrong_sign(turned, "current_right", rng())
    signs = found(turned, "current_sign")
    assert signs["current_left"].status is Status.SUSPICIOUS
    assert "sign: -1" in signs["current_left"].remedy
    assert signs["current_right"].status is Status.PASS


def test_a_current_that_never_changes_is_stuck(make_drive):
    recording = make_drive(seconds=60.0)
    zeros = np.zeros(len(recording))
    stuck = found(with_channels(recording, current_right=zeros, current_left=zeros), "stuck")
    assert {f.status for f in stuck.values()} == {Status.SUSPICIOUS}


def test_random_currents_say_nothing_of_their_kind(make_drive):
    recording = make_drive(seconds=240.0)
    noise = np.random.default_rng(5).standard_normal((2, len(recording)))
    assert current_kind(with_channels(recording, current_right=noise[0], current_left=noise[1]), rng()) is None


def sagging(recording, exponent: float):
    """Wheels that follow their commands as a falling battery voltage lets them."""
    voltage = np.linspace(50.0, 42.0, len(recording))
    share = (voltage / 46.0) ** exponent
    noise = 1.0 + 0.005 * np.random.default_rng(2).standard_normal((2, len(recording)))
    return with_channels(
        recording,
        battery_voltage=voltage,
        encoder_right=recording["encoder_right"] * share * noise[0],
        encoder_left=recording["encoder_left"] * share * noise[1],
    )


def test_wheels_that_weaken_with_the_voltage_are_named(make_drive):
    recording = sagging(make_drive(seconds=240.0), 1.0)
    estimate = speed_exponent(recording, "battery_voltage", rng())
    assert estimate.values[0] == pytest.approx(1.0, abs=0.1)
    finding = found(recording, "voltage_to_speed")["battery_voltage"]
    assert finding.status is Status.SUSPICIOUS
    assert "motor_saturation" in finding.suspects


def test_a_speed_loop_that_makes_up_for_the_voltage_passes(make_drive):
    finding = found(sagging(make_drive(seconds=240.0), 0.0), "voltage_to_speed")["battery_voltage"]
    assert finding.status is Status.PASS
    assert finding.value == pytest.approx(0.0, abs=0.1)


def test_a_steady_voltage_cannot_say(make_drive):
    recording = make_drive(seconds=60.0)
    steady = with_channels(recording, battery_voltage=np.full(len(recording), 48.0))
    assert found(steady, "voltage_to_speed")["battery_voltage"].status is Status.NOT_TESTABLE
    # a good battery's logged voltage repeats itself for long: that is no sensor that stops
    assert not any(f.channel.startswith("battery_voltage") and f.check == "wait" for f in check(steady).findings)


def check(recording):
    return check_recording(recording, rng())


def test_a_breaking_supply_is_named(make_drive):
    recording = make_drive(seconds=60.0)
    voltage = np.where(np.arange(len(recording)) % 500 < 100, 30.0, 48.0)
    finding = found(with_channels(recording, battery_voltage=voltage), "voltage_sag")["battery_voltage"]
    assert finding.status is Status.SUSPICIOUS
    assert "battery" in finding.remedy


def test_other_findings_do_not_depend_on_currents(make_drive):
    recording = make_drive(seconds=120.0)
    names = ("current_", "voltage", "battery")
    plain = check(recording).findings
    assert not any(part in f.channel for f in plain for part in names)
    loaded = check(with_currents(recording, CurrentKind.MOTOR)).findings
    assert tuple(f for f in loaded if not any(part in f.channel for part in names)) == plain


def test_implausible_units_are_doubted(make_drive):
    recording = make_drive(seconds=20.0)
    doubts = with_channels(recording, current_right=np.full(len(recording), 12000.0)).validate()
    assert any("current_right reaches" in text and "(mA?)" in text for text in doubts)


def test_maps_name_currents_and_voltages_with_units():
    n = 50
    numbers = {"t": np.arange(n) * 0.1, "i": np.linspace(0.0, 900.0, n), "u": np.linspace(48e3, 47e3, n)}
    column_map = ColumnMap(
        TimeSource("t"),
        {"current_right": ColumnSource("i", "mA", -1), "battery_voltage": ColumnSource("u", "mV")},
    )
    made = build_recording(RawTable(numbers), column_map, None)
    np.testing.assert_allclose(made["current_right"], -numbers["i"] / 1000.0)
    np.testing.assert_allclose(made["battery_voltage"], numbers["u"] / 1000.0)


def test_the_real_drive_with_currents(recordings_dir):
    from ddagr_gym.recordings.load import load_recording

    recording = load_recording(recordings_dir / "open" / "warthog_grass.csv.gz", robot="warthog")
    assert current_kind(recording, rng()) is CurrentKind.SUPPLY
    assert recording.rate("current_right") == pytest.approx(1.0, rel=0.01)
    assert np.nanmedian(recording["voltage_left"]) == pytest.approx(48.1, abs=0.2)
