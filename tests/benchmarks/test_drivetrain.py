"""The study of real drivetrains: steady states and limits of its model, its readings, and its fit on simulated data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.drivetrain import model
from benchmarks.drivetrain.fit import Problem, fit_drives
from benchmarks.drivetrain.load_conditions import quantities, tried
from benchmarks.drivetrain.model import predict, read, run
from benchmarks.drivetrain.parameters import ANTI_WINDUP, LOAD, NAMES, USED, parameter_vector, starting_values
from benchmarks.drivetrain.scores import compare, size
from benchmarks.drivetrain.single_commands import best_loads, best_shifts, summary, turning_errors, with_shifts
from benchmarks.drivetrain.stretches import Stretch, find_stretches
from ddagr_gym.errors import InputError
from ddagr_gym.recordings.schema import Recording

WITHIN = ANTI_WINDUP["within_limit"]
HOLD = 0.25
"""Time between readings of an encoder [s], the other one in between."""


def drive(commands, duration=6.0, start=(0.0, 0.0)):
    """A stretch with a command (right, left) every ``duration`` seconds after 1 s of rest."""
    events = np.array([start, *commands], dtype=float)
    times = np.array([0.0, *(1.0 + duration * np.arange(len(commands)))])
    end = 1.0 + duration * len(commands)
    time = [np.arange(0.1, end, HOLD), np.arange(0.1 + 0.5 * HOLD, end, HOLD)]
    bank = np.repeat([0, 1], [len(t) for t in time])
    time = np.concatenate(time)
    step = np.searchsorted(times, time, side="right") - 1
    return Stretch(
        times, events, True, np.array(start, float), end, time, bank, np.zeros(len(time)), step, time - times[step]
    )


def values(**changes):
    return starting_values([*USED, *LOAD]) | changes


def test_places_in_the_vector_are_those_of_the_names():
    assert [getattr(model, name.upper()) for name in NAMES] == list(range(len(NAMES)))


def end_of(stretch, **changes):
    return run(parameter_vector(values(**changes)), stretch, WITHIN)[-1]


def test_steady_speeds_are_the_commands_whatever_the_load():
    found = end_of(drive([(6.0, 3.0)], 30.0))
    assert found[:2] == pytest.approx([6.0, 3.0], abs=0.01)
    assert 0.5 * 3.0 < found[2] < 3.0


def test_top_speed_clamps_the_set_point():
    assert end_of(drive([(16.0, 16.0)], 30.0))[:2] == pytest.approx([13.2, 13.2], abs=0.02)


def test_set_points_go_with_limited_mean_and_turning():
    p = parameter_vector({"mean_ramp": 4.0, "turning_ramp": 2.0, "turning_limit": 3.0})
    wanted, smooth, point, mean = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    model._ask(p, np.array([9.0, 1.0]), wanted)
    assert wanted == pytest.approx([8.0, 2.0])
    for _ in range(25):
        mean[:] = 0.0
        model._set_points(p, wanted, smooth, point, mean, 0.02, 0.02)
    assert point == pytest.approx([3.0, 1.0])
    assert mean == pytest.approx(point)


def test_at_the_power_limit_the_load_takes_all_power():
    changes = {"power": 60.0, "asymmetry": 0.0, "viscous": 0.5, "rolling_load": 3.0}
    speed = end_of(drive([(13.0, 13.0)], 30.0), **changes)[0]
    assert speed < 12.0
    load = 0.5 * speed + 3.0 * (speed / 0.5) / np.hypot(1.0, speed / 0.5)
    assert speed * load == pytest.approx(60.0, rel=0.01)


def test_without_an_integral_part_a_speed_error_carries_the_load():
    changes = {"integral": 0.0, "viscous": 0.0, "rolling_load": 2.0, "proportional": 4.0}
    speed = end_of(drive([(5.0, 5.0)], 30.0), **changes)[0]
    assert 4.0 * (5.0 - speed) == pytest.approx(2.0, rel=0.01)


def test_without_a_command_nothing_moves():
    motion = run(parameter_vector(values()), drive([(0.0, 0.0)]), WITHIN)
    assert np.abs(motion).max() < 1e-12


def test_a_rolling_vehicle_without_torque_only_slows_down():
    changes = {"proportional": 1e-9, "integral": 0.0, "integral_limit": 1e-9}
    motion = run(parameter_vector(values(**changes)), drive([(0.0, 0.0)], start=(5.0, 1.0)), WITHIN)
    moving = np.abs(motion[1:]).max(axis=1)
    assert (np.diff(moving) < 1e-9).all()
    assert moving[-1] < 0.5 * moving[0]


def test_the_weaker_bank_gives_way_first():
    changes = {"power": 80.0, "asymmetry": 0.2, "turning_load": 9.0, "turning_speed": 2.0}
    pulling_right = end_of(drive([(12.0, 0.0)], 20.0), **changes)[0]
    pulling_left = end_of(drive([(0.0, 12.0)], 20.0), **changes)[1]
    assert pulling_left < pulling_right - 1.0


def test_a_delay_moves_the_answer_and_nothing_else():
    early = run(parameter_vector(values(delay=0.2)), drive([(8.0, 2.0)]), WITHIN)
    late = run(parameter_vector(values(delay=0.5)), drive([(8.0, 2.0)]), WITHIN)
    assert late[15:] == pytest.approx(early[:-15], abs=1e-9)


def test_a_robot_that_stands_starts_later_and_goes_on_as_before():
    p, late = parameter_vector(values()), parameter_vector(values(start_delay=0.3))
    from_rest, rolling = drive([(8.0, 2.0)]), drive([(8.0, 2.0)], start=(3.0, 3.0))
    assert run(late, from_rest, WITHIN)[15:] == pytest.approx(run(p, from_rest, WITHIN)[:-15], abs=1e-9)
    assert np.array_equal(run(late, rolling, WITHIN), run(p, rolling, WITHIN))


@pytest.mark.parametrize("windup", ANTI_WINDUP)
def test_halving_the_step_changes_little(windup):
    stretch = drive([(12.0, -4.0), (-8.0, 6.0), (13.0, 13.0)], 4.0)
    p = parameter_vector(values())
    change = predict(p, stretch, ANTI_WINDUP[windup]) - predict(p, stretch, ANTI_WINDUP[windup], 0.01)
    assert np.sqrt(np.mean(change**2)) < 0.2


def test_the_error_of_a_step_is_of_first_order():
    stretch = drive([(12.0, -4.0), (-8.0, 6.0)], 4.0)
    p = parameter_vector(values())
    exact = predict(p, stretch, WITHIN, 0.02 / 32)
    sizes = [size(predict(p, stretch, WITHIN, 0.02 / n) - exact)["rms"] for n in (1, 2, 4)]
    assert np.log2(np.divide(sizes[:-1], sizes[1:])) == pytest.approx(1.0, abs=0.35)


def test_an_averaging_encoder_reads_the_mean_of_a_ramp():
    stretch = drive([(5.0, 5.0)])
    motion = np.repeat(np.linspace(0.0, 7.0, 351)[:, None], 4, axis=1)
    late = stretch.time > 1.0
    found = read(motion, stretch, 0.4)
    assert found[late] == pytest.approx(stretch.time[late] - 0.2, abs=1e-6)


@pytest.fixture(scope="module")
def simulated():
    """Two drives of one robot on two grounds, with readings of 0.1 rad/s noise, and the values behind them."""
    rng = np.random.default_rng(5)
    truth = {
        "first": values(delay=0.3, proportional=5.0, integral=2.5, turning_load=9.0, turning_speed=3.0),
        "second": values(delay=0.3, proportional=5.0, integral=2.5, turning_load=6.0, turning_speed=8.0),
    }
    drives = {}
    for name, chosen in truth.items():
        stretch = drive(rng.uniform(-15.0, 15.0, (16, 2)), 5.07)  # no whole number of readings
        clean = predict(parameter_vector(chosen), stretch, WITHIN)
        drives[name] = [replace(stretch, value=clean + 0.1 * rng.standard_normal(len(clean)))]
    return truth, drives


def test_a_fit_finds_the_values_behind_simulated_readings(simulated):
    truth, drives = simulated
    shared, own = ("delay", "proportional", "integral"), ("turning_load", "turning_speed")
    rest = {name: {k: v for k, v in chosen.items() if k not in shared + own} for name, chosen in truth.items()}
    fit = fit_drives(Problem(drives, shared, own, rest, parity=None))
    for entry, deviation in fit.deviations.items():
        name = entry.drive or "first"
        value, true = fit.values[name][entry.name], truth[name][entry.name]
        assert abs(np.log(value / true)) < 4.0 * deviation + 1e-3, entry
        assert deviation < 0.1
    assert size(fit.residuals["first"])["rms"] == pytest.approx(0.1, rel=0.15)


def test_a_part_that_the_data_have_is_missed_when_it_is_left_out(simulated):
    truth, drives = simulated
    full = fit_drives(Problem(drives, ("delay",), (), truth_without(truth, ("delay",)), parity=None))
    bare = {name: {k: v for k, v in chosen.items() if k not in ("delay", "integral")} for name, chosen in truth.items()}
    other = fit_drives(Problem(drives, ("delay",), (), bare, parity=None))
    change = compare(drives, full.residuals, other.residuals)
    assert change["loss_change"] > 4.0 * change["deviation"]


def truth_without(truth, names):
    return {drive: {k: v for k, v in chosen.items() if k not in names} for drive, chosen in truth.items()}


def test_late_commands_are_found(simulated):
    truth, _ = simulated
    stretch = drive([(8.0, 3.0), (-6.0, 2.0), (4.0, 9.0)])
    late = np.array([0.0, 0.1, -0.1, 0.2])
    reading = predict(parameter_vector(truth["first"]), with_shifts(stretch, late), WITHIN)
    shifts = best_shifts(replace(stretch, value=reading), truth["first"], "within_limit")
    assert shifts == pytest.approx(late, abs=0.02)


def test_commands_under_which_turning_is_resisted_more_are_found(simulated):
    truth, _ = simulated
    stretch = drive([(8.0, 3.0), (-6.0, 2.0), (4.0, 9.0)])
    p, loads = parameter_vector(truth["first"]), np.array([1.0, 1.3, 0.5, 1.0])
    reading = predict(p, stretch, WITHIN, loads=loads)
    read = replace(stretch, value=reading)
    # under the first command nothing turns
    assert best_loads(read, truth["first"], "within_limit")[1:] == pytest.approx(loads[1:])
    found = summary([read], truth["first"], "within_limit")
    assert found["turning_rms"]["own_load"] < 0.1 * found["turning_rms"]["as_fitted"]
    assert found["second_halves_loss"]["load_of_first_half"] < 0.3 * found["second_halves_loss"]["as_fitted"]


def test_a_load_that_falls_with_speed_is_told_from_one_that_depends_on_other_things(simulated):
    truth, _ = simulated
    rng = np.random.default_rng(0)
    stretch = drive(rng.uniform(-9.0, 9.0, (24, 2)))
    speed = np.array([quantities(stretch.events[0], command, 0.0)["speed"] for command in stretch.events])
    p = parameter_vector(truth["first"])
    reading = predict(p, stretch, WITHIN, loads=np.exp(0.1 - 0.3 * speed))
    noisy = replace(stretch, value=reading + 0.02 * rng.standard_normal(len(reading)))
    found = tried([noisy], truth["first"], "within_limit")
    assert found["speed"]["multiple"] == pytest.approx(-0.3, abs=0.06)
    assert found["speed"]["change"] < -3.0 * found["speed"]["deviation"]
    assert all(found[name]["change"] > 0.5 * found["speed"]["change"] for name in ("time", "forwards", "to the left"))


def test_the_error_of_a_turning_is_summed_over_its_first_seconds():
    stretch = drive([(6.0, 2.0), (6.0, 2.0)])
    assert turning_errors(stretch, np.where(stretch.bank == 0, 0.2, 0.0)) == pytest.approx([0.5, 0.5], abs=0.01)


def recording(commands, encoders, spans, command_valid=None):
    t = 0.05 * np.arange(len(commands))
    columns = {"t": t, "command_right": commands[:, 0], "command_left": commands[:, 1],
               "encoder_right": encoders[:, 0], "encoder_left": encoders[:, 1]}  # fmt: skip
    return Recording.from_columns(columns, source="made up", spans=spans, command_valid=command_valid)


def held(speeds):
    """Encoders (n, 2) that are new every fifth row, the left one two rows after the right one."""
    found = np.full((len(speeds), 2), np.nan)
    found[1::5, 0], found[3::5, 1] = speeds[1::5], speeds[3::5]
    return found


def test_steps_that_go_on_are_one_stretch_and_others_are_not():
    commands = np.repeat([[2.0, 2.0], [5.0, 5.0], [5.0, 1.0], [8.0, 8.0]], 60, axis=0)
    commands[60] = commands[59]
    speeds = np.concatenate([np.full(120, 2.0), np.full(60, 5.0), np.zeros(60)])
    found = find_stretches(recording(commands, held(speeds), [(0, 60), (60, 120), (120, 180), (180, 240)]))
    assert [len(stretch.times) for stretch in found] == [2, 1, 1]
    assert [stretch.first for stretch in found] == [0, 2, 3]
    assert [stretch.known for stretch in found] == [False, False, False]
    first = found[0]
    assert first.times == pytest.approx([0.0, 60 * 0.05 + 2 * 0.05])
    assert (first.since >= 0.0).all()
    assert set(first.step) == {0, 1}


def test_readings_keep_their_own_times():
    found = find_stretches(recording(np.full((60, 2), 3.0), held(np.full(60, 3.0)), [(0, 60)]))
    right = found[0].time[found[0].bank == 0]
    left = found[0].time[found[0].bank == 1]
    assert right[:2] == pytest.approx([0.05, 0.30])
    assert left[:2] == pytest.approx([0.15, 0.40])


def test_only_commands_that_the_robot_received_count():
    valid = np.zeros(120, bool)
    valid[40:100] = True
    found = find_stretches(recording(np.full((120, 2), 3.0), held(np.full(120, 3.0)), [(0, 120)], valid))
    assert len(found) == 1
    assert found[0].duration == pytest.approx(59 * 0.05)


def test_a_recording_without_encoders_is_refused():
    bare = recording(np.full((60, 2), 3.0), np.full((60, 2), np.nan), [(0, 60)])
    with pytest.raises(InputError, match="encoder_right"):
        find_stretches(bare)


def test_an_unknown_parameter_is_refused():
    with pytest.raises(InputError, match="propotional"):
        parameter_vector({"propotional": 3.0})
