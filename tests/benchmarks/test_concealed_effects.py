"""The blind benchmark's simulator: calibration, symmetry, convergence, and the signature of every effect."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest

from benchmarks.concealed import catalogue, sensors
from benchmarks.concealed.change import Change, Form, Site
from benchmarks.concealed.drive import SUBSTEPS, drive
from benchmarks.concealed.plant import GRAVITY, Plant, nominal_plant
from benchmarks.concealed.soil import ELASTOPLASTIC, HUMP, KONDNER, REECE, SATURATING, TWO_STAGE, Soil
from benchmarks.concealed.wheel import static_wheel

NAMED_FORMS = (*catalogue.LIBRARY_FORMS.values(), *catalogue.DRIVETRAIN_FORMS.values())
ALL_FORMS = [*catalogue.OUTSIDE_FORMS, *(form for forms in NAMED_FORMS for form in forms)]
TESTED_APART = (("brownout", "cut outs"), ("soil_change", "onset"), ("command_deadband", "turning only"))
IN_A_SHORT_DRIVE = [form for form in ALL_FORMS if (form.name, form.variant) not in TESTED_APART]
WHEEL = (0.05, 0.1016, 0.2294)
RADIUS, LOAD = 0.2794, 168.0 * GRAVITY / 4.0
RUN = tuple[dict[str, np.ndarray], dict[str, np.ndarray]]


def program(*segments: tuple[float, float, float]) -> np.ndarray:
    """Commands at 50 Hz from (seconds, right, left)."""
    return np.concatenate([np.tile(s[1:], (round(s[0] * 50), 1)) for s in segments])


STRAIGHT = program((0.5, 0, 0), (5.5, 0.701, 0.701))
TURN = program((0.5, 0, 0), (9.5, 0.0, 1.195))
STEPS = program((0.5, 0, 0), (2, 0.9, 0.9), (2, 0.1, 1.0), (0.5, 0, 0), (2, -0.4, 0.5))


nothing = Change()


def form_of(name: str, variant: str) -> Form:
    (form,) = [form for form in ALL_FORMS if (form.name, form.variant) == (name, variant)]
    return form


@functools.cache
def plain_drive(commands: bytes) -> RUN:
    """The drive without any effect, heading east."""
    return driven(nothing, np.frombuffer(commands).reshape(-1, 2))


def driven(change: Change | None, commands: np.ndarray, yaw: float = 0.0, plant: Plant | None = None) -> RUN:
    """Truth and noise-free readings of a drive with one effect or none."""
    if change is None and plant is None and yaw == 0.0:
        return plain_drive(np.ascontiguousarray(commands, dtype=float).tobytes())
    plant, changes = plant or nominal_plant(), (change,) if change else ()
    fast = np.repeat(commands, SUBSTEPS, axis=0)
    rng = np.random.default_rng(7)
    for one in changes:
        fast = one.command(fast, rng) if one.command else fast
        plant = one.plant(plant) if one.plant else plant
    truth = drive(plant, fast, np.array([0.0, 0.0, yaw]))
    return truth, sensors.readings(truth, plant, commands, changes, rng)


def built(name: str, variant: str, size: float, commands: np.ndarray = TURN, seed: int = 3) -> Change:
    site = Site((driven(None, commands)[0],))
    return form_of(name, variant).build(size, np.random.default_rng(seed), site)


def end(values: np.ndarray, seconds: float = 1.0) -> float:
    """Mean over the last second(s)."""
    return float(np.mean(values[-round(seconds * 50) :]))


def test_straight_of_the_reference_robot():
    truth, _ = driven(None, STRAIGHT)
    assert end(truth["v_x"]) == pytest.approx(0.1942, rel=0.02)
    assert end(truth["sinkage_1"]) == pytest.approx(0.0079, rel=0.1)
    assert abs(end(truth["v_y"])) < 1e-6
    assert abs(end(truth["yaw_rate"])) < 1e-6


def test_turn_of_table_6_2():
    truth, _ = driven(None, TURN)
    v_x, v_y, turn = end(truth["v_x"]), end(truth["v_y"]), end(truth["yaw_rate"])
    assert v_x == pytest.approx(0.1546, rel=0.06)
    assert turn == pytest.approx(-0.2108, rel=0.06)
    assert math.hypot(v_x, v_y) / abs(turn) == pytest.approx(0.733, rel=0.04)
    assert abs(v_y) < 0.02


def test_speed_loop_answers_like_its_nominal_time_constant():
    truth, _ = driven(None, STRAIGHT)
    passed = np.argmax(truth["omega_right"] > 0.701 * (1.0 - math.exp(-1.0)))
    assert (passed - 25) * 0.02 == pytest.approx(1.0 / 4.5, abs=0.021)


@pytest.mark.parametrize("pressure_law", [REECE, SATURATING, TWO_STAGE])
@pytest.mark.parametrize("shear_law", [KONDNER, HUMP, ELASTOPLASTIC])
def test_every_pair_of_laws_drives_alike(pressure_law, shear_law):
    soil = Soil(pressure_law=pressure_law, shear_law=shear_law)
    truth, _ = driven(None, TURN, plant=nominal_plant(soil))
    assert end(truth["yaw_rate"]) == pytest.approx(-0.2108, rel=0.1)
    assert end(truth["v_x"]) == pytest.approx(0.1546, rel=0.1)
    assert end(truth["sinkage_2"]) == pytest.approx(0.0083, rel=0.2)


def test_wheel_forces_resemble_the_reference_wheel():
    """Against values of the package (theory: wheel model, eq. (17)) for Table A.1 at a quarter of the weight."""
    reference = {-0.2: -0.265, -0.05: -0.133, 0.05: 0.090, 0.2: 0.223, 0.5: 0.287}
    for slip, pull in reference.items():
        spin = 0.2 / RADIUS * (1.0 + slip if slip < 0 else 1.0 / (1.0 - slip))
        _, force = static_wheel(Soil(), WHEEL, LOAD, 0.2, 0.0, spin, 0.0)
        assert force[0] / LOAD == pytest.approx(pull, abs=0.05)
    for angle, push in {5: -0.165, 20: -0.291, 70: -0.338}.items():
        v_x, v_y = 0.2 * math.cos(math.radians(angle)), 0.2 * math.sin(math.radians(angle))
        _, force = static_wheel(Soil(), WHEEL, LOAD, v_x, v_y, v_x / RADIUS, 0.0)
        assert force[1] / LOAD == pytest.approx(push, abs=0.03)


def test_wheel_dissipates_and_mirrors():
    rng = np.random.default_rng(5)
    for v_x, v_y, spin, turn in rng.uniform(-1, 1, (40, 4)) * [0.4, 0.2, 1.3, 0.5]:
        _, force = static_wheel(Soil(), WHEEL, LOAD, v_x, v_y, spin, turn)
        assert force[0] * v_x + force[1] * v_y + force[3] * turn - force[4] * spin < 1e-9
        _, mirrored = static_wheel(Soil(), WHEEL, LOAD, v_x, -v_y, spin, -turn)
        np.testing.assert_allclose(mirrored, force * [1, -1, 1, -1, 1], atol=1e-6)
        _, reversed_ = static_wheel(Soil(), WHEEL, LOAD, -v_x, v_y, -spin, -turn)
        np.testing.assert_allclose(reversed_, force * [-1, 1, 1, -1, -1], atol=1e-6)


def test_swapped_commands_mirror_the_drive():
    one, other = driven(None, STEPS)[0], driven(None, STEPS[:, ::-1])[0]
    np.testing.assert_allclose(one["x"], other["x"], atol=1e-9)
    np.testing.assert_allclose(one["yaw"], -other["yaw"], atol=1e-9)


def test_integrator_converges_with_first_order():
    errors = []
    finest = drive(nominal_plant(), np.repeat(STEPS, 64, axis=0), np.zeros(3), substeps=64)
    for substeps in (4, 8, 16):
        truth = drive(nominal_plant(), np.repeat(STEPS, substeps, axis=0), np.zeros(3), substeps=substeps)
        errors.append(max(np.abs(truth[name] - finest[name]).max() for name in ("x", "y", "yaw")))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all((orders > 0.9) & (orders < 1.5)), (errors, orders)
    assert errors[1] < 1e-3


def test_robot_stands_still_on_a_slope():
    truth, read = driven(built("slope", "plane", math.radians(4.0)), program((5, 0, 0)))
    moved = math.hypot(truth["x"][-1] - truth["x"][0], truth["y"][-1] - truth["y"][0])
    assert moved < 5e-4
    pull = GRAVITY * math.sin(math.radians(4.0))
    assert math.hypot(end(read["imu_ax"]), end(read["imu_ay"])) == pytest.approx(pull, rel=0.03)


def test_gravity_turns_with_heading_and_a_bias_does_not():
    slope, bias = built("slope", "plane", 0.05), built("accelerometer_bias", "constant", 0.2)
    for change, turns in ((slope, True), (bias, False)):
        ahead, back = (driven(change, STRAIGHT, yaw)[1] for yaw in (0.4, 0.4 + math.pi))
        for name in ("imu_ax", "imu_ay"):
            assert abs(end(ahead[name])) > 0.05
            assert end(back[name]) == pytest.approx(-end(ahead[name]) if turns else end(ahead[name]), abs=0.02)


def test_slope_reads_uphill_and_slows_the_climb():
    change = built("slope", "plane", 0.05)
    uphill = change.parameters["uphill"]
    truth, read = driven(change, STRAIGHT, uphill)
    assert end(read["imu_ax"]) == pytest.approx(GRAVITY * math.sin(0.05), rel=0.05)
    assert end(truth["v_x"]) < end(driven(change, STRAIGHT, uphill + math.pi)[0]["v_x"]) - 0.002


def test_delay_shifts_the_encoder():
    plain, late = driven(None, STRAIGHT)[1], driven(built("command_delay", "constant", 0.2), STRAIGHT)[1]
    np.testing.assert_allclose(late["enc_right"][40:200], plain["enc_right"][30:190], atol=0.0158)


@pytest.mark.parametrize(
    ("name", "variant", "size", "commands", "signal", "direction", "at_least"),
    [
        ("motor_lag", "slower loop", 0.2, STRAIGHT[:50], "omega_right", -1, 0.05),
        ("motor_lag", "second pole", 0.2, STRAIGHT[:50], "omega_right", -1, 0.05),
        ("motor_droop", "leaky integrator", 0.0018, TURN, "omega_left", -1, 0.05),
        ("motor_droop", "battery sag", 0.003, TURN, "omega_left", -1, 0.05),
        ("motor_saturation", "speed limit", 0.2, TURN, "omega_left", -1, 0.2),
        ("motor_saturation", "torque limit", 0.45, TURN, "omega_left", -1, 0.02),
        ("motor_saturation", "slew limit", 0.3, STRAIGHT[:40], "omega_left", -1, 0.02),
        ("command_deadband", "offset", 0.1, STRAIGHT, "omega_left", -1, 0.09),
        ("payload", "low", 40.0, STRAIGHT, "sinkage_3", 1, 3e-4),
        ("towed_drag", "hitch", 60.0, STRAIGHT, "torque_left", 1, 5.0),
        ("towed_drag", "sledge", 60.0, STRAIGHT, "torque_left", 1, 5.0),
        ("viscous_drag", "linear", 200.0, STRAIGHT, "torque_right", 1, 3.0),
        ("viscous_drag", "mud at wheels", 200.0, STRAIGHT, "torque_right", 1, 3.0),
        ("lateral_bulldozing", "immediate", 3.0, TURN, "yaw_rate", 1, 0.003),
        ("lateral_bulldozing", "berm", 3.0, TURN, "yaw_rate", 1, 0.003),
        ("slip_sinkage", "immediate", 3.0, TURN, "sinkage_2", 1, 5e-4),
        ("slip_sinkage", "digging", 3.0, TURN, "sinkage_2", 1, 5e-4),
        ("multipass", "alignment", 0.8, STRAIGHT, "sinkage_3", -1, 5e-4),
        ("multipass", "rut map", 0.8, STRAIGHT, "sinkage_3", -1, 5e-4),
    ],
)
def test_direction_of(name, variant, size, commands, signal, direction, at_least):
    with_effect, plain = driven(built(name, variant, size), commands)[0], driven(None, commands)[0]
    assert direction * (end(with_effect[signal], 0.2) - end(plain[signal], 0.2)) > at_least


def test_slow_commands_vanish_in_the_deadband():
    for variant in ("cut out", "sticking", "offset"):
        truth, _ = driven(built("command_deadband", variant, 0.15), program((3, 0.1, 0.6)))
        assert abs(end(truth["omega_right"])) < 0.002
        assert end(truth["omega_left"]) == pytest.approx(0.45 if variant == "offset" else 0.6, abs=0.01)


def test_loads_follow_the_centre_of_mass():
    change = built("centre_of_mass_offset", "anywhere", 0.08)
    x, y = change.parameters["x"], change.parameters["y"]
    truth, _ = driven(change, STRAIGHT)
    z = [end(truth[f"sinkage_{k}"]) for k in (1, 2, 3, 4)]
    assert math.copysign(1, z[0] + z[1] - z[2] - z[3]) == math.copysign(1, x)
    assert math.copysign(1, z[1] + z[3] - z[0] - z[2]) == math.copysign(1, y)


def test_larger_right_wheels_turn_left_at_every_speed():
    change = built("wheel_radius_mismatch", "banks", 0.02)
    ratio = change.parameters["ratio"]
    rates = [end(driven(change, program((4, w, w)))[0]["yaw_rate"]) / w for w in (0.3, 0.9)]
    assert np.all(np.sign(rates) == np.sign(ratio))
    assert rates[0] == pytest.approx(rates[1], rel=0.15)


def test_weaker_soil_slips_more_and_split_soil_pulls_aside():
    change = built("soil_change", "everything", 0.6)
    ln = change.parameters["ln_strength"]
    slip, plain = (end(run[0]["slip_2"]) for run in (driven(change, TURN), driven(None, TURN)))
    assert (slip - plain) * ln < 0
    split = built("soil_split", "both", 0.6)
    stiffer_right = split.parameters["ln_strength_ratio"] > 0
    truth, _ = driven(split, STRAIGHT)
    assert (end(truth["sinkage_1"]) < end(truth["sinkage_2"])) == stiffer_right


def test_soil_changes_at_its_moment():
    change = built("soil_change", "onset", 0.6)
    moment = change.parameters["onset_in_run_2"]
    commands = np.repeat(program((60, 0.8, 0.8)), SUBSTEPS, axis=0)
    changed, plain = (drive(p, commands, np.zeros(3), 70.0) for p in (change.plant(nominal_plant()), nominal_plant()))
    gap = np.abs(changed["sinkage_1"] - plain["sinkage_1"])
    time = np.arange(len(gap)) * 0.02
    assert gap[time <= moment].max() == 0.0
    assert gap[time > moment + 1.0].min() > 1e-3


def test_patch_is_felt_inside_only():
    change = built("soil_patch", "disc", 0.8, program((20, 1.1, 1.1)))
    ((_, x, _, radius, _),) = change.parameters["kind_x_y_radius_angle"]
    truth, plain = driven(change, program((20, 1.1, 1.1)))[0], driven(None, program((20, 1.1, 1.1)))[0]
    gap = np.abs(truth["sinkage_1"] - plain["sinkage_1"])
    distance = np.abs(truth["x"] + 0.33 - x)
    assert gap[distance < 0.5 * radius].min() > 1e-3
    assert gap[(distance > radius + 0.5) & (truth["x"] < x)].max() < 2e-4


def test_sensor_effects_follow_their_equations():
    truth, plain = driven(None, STEPS)
    turn = plain["imu_gz"]

    def reading(name: str, variant: str, size: float) -> tuple[dict[str, np.ndarray], dict]:
        change = built(name, variant, size)
        changed_truth, read = driven(change, STEPS)
        np.testing.assert_array_equal(changed_truth["yaw"], truth["yaw"])
        return read, dict(change.parameters)

    read, label = reading("gyro_bias", "constant", 0.005)
    np.testing.assert_allclose(read["imu_gz"] - turn, label["bias"], atol=1e-12)
    read, label = reading("gyro_scale", "constant", 0.05)
    np.testing.assert_allclose(read["imu_gz"], label["scale"] * turn, atol=1e-12)
    read, label = reading("imu_misalignment", "yaw", 0.3)
    forward = math.cos(label["yaw"]) * plain["imu_ax"] + math.sin(label["yaw"]) * plain["imu_ay"]
    np.testing.assert_allclose(read["imu_ax"], forward, atol=1e-12)
    read, label = reading("imu_tilt", "mounting", 0.05)
    assert end(read["imu_ax"]) - end(plain["imu_ax"]) == pytest.approx(-GRAVITY * label["pitch"], abs=0.01)
    assert end(read["imu_ay"]) - end(plain["imu_ay"]) == pytest.approx(GRAVITY * label["roll"], abs=0.01)
    read, label = reading("imu_lever_arm", "rigid", 0.3)
    swing = truth["yaw_acceleration"]
    np.testing.assert_allclose(read["imu_ax"] - plain["imu_ax"], -swing * label["y"] - turn**2 * label["x"], atol=1e-12)
    read, label = reading("encoder_scale", "one bank", 0.05)
    assert end(read["enc_right"]) == pytest.approx(label["right"] * end(plain["enc_right"]), abs=1e-3)
    read, label = reading("pose_latency", "constant", 0.4)
    np.testing.assert_allclose(read["x"][20:], plain["x"][:-20], atol=1e-9)


@pytest.mark.parametrize(
    ("name", "variant", "channel"),
    [("gyro_sign", "flipped", "imu_gz"), ("accelerometer_sign", "both axes", "imu_ax")],
)
def test_flipped_signs(name, variant, channel):
    log = {column: np.arange(5.0) for column in sensors.COLUMNS}
    flipped = built(name, variant, 1.0).logged(log, np.random.default_rng(0))
    np.testing.assert_array_equal(flipped[channel], -log[channel])
    np.testing.assert_array_equal(flipped["enc_left"], log["enc_left"])


@pytest.mark.parametrize("variant", ["slow update", "encoders", "sticking"])
def test_held_channels_repeat(variant):
    change = built("sensor_hold", variant, 0.2)
    log = {column: np.random.default_rng(1).random(2000) for column in sensors.COLUMNS}
    held = change.logged(log, np.random.default_rng(0))
    for name in sensors.COLUMNS[3:8]:
        fresh = 1.0 + np.count_nonzero(np.diff(held[name]))
        expected = 0.1 if name in change.parameters["channels"] else 1.0
        assert fresh / 2000 == pytest.approx(expected, rel=0.2)


def test_brownouts_cut_both_commands():
    commands = np.ones((80 * 400, 2))
    cut = built("brownout", "cut outs", 2.0).command(commands, np.random.default_rng(4))
    assert 0.02 < np.mean(cut[:, 0] == 0.0) < 0.12  # 0.5 s every 8 s
    np.testing.assert_array_equal(cut[:, 0], cut[:, 1])


@pytest.mark.parametrize("form", IN_A_SHORT_DRIVE, ids=lambda form: f"{form.name}-{form.variant}")
def test_every_form_leaves_a_trace(form):
    """At its largest size every form changes a channel by more than numerical error, and nothing becomes NaN."""
    site, size = Site((driven(None, STEPS)[0],)), form.high * catalogue.least_size(form)
    change = form.build(size, np.random.default_rng(2), site)
    (_, plain), (_, read) = driven(None, STEPS), driven(change, STEPS)
    if change.logged:
        read = change.logged(read, np.random.default_rng(0))
    gaps = {name: np.abs(read[name] - plain[name]).max() for name in sensors.COLUMNS}
    assert all(np.isfinite(gap) for gap in gaps.values())
    assert max(gaps.values()) > 1e-3
    assert gaps["t"] == gaps["cmd_right"] == 0.0
