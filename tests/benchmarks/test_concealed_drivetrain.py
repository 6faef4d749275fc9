"""Later forms of the drivetrain in the blind benchmark: what they do, where they are drawn, what stays as it was."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from benchmarks.changed_pairs.plan import plan as plan_of_pairs
from benchmarks.changed_pairs.robots import ROBOTS, simulated_robot
from benchmarks.concealed import cases, commitments, generate, manoeuvres, storage
from benchmarks.concealed.cases import Case
from benchmarks.concealed.catalogue import DRIVETRAIN, DRIVETRAIN_FORMS
from benchmarks.concealed.change import Change, Form, Site
from benchmarks.concealed.drive import SUBSTEPS, drive
from benchmarks.concealed.forms_drive import STEP
from benchmarks.concealed.plant import nominal_plant
from benchmarks.concealed.simulate import effect_labels

LATER = [form for forms in DRIVETRAIN_FORMS.values() for form in forms]
TURN = np.repeat([[0.0, 0.0]] * 25 + [[0.0, 1.15]] * 225, SUBSTEPS, axis=0)
RAMP = np.column_stack([np.arange(2000) * STEP, -np.arange(2000) * STEP])
RNG = np.random.default_rng(0)


def change_of(name: str, variant: str, size: float) -> Change:
    """What a form of a size does."""
    (form,) = [item for item in DRIVETRAIN_FORMS[name] if item.variant == variant]
    return form.build(size, RNG, Site(()))


def received(name: str, variant: str, size: float, commands: np.ndarray) -> np.ndarray:
    """Commands as the motors receive them."""
    command = change_of(name, variant, size).command
    assert command is not None
    return command(commands, RNG)


def turned(name: str, variant: str, size: float) -> dict[str, np.ndarray]:
    """Truth of a tight turn."""
    plant = change_of(name, variant, size).plant
    assert plant is not None
    return drive(plant(nominal_plant()), TURN, np.zeros(3))


@pytest.fixture(scope="module")
def plain() -> dict[str, np.ndarray]:
    """Truth of the tight turn without any effect."""
    return drive(nominal_plant(), TURN, np.zeros(3))


def drawn(case: Case) -> list[object]:
    """Everything that a plan draws of a case."""
    effects = [[form.name, form.variant, multiple] for form, multiple in case.effects]
    also = [case.structure, case.manoeuvres, case.receiver, case.command_row]
    return [case.number, case.kind, effects, *also]


def digest_of(draws: list[list[object]]) -> str:
    return hashlib.sha256(json.dumps(draws).encode()).hexdigest()[:16]


@pytest.mark.parametrize(
    ("set_name", "seed", "expected"),
    [
        ("development", 1, "70e98a958ea053bf"),
        ("development", 2**80 + 3, "175b58441f307414"),
        ("sealed", 7, "81f3c9d3ac9283f9"),
        ("sealed", 2**80 + 3, "f27ccc82d843eb23"),
    ],
)
def test_draws_of_older_sets_stay_as_they_were(set_name: str, seed: int, expected: str) -> None:
    """As they were before the later forms: commitments of older sets can be replayed."""
    assert digest_of([drawn(case) for case in cases.plan(set_name, seed)]) == expected


@pytest.mark.parametrize(
    ("robot", "expected"),
    [("ddagr", "bba558a31c53c718"), ("warthog", "bf6d1dfc9d63185a"), ("husky", "41fc58139e55db4b")],
)
def test_draws_of_pairs_stay_as_they_were(robot: str, expected: str) -> None:
    assert digest_of([[*drawn(pair.case), pair.begins] for pair in plan_of_pairs(3, robot)]) == expected


@pytest.mark.parametrize("seed", range(4))
def test_the_ninth_set_has_every_later_form_and_doubles_with_the_drivetrain(seed: int) -> None:
    planned = cases.plan("ninth", seed)
    singles = Counter(case.effects[0][0] for case in planned if case.kind == "single")
    assert all(singles[form] == 1 for form in LATER)
    assert sum(count for form, count in singles.items() if form.name in DRIVETRAIN) == 20
    doubles = [case for case in planned if case.kind == "double"]
    driven = [case for case in doubles if set(case.verdict) & set(DRIVETRAIN)]
    assert len(driven) == 8
    assert sum(any(form.later for form, _ in case.effects) for case in driven) == 4
    assert not any(form.later for case in planned if case.kind == "outside" for form, _ in case.effects)


def test_two_effects_of_a_double_have_no_name_in_common() -> None:
    for case in (case for seed in range(8) for case in cases.plan("ninth", seed) if case.kind == "double"):
        one, other = ({form.name, *form.also} for form, _ in case.effects)
        assert not one & other


def test_other_right_names_stand_in_the_label_of_those_forms_only() -> None:
    for form in LATER:
        case = Case("ninth", 1, "single", ((form, form.low),))
        (told,) = effect_labels(case, (form.build(0.1, RNG, Site(())),))
        assert told.get("also", []) == list(form.also)
        assert ("also" in told) == bool(form.also)
    assert any(form.also for form in LATER)


def test_a_ninth_set_is_sealed_and_can_be_replayed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(manoeuvres, "DURATION", 8.0)
    labels = generate.generate("ninth", 5, tmp_path / "set", processes=1, limit=2)
    assert labels == tmp_path / "set.labels.json"
    assert commitments.discrepancies(tmp_path / "set", labels, replay=2) == []
    assert not {"seed", "label"} & set(storage.read_json(tmp_path / "set" / "commitments.json"))


@pytest.mark.parametrize("variant", ["held on a slow bus", "ramped on a slow bus"])
def test_a_slow_bus_is_late_by_the_size(variant: str) -> None:
    late = RAMP[400:] - received("command_delay", variant, 0.2, RAMP)[400:]
    assert np.mean(late[:, 0]) == pytest.approx(0.2, abs=STEP)
    assert np.mean(late[:, 1]) == pytest.approx(-0.2, abs=STEP)
    spread = np.ptp(late[:, 0])
    assert spread == pytest.approx(0.4 if variant.startswith("held") else 0.0, abs=2 * STEP)


def test_an_s_shaped_ramp_is_late_by_the_size_and_has_no_corner() -> None:
    step = np.where(np.arange(800)[:, None] < 100, 0.0, [0.7, -0.7])
    passed = received("motor_lag", "S-shaped ramp", 0.3, step)
    assert np.sum(step - passed, axis=0)[0] * STEP / 0.7 == pytest.approx(0.3, abs=0.01)
    np.testing.assert_allclose(passed[:, 1], -passed[:, 0], atol=1e-12)
    acceleration = np.diff(passed[:, 0]) / STEP
    assert np.abs(np.diff(acceleration)).max() / STEP <= 0.7 / 0.3**2 * (1 + 1e-9)
    # a third of an encoder's step
    assert passed.max() < 0.7 + 0.005
    assert passed[-1, 0] == pytest.approx(0.7, abs=1e-3)


@pytest.mark.parametrize(
    ("name", "variant", "size"),
    [
        ("motor_lag", "turning only", 0.2),
        ("motor_saturation", "turning limit", 0.3),
        ("command_deadband", "turning only", 0.2),
    ],
)
def test_what_acts_on_the_turning_leaves_the_mean_and_straights(name: str, variant: str, size: float) -> None:
    commands = np.random.default_rng(3).uniform(-1.0, 1.0, (400, 2))
    passed = received(name, variant, size, commands)
    np.testing.assert_allclose(passed.mean(axis=1), commands.mean(axis=1), atol=1e-12)
    assert np.abs(passed - commands).max() > 0.05
    straight = np.repeat(commands[:, :1], 2, axis=1)
    np.testing.assert_allclose(received(name, variant, size, straight), straight, atol=1e-12)


def test_turning_is_bounded_overlooked_or_late() -> None:
    turning = np.column_stack([RAMP[:, 0] / 5.0, -RAMP[:, 0] / 5.0])
    bounded = received("motor_saturation", "turning limit", 0.5, turning)
    np.testing.assert_allclose(bounded[:, 0], np.minimum(turning[:, 0], 0.3))
    overlooked = received("command_deadband", "turning only", 0.2, turning)
    np.testing.assert_allclose(overlooked[:, 0], np.where(turning[:, 0] < 0.2, 0.0, turning[:, 0]))
    late = turning - received("motor_lag", "turning only", 0.2, turning)
    assert late[-1, 0] == pytest.approx(0.2 * 0.2, rel=0.01)


def test_a_soft_loop_gives_way_in_a_turn_and_comes_back(plain: dict[str, np.ndarray]) -> None:
    soft = turned("motor_droop", "soft loop", 0.006)
    gap = plain["omega_left"] - soft["omega_left"]
    assert gap[25:100].max() > 0.05
    assert abs(gap[-50:]).max() < 0.3 * gap[25:100].max()


def test_a_tight_integral_part_leaves_speed_lost_in_a_turn(plain: dict[str, np.ndarray]) -> None:
    """P part of 2 0.9 25 1/s 10.6 kg m^2: 2.1 mrad/s per N m, and the size more, beyond 28 N m."""
    held = turned("motor_droop", "tight integral part", 0.002)
    beyond = np.mean(held["torque_left"][-50:]) - 28.0
    assert beyond > 5.0
    lost = 1.15 - np.mean(held["omega_left"][-50:])
    assert lost == pytest.approx(beyond * (1.0 / (1.8 * 25.0 * 10.6) + 0.002), rel=0.03)
    assert abs(1.15 - np.mean(plain["omega_left"][-50:])) < 0.1 * lost


def test_a_power_limit_bounds_driving_and_not_braking(plain: dict[str, np.ndarray]) -> None:
    limited = turned("motor_saturation", "power limit", 0.25)
    power = limited["torque_left"] * limited["omega_left"]
    assert power.max() < 50.0 * (1.0 - 1.6 * 0.25) * 1.02
    assert (plain["torque_left"] * plain["omega_left"]).max() > 40.0
    assert np.mean(limited["omega_left"][-50:]) < np.mean(plain["omega_left"][-50:]) - 0.05


def test_a_current_that_folds_back_bounds_torque_by_speed(plain: dict[str, np.ndarray]) -> None:
    limited = turned("motor_saturation", "current folds back", 0.35)
    ceiling = 90.0 * (1.0 - 0.35) * (1.0 - np.abs(limited["omega_left"]) / 2.4)
    # speeds are of the end of the step that the torque began
    assert np.all(np.abs(limited["torque_left"]) < ceiling + 0.5)
    assert np.any(np.abs(plain["torque_left"]) > 90.0 * 0.65 * (1.0 - np.abs(plain["omega_left"]) / 2.4) + 2.0)


@pytest.mark.parametrize("robot", list(ROBOTS))
@pytest.mark.parametrize("form", [form for form in LATER if form.name in ("motor_droop", "motor_saturation")],
                         ids=lambda form: form.variant)  # fmt: skip
def test_forms_of_motors_begin_from_the_robot_that_drives(form: Form, robot: str) -> None:
    plant = simulated_robot(robot).put_into(nominal_plant())
    change = form.build(0.1, RNG, Site(())).plant
    if change is None:
        return
    motors, share = change(plant).motors, plant.motors.torque_limit / 300.0
    assert motors.inertia == plant.motors.inertia
    assert motors.bandwidth <= plant.motors.bandwidth
    for value, own in ((motors.power_limit, 42.0), (motors.integral_limit, 28.0)):
        assert value in (0.0, pytest.approx(own * share))
    assert motors.torque_limit in (plant.motors.torque_limit, pytest.approx(81.0 * share))
