"""Adapted controllers: B4 and B6 where nothing is known, right where an error is known; bundles as folders."""

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.adaptation.run import nominal_settings
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.envs.options import make_settings
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.adapted_controller import AdaptedSettings, FeedForward
from ddagr_gym.evaluation.adapted_tracker import CorrectedReckoning
from ddagr_gym.evaluation.bundles import Bundle, bundle_version, is_bundle, load_bundle
from ddagr_gym.evaluation.campaign import drive_scenario
from ddagr_gym.evaluation.controllers import controller_title, controller_version, find_controller, needs_filter
from ddagr_gym.evaluation.known_physics import known_physics
from ddagr_gym.evaluation.metrics import turn_metrics
from ddagr_gym.evaluation.runs import drive_turn
from ddagr_gym.evaluation.scenarios import load_scenarios
from ddagr_gym.parameters import STANDARD_GRAVITY, Sensors
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.presets import ddagr, get_soil

TRACKER = nominal_settings("B6")
SETTINGS = [AdaptedSettings(), TRACKER]


def bundle(*effects, settings=None):
    return Bundle(settings or AdaptedSettings(), ddagr(), get_soil("thesis_a1"), load_effects(effects))


def metrics(run):
    return turn_metrics(run.columns, run.episode.turn, run.episode.robot)


def driven(controller, effects=(), ekf_features=False, seed=0):
    settings = make_settings(effects=effects, ekf_features=ekf_features)
    episode = settings.draw(np.random.default_rng(seed))
    made = find_controller(controller, episode.turn) if isinstance(controller, str) else controller
    return drive_turn(made, settings, seed, episode)


def test_it_is_b4_where_nothing_is_known():
    nominal, own = driven("B4", ekf_features=True), driven(bundle().controller(RowTurn()))
    assert metrics(own).turn.error == pytest.approx(metrics(nominal).turn.error, abs=1e-5)
    assert metrics(own).exit.lateral_error == pytest.approx(metrics(nominal).exit.lateral_error, abs=1e-5)


def test_it_is_b6_where_nothing_is_known():
    nominal, own = driven("B6"), driven(bundle(settings=TRACKER).controller(RowTurn()))
    for name, values in nominal.columns.items():
        np.testing.assert_array_equal(own.columns[name], values)


def test_a_tracker_with_samples_at_another_rate_begins_anew():
    """The filter is that of the samples that come; nothing of an episode is left in the next one."""
    made = bundle(settings=TRACKER).controller(RowTurn())
    samples = np.zeros((4, 5))
    observation = np.concatenate([np.zeros(7), [1.0, 0.8, 0.2, np.pi, 0.5]])
    for _ in range(2):
        made.reset()
        first = [made(observation, {"samples": samples, "command": np.zeros(2)}) for _ in range(14)]
    made.reset()
    again = [made(observation, {"samples": samples, "command": np.zeros(2)}) for _ in range(14)]
    np.testing.assert_array_equal(first, again)


def test_a_known_delay_comes_late_in_the_filter_and_runs_ahead_in_the_loop():
    late = ["command_delay=0.2"]
    plain = metrics(driven(bundle(settings=TRACKER).controller(RowTurn()), late))
    knowing = metrics(driven(bundle(*late, settings=TRACKER).controller(RowTurn()), late))
    assert abs(knowing.turn.error) < abs(plain.turn.error)


@pytest.mark.parametrize("settings", SETTINGS)
def test_a_known_error_of_the_gyro_misleads_it_no_more(settings):
    wrong = ["gyro_scale=1.08"]
    plain = metrics(driven(bundle(settings=settings).controller(RowTurn()), wrong))
    knowing = metrics(driven(bundle(*wrong, settings=settings).controller(RowTurn()), wrong))
    assert abs(plain.exit.heading_error) > 0.15
    assert abs(knowing.exit.heading_error) < 0.05


def test_a_feed_forward_of_its_side_bends_the_path():
    tighter = FeedForward((1.1,) * 7)
    as_it_is = metrics(driven(bundle().controller(RowTurn()))).turn
    side = driven(bundle().controller(RowTurn())).episode.turn.side
    own = bundle(settings=replace(AdaptedSettings(), **{side: tighter}))
    other = bundle(settings=replace(AdaptedSettings(), **{"left" if side == "right" else "right": tighter}))
    assert metrics(driven(own.controller(RowTurn()))).turn.error < as_it_is.error - 0.05
    assert metrics(driven(other.controller(RowTurn()))).turn.error == as_it_is.error


def test_factors_lie_between_their_places():
    lesson = FeedForward((1.0, 1.2, 1.0))
    assert [lesson.factor(share) for share in (0.0, 0.25, 0.5, 1.0)] == pytest.approx([1.0, 1.1, 1.2, 1.0])
    with pytest.raises(InputError, match="positive"):
        FeedForward((1.0, -1.0))


@pytest.mark.parametrize("settings", [replace(AdaptedSettings(), left=FeedForward((1.02,) * 7, 0.03)), TRACKER])
def test_a_bundle_is_a_controller_by_its_folder(settings, tmp_path):
    made = bundle("gyro_scale=1.05", settings=settings)
    made.save(tmp_path, "a test")
    name = str(tmp_path)
    assert is_bundle(name)
    assert not is_bundle(tmp_path / "absent")
    again = load_bundle(name)
    assert (again.settings, again.effects) == (made.settings, made.effects)
    assert controller_version(name) == bundle_version(name)
    assert not needs_filter(name)
    assert f"{made.adapted_from} adapted" in controller_title(name)
    scenario = load_scenarios("V")[0]
    direct = drive_turn(made.controller(scenario.episode.turn), make_settings(radius=scenario.episode.turn.radius,
                        speed=scenario.episode.turn.speed), scenario.seed, scenario.episode)  # fmt: skip
    assert np.array_equal(drive_scenario(name, scenario).columns["true_y"], direct.columns["true_y"])


def test_a_broken_bundle_is_one_sentence(tmp_path):
    bundle().save(tmp_path)
    (tmp_path / "soil.yaml").unlink()
    with pytest.raises(InputError, match=r"holds no soil\.yaml"):
        load_bundle(tmp_path)


def test_it_asks_for_samples():
    with pytest.raises(InputError, match="raw samples"):
        bundle().controller(RowTurn())(np.zeros(12), {})


@pytest.mark.parametrize("drag", ["towed_drag=150", "viscous_drag=350"])
def test_a_drag_that_the_tracker_knows_misleads_it_no_more(drag):
    """The force law's soil need not make up for it."""
    plain, knowing = (
        [metrics(driven(bundle(*known, settings=TRACKER).controller(RowTurn()), [drag], seed=seed)) for seed in (0, 1)]
        for known in ((), (drag,))
    )
    sizes = [[abs(item.turn.error) for item in own] for own in (plain, knowing)]
    assert np.mean(sizes[1]) < 0.7 * np.mean(sizes[0])


def test_the_tracker_begins_with_the_pull_of_a_slope_that_it_knows():
    """Wheel model, eq. (23), at the heading of the rows; a level prior would have to learn it."""
    known = known_physics(ddagr(), load_effects(["slope=0.05,direction=0.5"]))
    reckoning = CorrectedReckoning(known, Sensors(), None, row_heading=0.3)
    reckoning.reset(-0.5, 0.0, 0.0)
    pull = STANDARD_GRAVITY * np.sin(0.05)
    assert reckoning.present().gravity == pytest.approx((-pull * np.cos(0.2), -pull * np.sin(0.2)), rel=1e-6)
