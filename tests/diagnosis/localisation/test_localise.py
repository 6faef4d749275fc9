"""Where an effect acts: known onsets, places and regimes come back, and noise makes no phrases."""

import json
import re
import sys
from dataclasses import asdict, replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.answer.location import Place
from ddagr_gym.diagnosis.gates.thresholds import Thresholds
from ddagr_gym.diagnosis.localisation.effect_timeline import (
    ScoreProcess,
    as_it_stands,
    by_piece,
    change_points,
    piece_blocks,
    score_processes,
    spans,
    time_share,
)
from ddagr_gym.diagnosis.localisation.localise import _fitted_place, channel_shares, locate
from ddagr_gym.diagnosis.localisation.mismatch_traces import piece_values, trace_mismatch
from ddagr_gym.diagnosis.localisation.operating_condition_words import NOWHERE_MORE, phrase_of, uneven_phrase
from ddagr_gym.diagnosis.localisation.operating_conditions import Pieces, shares, uneven
from ddagr_gym.diagnosis.localisation.residual_wrench import HeldWrench, residual_wrench
from ddagr_gym.diagnosis.search.scanned_model import ScannedModel, SearchResult
from ddagr_gym.diagnosis.wording import EVERYWHERE, range_in_words
from ddagr_gym.errors import InputError
from ddagr_gym.extras import how_to_install
from ddagr_gym.identification.gauss_newton import fit
from ddagr_gym.identification.misfit import channel_misfit, dispersion_of
from ddagr_gym.identification.nuisances import LOCAL
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.physics.effects.registry import parse_effect
from tests.diagnosis.conftest import session_of

LIMITS = dict.fromkeys((*CHANNELS, *LOCAL), 1.2)

pytest.importorskip("ruptures", reason="needs the extra diagnosis")


def scanned(problem, fitted):
    misfit = channel_misfit(problem, fitted)
    return ScannedModel(fitted, None, (), {}, {}, dispersion_of(problem, fitted), misfit)


def located(problem, found, seed=0):
    session = session_of(problem, gates=Thresholds({}, LIMITS, 20, "a test"), seed=seed)
    return locate(session, found, trace_mismatch(session, found))


@pytest.fixture(scope="module")
def limited(drive, problem_of):
    """Motors that turn no faster than 0.75 rad/s, and a model that knows it."""
    problem = problem_of(drive(("motor_saturation=0.75",)))
    nominal = fit(problem, iterations=2)
    start = replace(nominal.point, effects=(parse_effect("motor_saturation=0.75"),))
    chosen = fit(problem, start, iterations=2, reuse=nominal, fixed=frozenset(["speed_limit"]))
    return problem, SearchResult((scanned(problem, nominal), scanned(problem, chosen)), ())


def test_a_limit_shows_only_while_it_is_reached(limited):
    problem, found = limited
    (where,) = located(problem, found).findings.values()
    # commands of the fixture beyond 0.75 rad/s: 4 to 8 s, 12 to 16 s, and from 20 s on
    assert where.spans
    for span in where.spans:
        begins = min((4.0, 12.0, 20.0), key=lambda time: abs(time - span.start))
        assert begins - 0.5 <= span.start <= begins + 1.5
        assert span.end <= begins + 4.5
        assert span.size == pytest.approx(1.0, abs=4.0 * span.deviation + 0.1)
    assert sum(span.share for span in where.spans) > 0.9
    command = next(item for item in where.regimes if item.name == "command")
    assert command.excess > 0.4
    assert command.low == pytest.approx(0.75, abs=0.2)


def test_a_localisation_is_plain_json(limited):
    found = located(*limited)
    again = json.loads(json.dumps(asdict(found)))
    assert set(again["findings"]) == {"motor_saturation"}
    assert set(again["channels"]) == set(limited[1].nominal.misfit)
    assert sum(item["share"] for item in again["channels"].values()) == pytest.approx(1.0)
    assert 0.5 < found.explained <= 1.0
    assert [item["component"] for item in again["wrench"]] == ["F_x", "F_y", "M_z"]


def test_the_seed_decides_the_shifts_and_nothing_else(limited):
    first, again, other = (located(*limited, seed=seed).findings["motor_saturation"] for seed in (0, 0, 1))
    assert first == again
    assert [item.p for item in first.regimes] != [item.p for item in other.regimes]
    assert [item.excess for item in first.regimes] == [item.excess for item in other.regimes]
    assert first.spans == other.spans


def test_nothing_found_has_no_spans_and_no_phrase(limited):
    problem, found = limited
    alone = located(problem, SearchResult(found.models[1:], ()))
    raw = SearchResult((scanned(problem, as_it_stands(problem, found.nominal.fitted)),), ())
    nothing = located(problem, raw)
    assert alone.remaining.phrase == "nothing above the noise"
    assert nothing.findings == {}
    assert nothing.mismatch.spans == ()


def test_gains_of_pieces_are_the_fall_of_the_cost_without_the_effect(limited):
    problem, found = limited
    (process,) = score_processes(problem, found.chosen.fitted)
    assert process.gain == pytest.approx(process.score - 0.5 * process.information)
    assert process.score == pytest.approx(process.remainder + process.information)
    below = problem.blocked.windows.time < 2.0
    assert process.own[below].sum() < 0.01 * process.own.sum()


def test_regime_values_are_what_was_driven(limited):
    problem, found = limited
    pieces = piece_values(problem, found.chosen.fitted)
    windows = problem.blocked.windows
    assert len(pieces.x) == windows.count * 4
    # commands of the fixture: (0.5, -0.5) rad/s from 16 to 20 s spins, (0.7, 0.7) before 4 s goes straight
    time = pieces.values["time"]
    assert np.median(pieces.values["turning"][(time > 17.0) & (time < 19.5)]) > 0.1
    assert np.abs(pieces.values["yaw_rate"][(time > 1.0) & (time < 3.0)]).max() < 0.05
    assert pieces.values["command"][(time > 1.0) & (time < 3.0)] == pytest.approx(0.7)
    assert pieces.values["command_change"][(time > 4.9) & (time < 7.4)] == pytest.approx(0.0, abs=1e-9)


def test_a_wrench_that_the_model_lacks_is_the_residual_wrench(drive, problem_of):
    problem = problem_of(drive(seconds=8.0))
    pushed = (HeldWrench(-6.0, 4.0, 2.0),)
    right = fit(problem, replace(problem.start(), effects=pushed), iterations=0)
    lacking = replace(right, point=replace(right.point, effects=()))
    lacking = replace(lacking, prediction=problem.predict(lacking.point))
    wrench = residual_wrench(problem, lacking, right, dispersion=4.0)
    once = residual_wrench(problem, lacking, right)
    lacks = wrench.before - wrench.after
    assert lacks[:, 2] == pytest.approx(2.0, rel=0.1)
    # the arc from 4 s on; straight steady driving hardly shows a small force, and a start from rest is not linear in it
    assert lacks[2] == pytest.approx([-6.0, 4.0, 2.0], rel=0.1)
    assert wrench.deviation == pytest.approx(2.0 * once.deviation)
    assert (once.deviation > 0.0).all()


def test_blocks_fall_into_pieces():
    assert piece_blocks(20, 0.1).tolist() == [0] * 5 + [1] * 5 + [2] * 5 + [3] * 5
    assert piece_blocks(12, 0.1).tolist() == [0] * 5 + [1] * 7
    assert piece_blocks(3, 0.1).tolist() == [0] * 3
    values = np.arange(24.0).reshape(2, 12)
    assert by_piece(values, piece_blocks(12, 0.1)) == pytest.approx(np.array([[10.0, 56.0], [70.0, 140.0]]))


def test_change_points_of_a_jump_and_of_noise():
    rng = np.random.default_rng(3)
    noise = rng.normal(size=120)
    jump = noise + 2.0 * (np.arange(120) >= 70)
    ends = change_points(jump)
    assert len(ends) == 2
    assert abs(ends[0] - 70) <= 3
    assert sum(len(change_points(rng.normal(size=120))) > 1 for _ in range(50)) <= 3


def process_of(information, size, rng, windows=40):
    information = np.broadcast_to(information, (windows, 4)).astype(float)
    noise = rng.normal(size=(windows, 4)) * np.sqrt(information)
    score = size * information + noise
    beside = score - information
    return ScoreProcess("some", score, information, score - 0.5 * information, beside, information)


def test_missing_ruptures_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "ruptures", None)
    said = f"'ruptures', which is not installed: run {how_to_install('diagnosis')}."
    with pytest.raises(InputError, match=re.escape(said)):
        change_points(np.zeros(60))


def test_spans_are_those_in_which_the_effect_acts():
    rng = np.random.default_rng(1)
    time = np.tile(2.0 * np.arange(20), 2)
    recording = np.repeat([0, 1], 20)
    acts = (recording == 1) & (time >= 20.0)
    process = process_of(4.0, acts[:, None].astype(float), rng)
    (span,) = spans(process, recording, time, 0.5, 2.0)
    assert span.recording == 1
    assert span.start == pytest.approx(20.0, abs=1.0)
    assert span.end == 40.0
    assert span.size == pytest.approx(1.0, abs=4.0 * span.deviation)
    assert time_share([span], 40, 2.0) == pytest.approx(0.25, abs=0.02)


def test_pieces_that_cannot_show_an_effect_belong_to_no_span():
    information = np.zeros((40, 4))
    information[10:13] = 30.0
    process = process_of(information, 1.0, np.random.default_rng(2))
    (span,) = spans(process, np.zeros(40, dtype=int), 2.0 * np.arange(40), 0.5, 2.0)
    assert (span.start, span.end) == (20.0, 26.0)
    assert span.share == pytest.approx(1.0)


def some_pieces(count=400, seed=0):
    rng = np.random.default_rng(seed)
    time = 0.5 * (np.arange(count) % 200)
    speed = 0.3 + 0.2 * np.sin(0.3 * time + (np.arange(count) >= 200))
    x = np.cumsum(speed) * 0.5 % 12.0
    values = {
        "speed": speed,
        "turning": rng.uniform(size=count),
        "heading": np.angle(np.exp(0.11j * time)),
        "time": time,
    }
    return Pieces(np.repeat([0, 1], count // 2), values, x, np.sin(x))


def test_a_regime_that_holds_the_weight_stands_out():
    pieces = some_pieces()
    rng = np.random.default_rng(5)
    fast = pieces.values["speed"] > 0.42
    lying = shares(np.where(fast, 3.0, 0.0) + rng.normal(size=400), pieces, rng)
    assert (lying[0].name, lying[0].stands_out) == ("speed", True)
    assert lying[0].low == pytest.approx(0.42, abs=0.03)
    assert lying[0].high is None
    assert lying[0].time_inside == pytest.approx(fast.mean(), abs=0.05)
    assert sum(lying[0].weight_share) == pytest.approx(1.0)
    assert "speeds above 0.4" in phrase_of(lying)


def test_a_place_that_holds_the_weight_stands_out():
    pieces = some_pieces()
    near = np.hypot(pieces.x - 3.0, pieces.y - np.sin(3.0)) < 0.9
    lying = shares(np.where(near, 5.0, 0.0), pieces, np.random.default_rng(5))
    assert lying[0].name == "place"
    x, y, radius = lying[0].edges
    assert np.hypot(x - 3.0, y - np.sin(3.0)) < 0.5
    assert radius <= 1.5
    assert phrase_of(lying).startswith("only within")


def test_a_fitted_band_is_a_place_with_a_line():
    band = parse_effect("soil_patch=0.8,centre_x=1.5,centre_y=-0.2,radius=0.9,half_length=7,bearing=2")
    places = _fitted_place(band)
    assert places == (Place(1.5, -0.2, 0.9, half_length=7.0, bearing=2.0),)
    assert phrase_of((), places) == "within 0.90 m of the middle line of a band through (1.5, −0.20) m"


def test_a_range_of_headings_may_wrap_around():
    pieces = some_pieces()
    behind = np.abs(pieces.values["heading"]) > 2.2
    lying = shares(behind.astype(float), pieces, np.random.default_rng(5))
    heading = next(item for item in lying if item.name == "heading")
    assert heading.low > 2.0
    assert heading.high < -2.0
    assert heading.weight_inside == pytest.approx(1.0)


def test_noise_makes_no_phrases():
    rng = np.random.default_rng(11)
    pieces = some_pieces()
    named = 0
    for _ in range(40):
        weight = 1.0 + np.convolve(rng.normal(size=420), np.ones(20) / 4.0, mode="same")[:400]
        named += phrase_of(shares(weight, pieces, rng), covered=1.0) != EVERYWHERE
    assert named <= 6  # 2 are expected at the level of 0.05; more than 6 have a probability of 0.003


def test_weights_without_a_sum_say_nothing():
    assert shares(-np.ones(400), some_pieces(), np.random.default_rng(0)) == ()
    assert phrase_of(()) == NOWHERE_MORE


def test_an_effect_of_two_sizes_is_uneven_and_one_of_one_size_is_not():
    pieces = some_pieces()
    rng = np.random.default_rng(8)
    information = np.full(400, 2.0)
    window = np.arange(400) // 4
    slow = pieces.values["speed"] < 0.25
    noise = rng.normal(size=400) * np.sqrt(2.0)
    remainder = information * (np.where(slow, 1.6, 0.7) - 1.0) + noise
    other = uneven(remainder, information, window, pieces, rng)
    assert other is not None
    assert other.name == "speed"
    assert max(other.size_inside, other.size_outside) == pytest.approx(1.6, abs=0.25)
    assert "not the same everywhere" in uneven_phrase(other)
    trials = [rng.normal(size=400) * np.sqrt(2.0) for _ in range(20)]
    assert sum(uneven(trial, information, window, pieces, rng) is not None for trial in trials) <= 4


def test_ranges_in_words():
    assert range_in_words("speed", 0.6, None) == "at speeds above 0.60 m/s"
    assert range_in_words("speed", None, -0.01) == "while driving backwards"
    assert range_in_words("command_change", None, 0.0) == "while commands are held"
    assert range_in_words("slip", 0.1, 0.35) == "at slips between 0.10 and 0.35"
    assert range_in_words("heading", 3.0, -3.0) == "while heading between 172 and −172 degrees"
    assert range_in_words("command", None, None) == EVERYWHERE


def test_channel_shares_by_hand():
    # mismatch above the floors: 100 (3 - 1) = 200 and 100 (1.5 - 0.8) = 70
    table = channel_shares({"a": 3.0, "b": 1.5}, {"a": 2.0, "b": 0.8}, {"a": 100.0, "b": 100.0})
    assert table["a"].share == pytest.approx(200.0 / 270.0)
    assert table["b"].floor == 0.8
    assert channel_shares({"a": 0.9}, {"a": 0.9}, {"a": 10.0})["a"].share == 0.0
