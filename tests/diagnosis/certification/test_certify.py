"""Certification sees nothing of what it judges, and says what a planted slope is worth."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.answer.certificate import Certificate, Gains, Measured
from ddagr_gym.diagnosis.certification.certificate import (
    BY_RECORDING,
    BY_TIME,
    certificate,
    finished,
    gain_share,
    gains,
    of_mended_readings,
    resampled,
    worse_on_unseen,
)
from ddagr_gym.diagnosis.certification.certify import (
    _on_one_side,
    certify_models,
    folds_of,
    not_shown,
    refitted_on,
)
from ddagr_gym.diagnosis.certification.forecast import (
    MOTION,
    PAST,
    cut_forecasts,
    errors_at,
    past_elimination,
    start_states,
)
from ddagr_gym.identification.gauss_newton import Fitted, fit
from ddagr_gym.identification.problem import Problem
from ddagr_gym.identification.spells import Spell
from ddagr_gym.identification.windows import CHANNELS, WindowSet
from tests.diagnosis.conftest import Sloping, session_of


def test_the_planted_effect_predicts_unseen_drives(sloping: Sloping) -> None:
    found = sloping.certificate
    assert found.folds == BY_RECORDING
    for channel, ratio in (("position", 0.3), ("specific_force_x", 0.1), ("yaw_rate", 0.3)):
        errors = found.channels[channel]["5"]
        assert errors.corrected.value < ratio * errors.refitted.value, channel
        assert errors.corrected.interval is not None
        low, high = errors.corrected.interval
        assert low <= errors.corrected.value <= high
        assert errors.ceiling.value <= min(item.value for item in (errors.refitted, errors.corrected, errors.black_box))
    share = found.gain_share["5"]
    assert share is not None
    assert share.value > 0.9


def test_a_horizon_that_no_drive_holds_is_left_out_and_said(sloping: Sloping) -> None:
    assert set(sloping.certificate.channels["position"]) == {"1", "5"}
    assert "30 s" in sloping.certificate.note


def test_sizes_do_not_see_the_recording_that_judges(sloping: Sloping) -> None:
    """Readings of the judging recording are spoilt; the sizes fitted to the others stay what they are."""
    problem = sloping.problem
    fold = next(f for f in folds_of(problem)[1] if 0 in f.unseen)
    windows = problem.blocked.windows
    spoilt = windows.measured + np.where(windows.recording == 0, 5.0, 0.0)[:, None, None]
    other = problem.on(replace(problem.blocked, windows=replace(windows, measured=spoilt)))
    points = [refitted_on(p, sloping.chosen, fold) for p in (problem, other)]
    assert points[0].effects == points[1].effects
    assert np.array_equal(points[0].values, points[1].values)
    biases = [k for k, p in enumerate(problem.nuisances.parameters) if p.recording == 0]
    assert np.abs(points[0].values[biases]).max() < 1e-12


def test_starts_do_not_see_what_follows(sloping: Sloping) -> None:
    recordings = sloping.recordings
    forecasts = cut_forecasts(sloping.problem, recordings, 5.0, 4.0)
    assert forecasts is not None
    rows = [int(start) for r, start in zip(forecasts.future.recording, forecasts.future.start, strict=True) if r == 0]
    cut = rows[1] + 1
    channels = {name: values.copy() for name, values in recordings[0].channels.items()}
    for name in ("yaw_rate", "encoder_right", "pose_x", "pose_yaw", "specific_force_x"):
        channels[name][cut:] += 1.0
    changed = cut_forecasts(sloping.problem, (replace(recordings[0], channels=channels), recordings[1]), 5.0, 4.0)
    assert changed is not None
    # the noise of the readings is told from all of them: it is kept the same here
    changed = replace(changed, past=changed.past.on(replace(changed.past.blocked, sigma=forecasts.past.blocked.sigma)))
    point = sloping.chosen.point
    states = [start_states(f, point, past_elimination(f, point)) for f in (forecasts, changed)]
    assert np.allclose(states[0][1], states[1][1], rtol=0.0, atol=1e-9)
    assert not np.allclose(states[0][2], states[1][2], rtol=0.0, atol=0.1)


def test_starts_are_where_the_robot_was(sloping: Sloping) -> None:
    """Speeds to a centimetre per second; the truth comes with the simulated drive."""
    forecasts = cut_forecasts(sloping.problem, sloping.recordings, 5.0, 4.0)
    assert forecasts is not None
    point = sloping.chosen.point
    states = start_states(forecasts, point, past_elimination(forecasts, point))
    for k, name in ((3, "true_v_x"), (5, "true_yaw_rate")):
        truth = [
            sloping.recordings[r].extras[name][s]
            for r, s in zip(forecasts.future.recording, forecasts.future.start, strict=True)
        ]
        assert np.abs(states[:, k] - truth).max() < 0.01, name


def test_one_recording_is_judged_by_halves(problem_of: Callable[..., Problem], sloping: Sloping) -> None:
    recording = sloping.recordings[0]
    problem = problem_of(recording)
    rule, folds = folds_of(problem)
    assert rule == BY_TIME
    forecasts = cut_forecasts(problem, (recording,), 5.0, 1.0)
    assert forecasts is not None
    windows = problem.blocked.windows
    for fold in folds:
        judged = forecasts.future.subset(fold.judges(forecasts))
        assert judged.count
        time = windows.time[fold.training]
        before = time + windows.duration <= judged.time.min() - PAST
        after = time >= (judged.time + judged.duration).max()
        assert (before | after).all()
        assert not (fold.judges(forecasts) & fold.trains(forecasts)).any()


@pytest.fixture(scope="module")
def begun(problem_of: Callable[..., Problem], sloping: Sloping) -> tuple[Problem, Fitted]:
    """One drive of 24 s in which a slope begins after 13 s, and its fit."""
    problem = problem_of(sloping.recordings[0]).during({"slope": Spell(0, 13.0)})
    point = replace(problem.start(), effects=sloping.chosen.point.effects)
    return problem, fit(problem, point, iterations=2, renewals=1)


def test_what_begins_later_than_the_training_keeps_its_size(begun: tuple[Problem, Fitted]) -> None:
    """Before the onset nothing tells the size, which its prior would draw to nothing."""
    problem, fitted = begun
    late, early = folds_of(problem)[1]
    assert not_shown(problem, fitted.point, late) == ("slope",)
    assert not_shown(problem, fitted.point, early) == ()
    assert refitted_on(problem, fitted, late).effects == fitted.point.effects
    assert refitted_on(problem, fitted, early).effects != fitted.point.effects
    note = certificate(BY_TIME, {}, {}, np.random.default_rng(0), ("slope",)).note
    assert "fitted to what lacks sloping ground" in note


def test_no_forecast_crosses_an_onset(begun: tuple[Problem, Fitted], sloping: Sloping) -> None:
    """Nor do the readings that its start comes from."""
    problem, every = begun[0], cut_forecasts(begun[0], sloping.recordings[:1], 5.0, 1.0)
    kept = _on_one_side(problem, every)
    assert every is not None
    assert kept is not None
    begin, end = kept.future.time - PAST, kept.future.time + kept.future.duration
    assert ((end <= 13.0) | (begin >= 13.0)).all()
    assert 0 < kept.future.count < every.future.count
    assert _on_one_side(problem.during({}), every) is every


def test_halves_are_named_as_the_weaker_proof(problem_of: Callable[..., Problem], sloping: Sloping) -> None:
    problem = problem_of(sloping.recordings[0])
    first = problem.blocked.windows.count
    part = replace(
        sloping.nominal,
        point=replace(
            sloping.nominal.point, states=sloping.nominal.point.states[:first], values=_own(sloping, problem)
        ),
        by_parameter=sloping.nominal.by_parameter[:first][..., _columns(sloping, problem)],
        elimination=sloping.nominal.elimination.subset(np.arange(len(sloping.nominal.window_cost)) < first),
        prediction=sloping.nominal.prediction[:first],
        window_cost=sloping.nominal.window_cost[:first],
    )
    session = session_of(problem, sloping.recordings[:1])
    found = certify_models(session, part, part, np.random.default_rng(0))
    assert found.folds == BY_TIME
    assert "one recording" in found.note
    errors = found.channels["position"]["1"]
    assert errors.corrected == errors.refitted


def _columns(sloping: Sloping, problem: Problem) -> list[int]:
    names = [p.name for p in sloping.problem.nuisances.parameters]
    return [names.index(p.name) for p in problem.nuisances.parameters]


def _own(sloping: Sloping, problem: Problem) -> np.ndarray:
    return sloping.nominal.point.values[_columns(sloping, problem)]


def _still(count: int = 2, seconds: float = 2.0, period: float = 0.1) -> WindowSet:
    samples = round(seconds / period)
    return WindowSet(
        period, np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64), np.zeros(count),
        np.zeros((count, samples, 2)), 0, np.zeros((count, samples, 8)), np.zeros((count, 8)),
    )  # fmt: skip


def test_errors_of_a_known_prediction() -> None:
    windows = _still()
    prediction = np.zeros_like(windows.measured)
    prediction[..., CHANNELS.index("yaw_rate")] = 0.1
    prediction[..., CHANNELS.index("pose_yaw")] = 2.0 * np.pi - 0.2
    prediction[0, :, CHANNELS.index("pose_x")] = 0.3 * 0.1 * np.arange(20)  # 0.3 m/s
    prediction[0, :, CHANNELS.index("pose_y")] = 4.0
    errors = errors_at(windows, prediction, 2.0)
    assert errors["yaw_rate"] == pytest.approx([0.1, 0.1])
    assert errors["heading_by_gyro"] == pytest.approx([0.2, 0.2])
    assert errors["pose_yaw"] == pytest.approx([-0.2, -0.2])
    assert errors["speed"] == pytest.approx([0.3, 0.0])
    # the last half second of poses is at 0.45 to 0.57 m, 0.51 m on average
    assert errors["position"] == pytest.approx([np.hypot(0.51, 4.0), 0.0])


def test_what_nothing_measures_has_no_error() -> None:
    windows = _still()
    windows.measured[..., 5:] = np.nan
    windows.measured[0, ::2, CHANNELS.index("yaw_rate")] = np.nan
    errors = errors_at(windows, np.zeros_like(windows.measured), 1.0)
    assert np.isnan([errors["position"], errors["speed"]]).all()
    assert np.isnan(errors["heading_by_gyro"][0])
    assert errors["heading_by_gyro"][1] == 0.0


def test_share_of_the_ceiling() -> None:
    """Errors of 1 and 0.4 with a ceiling of 0.2 are three quarters of the way; without a ceiling there is no share."""
    ones, clusters = np.ones(6), np.array([0, 0, 1, 1, 2, 2])
    errors = {
        "refitted": {"yaw_rate": ones},
        "corrected": {"yaw_rate": 0.4 * ones},
        "flexible": {"yaw_rate": 0.2 * ones},
    }
    table = resampled(errors, clusters, np.random.default_rng(0))
    share = gain_share(gains(table, MOTION))
    assert share is not None
    assert share.value == pytest.approx(0.75)
    assert share.interval == pytest.approx([0.75, 0.75])
    nothing = {name: {"yaw_rate": ones} for name in ("refitted", "corrected", "black_box")}
    assert gain_share(gains(resampled(nothing, clusters, np.random.default_rng(0)), MOTION)) is None


def test_one_cluster_says_nothing_of_a_share() -> None:
    """No interval tells whether the ceiling gains anything."""
    one = np.zeros(4, dtype=np.int64)
    errors = {"refitted": {"yaw_rate": np.ones(4)}, "corrected": {"yaw_rate": np.full(4, 1.3)}}
    errors["flexible"] = {"yaw_rate": np.full(4, 0.8)}
    assert gain_share(gains(resampled(errors, one, np.random.default_rng(0)), MOTION)) is None


def test_no_share_is_more_than_all() -> None:
    """The ceiling is chosen over all windows; in some drawings the corrected model is better than it."""
    rng, clusters = np.random.default_rng(1), np.repeat(np.arange(12), 5)
    base = rng.normal(size=60)
    errors = {"refitted": base, "corrected": 0.5 * rng.normal(size=60), "flexible": 0.45 * rng.normal(size=60)}
    table = resampled({name: {"yaw_rate": values} for name, values in errors.items()}, clusters, rng)
    share = gain_share(gains(table, MOTION))
    assert share is not None
    assert share.interval is not None
    assert share.interval[1] == 1.0


def test_intervals_of_few_clusters_are_wide_enough() -> None:
    """Of 90 % intervals from three drives eight in ten hold the true error; plain resampling has 57 %."""
    rng, clusters = np.random.default_rng(3), np.repeat(np.arange(3), 8)
    held = []
    for _ in range(200):
        errors = np.exp(0.3 * rng.standard_normal(3))[clusters]
        draws = resampled({"refitted": {"yaw_rate": errors}}, clusters, rng)["refitted"]["yaw_rate"]
        low, high = np.quantile(draws[1:], [0.05, 0.95])
        held.append(low < np.exp(0.09) < high)  # root of the mean of exp(0.6 z)
    assert 0.73 < np.mean(held) < 0.99


def test_a_share_of_a_gain_that_may_be_nothing_is_no_number() -> None:
    """The ceiling is better by 10 % over all, but by its luck in one stretch of six."""
    ones, clusters = np.ones(12), np.repeat(np.arange(6), 2)
    lucky = np.where(clusters == 0, 0.1, 1.01)
    errors = {"refitted": {"yaw_rate": ones}, "corrected": {"yaw_rate": ones}, "flexible": {"yaw_rate": lucky}}
    gained = gains(resampled(errors, clusters, np.random.default_rng(0)), MOTION)
    assert gained["ceiling"][0] > 0.05
    assert gain_share(gained) is None


def _gain(*intervals: tuple[float, float]) -> dict[str, Gains | None]:
    none = Measured(0.0)
    entries = [Gains(Measured(sum(interval) / 2.0, interval), none, none) for interval in intervals]
    return {f"{5.0 * k:g}": entry for k, entry in enumerate(entries, 1)}


def _fit(gain: dict[str, Gains | None], readings: dict[str, Gains | None]) -> Certificate:
    return Certificate(BY_RECORDING, "", (5.0, 10.0), 0.9, {}, gain, readings, {}, {})


def test_a_model_that_predicts_unseen_drives_worse_is_found() -> None:
    worse = worse_on_unseen(_fit({"1": None}, _gain((-0.1, 0.2), (-0.4, -0.2))))
    assert worse is not None
    assert (worse.horizon, worse.interval) == (10.0, (-0.4, -0.2))
    assert worse.value == pytest.approx(-0.3)
    assert worse_on_unseen(_fit(_gain((0.1, 0.2)), _gain((-0.4, -0.2)))) is None
    assert worse_on_unseen(_fit(_gain((-0.1, 0.2)), {})) is None
    assert worse_on_unseen(_fit({}, {})) is None
    assert worse_on_unseen(None) is None


def test_what_one_model_does_not_finish_counts_for_none() -> None:
    """Dropping it for that model alone would make a model that breaks look good."""
    errors = {
        "refitted": {"speed": np.array([1.0, 2.0, np.nan])},
        "corrected": {"speed": np.array([0.5, np.nan, np.nan])},
    }
    left, lost = finished(errors)
    assert lost == 1
    assert np.isfinite(left["refitted"]["speed"]).tolist() == [True, False, False]


def test_readings_that_were_mended_leave_nothing_to_share(sloping: Sloping) -> None:
    fit = of_mended_readings(sloping.certificate, named=False)
    assert set(fit.gain_share.values()) == set(fit.gain_share_readings.values()) == {None}
    assert fit.channels == sloping.certificate.channels
    assert "mended before" in fit.note
    assert of_mended_readings(sloping.certificate, named=True).gain_share == sloping.certificate.gain_share
