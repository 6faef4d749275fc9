"""The adapted controller: B4 where nothing is known, right where a known error would mislead B4; bundles as folders."""

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.envs.options import make_settings
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.adapted_controller import AdaptedSettings, FeedForward
from ddagr_gym.evaluation.bundles import Bundle, bundle_version, is_bundle, load_bundle
from ddagr_gym.evaluation.campaign import drive_scenario
from ddagr_gym.evaluation.controllers import controller_title, controller_version, find_controller, needs_filter
from ddagr_gym.evaluation.metrics import turn_metrics
from ddagr_gym.evaluation.runs import drive_turn
from ddagr_gym.evaluation.scenarios import load_scenarios
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.presets import ddagr, get_soil


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


def test_a_known_error_of_the_gyro_misleads_it_no_more():
    wrong = ["gyro_scale=1.08"]
    plain = metrics(driven(bundle().controller(RowTurn()), wrong))
    knowing = metrics(driven(bundle(*wrong).controller(RowTurn()), wrong))
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


def test_a_bundle_is_a_controller_by_its_folder(tmp_path):
    made = bundle("gyro_scale=1.05", settings=replace(AdaptedSettings(), left=FeedForward((1.02,) * 7, 0.03)))
    made.save(tmp_path, "a test")
    name = str(tmp_path)
    assert is_bundle(name)
    assert not is_bundle(tmp_path / "absent")
    again = load_bundle(name)
    assert (again.settings, again.effects) == (made.settings, made.effects)
    assert controller_version(name) == bundle_version(name)
    assert not needs_filter(name)
    assert "adapted" in controller_title(name)
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
