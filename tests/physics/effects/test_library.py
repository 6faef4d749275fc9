"""What every registered effect must keep, so that the diagnosis can rely on it."""

from __future__ import annotations

import subprocess
import sys
import time
from dataclasses import fields
from pathlib import Path

import numba
import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Numerics
from ddagr_gym.physics import effects as package
from ddagr_gym.physics import layout
from ddagr_gym.physics.callbacks import EffectActions, apply_effects
from ddagr_gym.physics.effects import GROUPS, DriveExtent, effect_kinds, effect_table
from ddagr_gym.simulator import Simulator

VERDICT_NAMES = {
    "commands and motors": "command_delay motor_lag motor_droop motor_saturation command_deadband command_gain",
    "robot": "payload centre_of_mass_offset wheel_radius_mismatch towed_drag viscous_drag",
    "ground": "slope soil_change soil_split soil_patch lateral_bulldozing slip_sinkage multipass",
    "sensors": "gyro_bias gyro_scale gyro_sign accelerometer_bias accelerometer_sign imu_misalignment imu_tilt "
    "imu_lever_arm encoder_scale pose_latency sensor_hold",
}
KINDS = effect_kinds()
EXTENT = DriveExtent(
    duration=2.4, x=(-0.1, 0.4), y=(-0.1, 0.3), wheel_speed=0.85, wheel_acceleration=0.45, turning=0.25
)
MAY_CHANGE = {
    layout.POINT_COMMANDS: [(layout.COMMAND, 2)],
    layout.POINT_SET_POINTS: [(layout.MOTOR_TARGET, 2)],
    layout.POINT_MOTORS: [(layout.MOTOR_TARGET, 2), (layout.MOTOR_RATE, 2), (layout.DRIVETRAIN, 10)],
    layout.POINT_LOADS: [(layout.MASS, 7), (layout.WHEEL, 12), (layout.TOWED, 2)],
    # kinematics are a function of the motion, and renewed before each use
    layout.POINT_SOIL: [
        (layout.SOIL, 36),
        (layout.WHEEL_V_X, 12),
        (layout.SLIP_RATIO, 4),
        (layout.HEAPED, 4),
        (layout.FELT_DEPTH, 4),
    ],
    layout.POINT_WHEEL_FORCES: [(layout.EXTRA_FORCE_X, 16)],
    layout.POINT_BODY_FORCES: [(layout.BODY_FORCE, 3)],
    layout.POINT_READINGS: [(layout.READING, 8)],
}
CHANNELS = ("specific_force_x", "specific_force_y", "yaw_rate", "encoder_right", "encoder_left")
POSE = ("pose_x", "pose_y", "pose_yaw")
# about the sensors' noise
SCALES = {"specific_force_x": 0.05, "specific_force_y": 0.05, "yaw_rate": 3e-3, "encoder_right": 0.01}
SCALES |= {"encoder_left": 0.01, "pose_x": 0.02, "pose_y": 0.02, "pose_yaw": 0.01}
# no adaptive choices: these depend on parameters in steps; more nodes, since slopes move where a kink passes one
SMOOTH = Numerics(
    contact_nodes=7,
    substeps=4,
    launch_substeps=1,
    jacobian_refresh=0.0,
    force_extrapolation=0.0,
    jacobian_contact_nodes=4,
    sinkage_tolerance=1e-8,
    accepted_error=1e9,
)


@pytest.fixture(scope="module")
def gentle():
    """Commands (300, 2) that vary smoothly in forward driving, and the motion that goes with their start."""
    t = 0.008 * np.arange(300)
    right = 0.7 + 0.15 * np.sin(np.pi * t)
    left = 0.45 + 0.15 * np.sin(4.8 * t + 1.0)
    commands = np.stack([right, left], axis=1)
    return commands, {"v_x": 0.145, "yaw_rate": 0.06, "omega_right": right[0], "omega_left": left[0]}


@pytest.fixture(scope="module")
def rough():
    """Commands (240, 2) in random steps, forwards and backwards."""
    return np.random.default_rng(5).uniform(-0.8, 1.0, (6, 2)).repeat(40, axis=0)


@pytest.fixture(scope="module")
def rough_base(drive, rough):
    return drive((), rough)


def random_effect(kind, generator):
    """Instance with every parameter drawn over its bounds, or over a span that a drive meets where these are vast."""
    values = {}
    for name in (*kind.size_names(), *kind.shape_names()):
        low, high = kind.parameter(name).metadata["low"], kind.parameter(name).metadata["high"]
        if high - low > 1e5:
            low, high = max(low, -20.0), min(high, 20.0)
        values[name] = generator.uniform(low, high)
    return kind(**values)


def scaled(kind, probe, share):
    """The probe with its sizes at a share of their distance from neutral."""
    neutral = {name: kind.parameter(name).metadata["neutral"] for name in kind.size_names()}
    return probe.with_values(**{name: n + share * (getattr(probe, name) - n) for name, n in neutral.items()})


def stacked(columns):
    """All channels over their scales, without the samples that have no fix."""
    values = np.concatenate([columns[name] / SCALES[name] for name in (*CHANNELS, *POSE)])
    return values[np.isfinite(values)]


def test_library_is_the_verdict_table():
    expected = {name: group for group, names in VERDICT_NAMES.items() for name in names.split()}
    assert {name: kind.group for name, kind in KINDS.items()} == expected
    assert tuple(VERDICT_NAMES) == GROUPS


def test_table_of_points_in_the_package_names_every_effect_at_its_point():
    rows = {line.split()[0]: line for line in package.__doc__.splitlines() if line.split()[:1]}
    for name, kind in KINDS.items():
        prefix = name.split("_")[0] + "_*"
        for point, _ in kind.actions:
            text = rows[layout.POINTS[point]]
            start = package.__doc__.index(text)
            following = package.__doc__[start : start + 2 * len(text) + 80]
            assert name in following or prefix in following, name


@pytest.mark.parametrize("name", KINDS)
class TestEveryEffect:
    def test_is_one_documented_file(self, name):
        kind = KINDS[name]
        assert Path(kind.__module__.replace(".", "/")).name == name == kind.name
        for text in (kind.title, kind.equation, kind.source, kind.signature):
            assert len(text) > 5
        assert kind.__doc__.count("Attributes:") == 1
        attributes = kind.__doc__.split("Attributes:")[1]
        for field in (*kind.size_names(), *kind.shape_names()):
            assert f"        {field}: " in attributes, field
            assert len(kind.meaning(field)) > 5
        assert kind.description()
        assert "Attributes" not in kind.description()
        assert kind.categorical or "least: " in kind.meaning(kind.size_names()[0])

    def test_confusions_are_known_and_mutual(self, name):
        others = KINDS[name].confused_with
        assert list(others) == sorted(set(others) - {name})
        for other in others:
            assert name in KINDS[other].confused_with, other

    def test_parameters_have_units_bounds_and_steps(self, name):
        kind = KINDS[name]
        names = (*kind.size_names(), *kind.shape_names())
        assert len(names) <= layout.EFFECT_PARAMETERS
        assert kind.size_names()[0] == fields(kind)[0].name
        for field in names:
            item = kind.parameter(field).metadata
            centre = item["neutral"] if item["neutral"] is not None else kind.parameter(field).default
            assert item["unit"]
            assert item["low"] <= centre <= item["high"]
            assert item["low"] <= centre + item["step"] <= item["high"]
            assert item["step"] != 0
            assert item["least"] > 0 or item["neutral"] is None

    def test_acts_at_legal_points_and_only_on_their_entries(self, name, turning_row):
        kind = KINDS[name]
        for probe in kind.probes(EXTENT):
            for point, action in probe.actions:
                before = turning_row.copy()
                after = before.copy()
                memory = np.zeros(layout.EFFECT_MEMORY)
                action(after, probe.vector(), memory)
                allowed = np.zeros(layout.SIZE, dtype=bool)
                for first, count in MAY_CHANGE[point]:
                    allowed[first : first + count] = True
                changed = ~((after == before) | (np.isnan(after) & np.isnan(before)))
                assert not (changed & ~allowed).any()
                if point in (layout.POINT_WHEEL_FORCES, layout.POINT_BODY_FORCES):
                    assert not memory.any()

    def test_is_a_pure_function(self, name, turning_row):
        generator = np.random.default_rng(2)
        for _, action in KINDS[name].actions:
            effect = random_effect(KINDS[name], generator)
            results = []
            for _ in range(2):
                row, memory, parameters = turning_row.copy(), np.zeros(layout.EFFECT_MEMORY), effect.vector()
                for _ in range(3):
                    action(row, parameters, memory)
                results.append(np.concatenate([row, memory]))
                np.testing.assert_array_equal(parameters, effect.vector())
            np.testing.assert_array_equal(results[0], results[1])

    def test_neutral_changes_nothing(self, name, drive, rough, rough_base):
        kind = KINDS[name]
        assert kind.neutral().is_neutral
        assert not kind.neutral().is_meaningful(EXTENT)
        columns = drive([kind.neutral()], rough)
        for column, values in rough_base.items():
            np.testing.assert_array_equal(columns[column], values, err_msg=column)

    def test_probes_are_small_but_seen(self, name, drive, gentle):
        kind = KINDS[name]
        commands, state = gentle
        base = stacked(drive((), commands, initial_state=state))
        assert kind.probes(EXTENT)
        seen = [np.abs(stacked(drive([p], commands, initial_state=state)) - base).max() for p in kind.probes(EXTENT)]
        assert not any(probe.is_neutral for probe in kind.probes(EXTENT))
        if kind.name == "sensor_hold":  # poses come at 10 Hz: only the longer hold covers one
            seen.pop(3)
        if kind.name == "command_deadband":  # its thresholds lie below these commands, that of turns above their turn
            assert seen[1:3] == [0.0, 0.0]
            seen = [seen[0], seen[3]]
        assert min(seen) > 1e-3

    def test_readings_follow_the_sizes_smoothly(self, name, drive, gentle):
        kind = KINDS[name]
        if not kind.differentiable:
            pytest.skip("declared not differentiable")
        commands, state = gentle

        def readings(effects):
            return stacked(drive(effects, commands, initial_state=state, numerics=SMOOTH))

        base = readings(())
        # the thresholds of a deadband lie below these commands and are steps where they are passed
        for probe in kind.probes(EXTENT)[: 1 if kind.name == "command_deadband" else 4]:
            slopes = [(readings([scaled(kind, probe, share)]) - base) / share for share in (1.0, 0.5, 0.25)]
            changes = [np.linalg.norm(slopes[i] - slopes[i + 1]) / np.linalg.norm(slopes[2]) for i in range(2)]
            # a first-order remainder halves with the step; linear effects have none
            assert changes[0] < 0.1
            assert changes[1] < 0.6 * changes[0] + 2e-3

    def test_stays_finite_over_rough_drives(self, name, drive, rough):
        generator = np.random.default_rng(7)
        for _ in range(3):
            effect = random_effect(KINDS[name], generator)
            columns = drive([effect], rough)
            for column, values in columns.items():
                if column not in POSE:
                    assert np.isfinite(values).all(), (effect, column)
                    assert np.abs(values).max() < 1e5, (effect, column)

    def test_batch_equals_single(self, name, robot, soil, ideal_sensors, rough):
        kind = KINDS[name]
        generator = np.random.default_rng(11)
        chosen = [random_effect(kind, generator) for _ in range(3)]
        batch = Simulator(3, effects=[chosen[0]], threads=2)
        for i, effect in enumerate(chosen):
            batch.configure(i, robot, soil, ideal_sensors)
            batch.effect_parameters[i] = effect.vector()
        batch.reset()
        together, _ = batch.step(np.repeat(rough[None], 3, axis=0))
        for i, effect in enumerate(chosen):
            single = Simulator(1, effects=[effect])
            single.configure(0, robot, soil, ideal_sensors)
            single.reset()
            alone, _ = single.step(rough[None])
            np.testing.assert_array_equal(together[i], alone[0])

    def test_forgets_at_reset(self, name, robot, soil, ideal_sensors, rough):
        effect = random_effect(KINDS[name], np.random.default_rng(13))
        simulator = Simulator(1, effects=[effect])
        simulator.configure(0, robot, soil, ideal_sensors)
        runs = []
        for _ in range(2):
            simulator.reset(state={"v_x": 0.1, "omega_right": 0.5, "omega_left": 0.3})
            runs.append(simulator.step(rough[None])[0])
        np.testing.assert_array_equal(runs[0], runs[1])

    def test_bounds_are_enforced(self, name):
        kind = KINDS[name]
        first = kind.size_names()[0]
        item = kind.parameter(first).metadata
        with pytest.raises(InputError, match=rf"{kind.__name__}\.{first} is .*{item['unit'][:3]}"):
            kind(**{first: item["high"] * 1.01 + 1.0})
        with pytest.raises(InputError, match="finite"):
            kind(**{first: float("nan")})


@numba.njit
def call_often(count, point, row, start, actions):
    for _ in range(count):
        row[:] = start
        if point >= 0:
            apply_effects(point, row, actions)


@pytest.mark.slow
def test_no_action_is_slow(turning_row):
    """0.1 us is 0.3 percent of a sample; slow, since a time says little on a busy machine."""
    row = turning_row.copy()
    costs = {}
    for name, kind in KINDS.items():
        points, addresses, parameters = effect_table((kind.probes(EXTENT)[0],))
        actions = EffectActions(points, addresses, parameters, np.zeros((1, layout.EFFECT_MEMORY)))
        arguments = (row, turning_row, actions)
        best = {}
        for point in (points[0], -1):
            call_often(1, point, *arguments)
            for _ in range(5):
                began = time.perf_counter()
                call_often(2000, point, *arguments)
                best[point] = min(best.get(point, 1.0), (time.perf_counter() - began) / 2000)
        costs[name] = best[points[0]] - best[-1]
    assert max(costs.values()) < 4e-7, costs


def test_compiled_actions_come_from_the_disk_the_second_time():
    """A process that finds the cache must not compile: that takes hundreds of milliseconds per effect."""
    program = (
        "from ddagr_gym.jit import _KEEP_ALIVE\n"
        "from ddagr_gym.physics.effects import effect_kinds, effect_table\n"
        "effect_table(tuple(kind.neutral() for kind in effect_kinds().values()))\n"
        "print(sum(c.cache_hits for c in _KEEP_ALIVE), len(_KEEP_ALIVE))\n"
    )
    effect_table(tuple(kind.neutral() for kind in KINDS.values()))
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    hits, count = map(int, done.stdout.split())
    assert hits == count >= len(KINDS)


@pytest.mark.parametrize("name", KINDS)
def test_probes_exist_for_the_fastest_and_the_slowest_drives(name):
    for speed in (1e-3, 0.3, 40.0):
        extent = DriveExtent(600.0, (-500.0, 500.0), (-500.0, 500.0), speed, 10.0 * speed)
        assert not any(probe.is_neutral for probe in KINDS[name].probes(extent))


STRAIGHT = DriveExtent(duration=60.0, x=(0.0, 5.0), y=(0.0, 0.0), wheel_speed=1.5, wheel_acceleration=3.0, turning=0.0)
STANDING = DriveExtent(duration=60.0, x=(0.0, 0.0), y=(0.0, 0.0), wheel_speed=0.0, wheel_acceleration=0.0, turning=0.0)


@pytest.mark.parametrize("extent", [STRAIGHT, STANDING], ids=["straight", "standing"])
@pytest.mark.parametrize("name", KINDS)
def test_drives_that_never_turn_have_the_probes_of_all_others(name, extent):
    """Scans of several drives are held against each other probe by probe."""
    kind = KINDS[name]
    assert not any(probe.is_neutral for probe in kind.probes(extent))
    if name not in ("soil_patch", "motor_saturation"):  # theirs lie where the drive was, and below what it reached
        assert [p.shape_names() for p in kind.probes(extent)] == [p.shape_names() for p in kind.probes(EXTENT)]
