"""Shifts follow from scores: what t statistics of known numbers say."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from ddagr_gym.diagnosis.change.between_drives import degrees_of_freedom
from ddagr_gym.diagnosis.change.drive_scan import Compared, scattered
from ddagr_gym.diagnosis.change.expected_scatter import EXPECTED_DRIVES, ExpectedScatter
from ddagr_gym.diagnosis.change.ordinary import Comparison, Scores
from ddagr_gym.diagnosis.change.refitted_shift import refitted_shift, times_farther
from ddagr_gym.diagnosis.change.shifts import LEVEL, family_probability, shift_of, single_level
from ddagr_gym.diagnosis.change.sizes import explained, sizes_of, windows_in_effect
from ddagr_gym.diagnosis.result.detectable import least_multiple
from ddagr_gym.diagnosis.search.candidates import candidates_of
from ddagr_gym.physics.effects.base import DriveExtent
from ddagr_gym.physics.effects.gyro_bias import GyroBias
from ddagr_gym.physics.effects.gyro_sign import GyroSign
from ddagr_gym.physics.effects.pose_latency import PoseLatency

BIAS = Compared(candidates_of(GyroBias, DriveExtent(), 0)[0], ("gyro_bias 0",))
SIGN = Compared(candidates_of(GyroSign, DriveExtent(), 0)[0], ("gyro_sign 0",))

LEAST = least_multiple(BIAS.candidate, 0)
"""The least bias that matters, as a multiple of the probe."""


def scores(key: str, size: float, deviation: float, between: float = 0.0) -> Scores:
    """A drive that finds a size with a deviation, in multiples of the probe; ``between`` drives it may differ."""
    information = np.array([[deviation**-2.0]])
    spread = np.array([[between**2]]) * information**2
    return Scores((key,), information[0] * size, information, information, spread)


def against(*drives: Scores) -> Comparison:
    return Comparison(drives)


ALIKE = against(*(scores(BIAS.keys[0], size, 0.5) for size in (0.9, 1.0, 1.1)))
"""Ordinary drives that hardly differ."""


def test_the_size_and_its_deviations_come_back():
    found = sizes_of(scores(BIAS.keys[0], 3.0, 0.5, 0.2), BIAS.keys, BIAS.ridge)
    assert found.value[0] == pytest.approx(3.0, rel=1e-4)
    assert found.within[0, 0] == pytest.approx(0.25, rel=1e-4)
    assert found.between[0, 0] == pytest.approx(0.04, rel=1e-4)


def test_what_a_prior_leaves_open_counts_between_drives_alone():
    # readings know the sum of a bias and an effect to 0.01; the prior of the bias alone tells them apart, to 0.3
    readings, prior = 0.01**-2.0, 0.3**-2.0
    kept = readings * prior / (readings + prior)
    drive = Scores(
        BIAS.keys, np.array([kept * 2.0]), np.array([[kept]]), np.array([[0.0]]), np.array([[kept**2 / prior]])
    )
    found = sizes_of(drive, BIAS.keys, np.zeros(1))
    assert found.between[0, 0] == pytest.approx(0.3**2)
    assert found.within[0, 0] == pytest.approx(0.01**2, rel=0.01)


def test_an_ordinary_drive_of_which_little_was_known_counts_for_little():
    drive = scores(BIAS.keys[0], 10.0, 0.5, 0.5)
    sizes = (-0.5, 0.0, 0.5)
    known = [scores(BIAS.keys[0], size, 0.5, 0.5) for size in sizes]
    astray = [*known, scores(BIAS.keys[0], 8.0, 0.5, 0.5)]
    vague = [*known, scores(BIAS.keys[0], 8.0, 0.5, 8.0)]
    none, much, little = (shift_of(BIAS, drive, against(*drives)) for drives in (known, astray, vague))
    assert none.mean[0] == pytest.approx(0.0, abs=1e-6)
    assert much.mean[0] > 1.5 > 0.2 > little.mean[0]
    assert little.distance > 1.5 * much.distance


def test_ordinary_drives_that_scatter_widen_a_shift():
    drive = scores(BIAS.keys[0], 10.0, 0.5)
    alike = shift_of(BIAS, drive, against(*(scores(BIAS.keys[0], size, 0.5) for size in (0.9, 1.0, 1.1))))
    scattering = shift_of(BIAS, drive, against(*(scores(BIAS.keys[0], size, 0.5) for size in (-4.0, 1.0, 6.0))))
    assert alike.mean[0] == pytest.approx(1.0, rel=1e-3)
    assert alike.value[0] == pytest.approx(9.0, rel=1e-3)
    assert scattering.distance < 0.5 * alike.distance
    assert alike.degrees == pytest.approx(EXPECTED_DRIVES + 2.0)


def test_one_size_has_the_two_sided_probability_of_a_t_distribution():
    shift = shift_of(BIAS, scores(BIAS.keys[0], 10.0, 0.5), ALIKE)
    assert shift.probability == pytest.approx(2.0 * stats.t.sf(shift.distance, shift.degrees), rel=1e-6)
    assert shift.limit(30) == pytest.approx(stats.t.isf(0.5 * single_level(30), shift.degrees), rel=1e-6)
    assert family_probability(single_level(30), 30) == pytest.approx(LEVEL)


def test_the_least_detectable_size_passes_its_limit_four_times_in_five():
    shift = shift_of(BIAS, scores(BIAS.keys[0], 0.0, 0.5), ALIKE)
    away = shift.detectable(30)[0] / np.sqrt(shift.covariance[0, 0])
    assert stats.nct.sf(shift.limit(30), shift.degrees, away) == pytest.approx(0.8, abs=0.03)


def test_false_alarms_over_ordinary_drives_keep_the_level():
    """Drives that differ by 1, each known to 0.5: six of them against a seventh, without a floor that helps."""
    rng = np.random.default_rng(0)
    alarms = 0
    for _ in range(2000):
        sizes = rng.normal(0.0, np.hypot(4.0, 0.5), 7)
        drives = [scores(BIAS.keys[0], size, 0.5, 4.0) for size in sizes]
        alarms += shift_of(BIAS, drives[0], against(*drives[1:])).probability < LEVEL
    assert alarms / 2000 <= LEVEL + 3.0 * np.sqrt(LEVEL * (1.0 - LEVEL) / 2000)


def test_less_than_no_sign_change_is_no_shift():
    ordinary = [scores(SIGN.keys[0], size, 0.5) for size in (-0.1, 0.0, 0.1)]
    assert shift_of(SIGN, scores(SIGN.keys[0], -15.0, 0.5), against(*ordinary)).probability == 1.0
    assert shift_of(SIGN, scores(SIGN.keys[0], 20.0, 0.5), against(*ordinary)).probability < 1e-3


def test_a_drive_that_shows_nothing_has_no_shift():
    blind = Scores(BIAS.keys, np.zeros(1), np.zeros((1, 1)), np.zeros((1, 1)), np.zeros((1, 1)))
    ordinary = [scores(BIAS.keys[0], size, 0.5) for size in (-0.1, 0.0, 0.1)]
    assert shift_of(BIAS, blind, against(*ordinary)) is None
    assert shift_of(BIAS, ordinary[0], against(blind, ordinary[1])) is None


def test_a_large_size_does_not_count_as_scatter_of_the_windows_that_show_it():
    """Half of the windows turn: they alone show a gyro's scale."""
    rng = np.random.default_rng(1)
    informations = np.where(np.arange(40) % 2, 2.0, 0.0)[:, None, None]
    noise = rng.normal(size=(40, 1)) * np.sqrt(informations[:, :, 0])
    gradients = informations[:, :, 0] * 8.0 + noise
    whole = Scores(
        BIAS.keys, gradients.sum(axis=0), informations.sum(axis=0), scattered(gradients), np.zeros((1, 1)), gradients,
        informations,
    )  # fmt: skip
    sums = Scores(BIAS.keys, whole.gradient, whole.information, whole.within, whole.between)
    wide, narrow = (sizes_of(item, BIAS.keys, BIAS.ridge).within[0, 0] for item in (sums, whole))
    assert narrow == pytest.approx(1.0 / 40.0, rel=0.6)
    assert wide > 10.0 * narrow


def driven(rng: np.random.Generator, windows: int, between: float, kept: bool) -> Scores:
    """A drive in which nothing changed: windows that scatter twice as much as readings say, and differ by a day."""
    information = np.full((windows, 1, 1), 1.0 / windows)
    size = rng.normal(0.0, np.hypot(between, 0.2 * LEAST))
    gradients = information[:, :, 0] * size + 2.0 * rng.normal(size=(windows, 1)) * np.sqrt(information[:, :, 0])
    prior = np.array([[between**2]])
    sums = gradients.sum(axis=0), np.eye(1), scattered(gradients), prior
    return Scores(BIAS.keys, *sums, *((gradients, information) if kept else ()))


@pytest.mark.parametrize("between", [0.0, 1.0, 3.0])
def test_many_windows_give_degrees_of_freedom_and_keep_the_level(between):
    """By the few ordinary drives alone hardly any would be an alarm at the level of one of many tests."""
    rng, level, count = np.random.default_rng(3), single_level(5), 1500
    found = []
    for _ in range(count):
        drives = [driven(rng, 40, between, kept=k == 0) for k in range(4)]
        found.append(shift_of(BIAS, drives[0], against(*drives[1:])))
    alarms = sum(shift.probability < level for shift in found)
    fewer = sum(2.0 * stats.t.sf(shift.distance, shift.drives) < level for shift in found)
    assert fewer <= alarms <= count * level + 3.0 * np.sqrt(count * level)
    assert all(EXPECTED_DRIVES < shift.drives <= EXPECTED_DRIVES + 2.0 for shift in found)
    assert all(shift.degrees >= shift.drives for shift in found)
    if between < 2.0:
        assert np.median([shift.degrees for shift in found]) > 20.0
        assert alarms >= 3 * fewer + 3


def test_degrees_of_freedom_are_those_of_what_is_known_worst():
    """Of two sizes, one that only drives scatter and one that only the windows tell."""
    between = np.diag([1.0, 0.0])
    assert degrees_of_freedom(np.eye(2), between, 6.0, 40.0) == pytest.approx(6.0)
    assert degrees_of_freedom(np.eye(1), np.zeros((1, 1)), 6.0, 40.0) == pytest.approx(39.0)
    assert degrees_of_freedom(np.eye(1), 0.5 * np.eye(1), 6.0, 40.0) == pytest.approx(1.0 / (0.25 / 6.0 + 0.25 / 39.0))
    assert degrees_of_freedom(np.eye(1), np.zeros((1, 1)), 26.0, 12.0) == 26.0
    assert degrees_of_freedom(np.eye(1), np.zeros((1, 1)), 6.0, 0.0) == 6.0


CALIBRATED = ExpectedScatter({}, 24.0).of_calibrations
"""As simulated pairs tell it, for a robot with ordinary drives of its own."""


def test_ordinary_drives_that_agree_with_the_expectation_have_its_degrees_of_freedom():
    """Scatter of a fifth of the least size is expected: three drives scatter by half of it, or by four times it."""
    drive = scores(BIAS.keys[0], 10.0 * LEAST, 0.02 * LEAST)
    alike, apart = (
        tuple(scores(BIAS.keys[0], size * LEAST, 0.02 * LEAST) for size in (-spread, 0.0, spread))
        for spread in (0.1, 0.8)
    )
    agreeing, scattering = (shift_of(BIAS, drive, Comparison(found, expected=CALIBRATED)) for found in (alike, apart))
    assert agreeing.drives == pytest.approx(26.0)
    assert scattering.drives == pytest.approx(EXPECTED_DRIVES + 2.0)
    # no less than what is expected, even where the drives agree better
    assert np.sqrt(agreeing.between[0, 0]) == pytest.approx(0.2 * np.sqrt(4.0 / 3.0) * LEAST, rel=0.01)
    assert shift_of(BIAS, drive, Comparison(alike)).drives == pytest.approx(EXPECTED_DRIVES + 2.0)


def test_a_single_ordinary_drive_agrees_with_nothing():
    drive, ordinary = (scores(BIAS.keys[0], size, 0.02 * LEAST) for size in (10.0, 0.0))
    assert shift_of(BIAS, drive, Comparison((ordinary,), expected=CALIBRATED)).drives == EXPECTED_DRIVES


def test_windows_that_show_nothing_do_not_count():
    shares = np.concatenate([np.full((10, 1, 1), 2.0), np.zeros((30, 1, 1))])
    assert windows_in_effect(shares) == pytest.approx(10.0)


MEASURED = ExpectedScatter({"gyro_bias": 2.0}, 9.0)
"""As measured in simulated pairs."""


def test_one_drive_from_before_has_the_scatter_that_was_measured():
    """Both drives scatter by two least sizes, and are known to a tenth of one."""
    before, after = (scores(BIAS.keys[0], size * LEAST, 0.1 * LEAST) for size in (1.0, 11.0))
    shift = shift_of(BIAS, after, Comparison((before,), expected=MEASURED))
    assert shift.degrees == 9.0
    assert shift.value[0] == pytest.approx(10.0 * LEAST, rel=1e-3)
    assert np.sqrt(shift.covariance[0, 0]) == pytest.approx(np.sqrt(2.0 * (2.0**2 + 0.1**2)) * LEAST, rel=1e-3)


def test_pieces_widen_the_scatter_of_one_drive_and_never_narrow_it():
    before, after = (scores(BIAS.keys[0], size * LEAST, 0.1 * LEAST) for size in (1.0, 11.0))

    def deviation(*sizes: float) -> float:
        pieces = tuple(scores(BIAS.keys[0], size * LEAST, 0.1 * LEAST) for size in sizes)
        return float(np.sqrt(shift_of(BIAS, after, Comparison((before,), pieces, MEASURED)).covariance[0, 0]))

    assert deviation(1.0, 1.0, 1.0, 1.0) == pytest.approx(deviation(), rel=1e-6)
    # four pieces that scatter by 9 least sizes: three degrees of freedom beside the nine of what is expected
    scatter = np.var([-9.0, 9.0, -9.0, 9.0], ddof=1) - 0.1**2
    expected = 2.0**2 + 3.0 / 12.0 * (scatter - 2.0**2)
    assert deviation(-9.0, 9.0, -9.0, 9.0) == pytest.approx(np.sqrt(2.0 * (expected + 0.1**2)) * LEAST, rel=1e-2)


def test_a_refit_finds_the_size_that_a_first_step_found_in_part():
    """A bias of 0.03 rad/s is fitted, and the drive alone would go 0.002 further."""
    before = shift_of(BIAS, scores(BIAS.keys[0], 4.0, 0.5), ALIKE)
    away = BIAS.candidate.probes[0].bias
    refit = scores("named 0", 0.002, 0.1 * away)
    found = refitted_shift(before, GyroBias(0.03), {"bias": "named 0"}, refit, stretched=True)
    assert found.value[0] == pytest.approx(0.032 / away - before.mean[0], rel=1e-6)
    farther = 0.032 / away / 4.0
    assert farther > 1.0
    assert found.covariance[0, 0] == pytest.approx(0.01 + farther**2 * before.between[0, 0], rel=1e-3)
    assert found.distance > before.distance
    assert found.probability < before.probability
    agreeing = shift_of(BIAS, scores(BIAS.keys[0], 4.0, 0.5), Comparison(ALIKE.drives, expected=CALIBRATED))
    assert agreeing.drives > 20.0
    refits = [refitted_shift(agreeing, GyroBias(0.03), {"bias": "named 0"}, refit, way) for way in (True, False)]
    assert [item.degrees for item in refits] == pytest.approx([EXPECTED_DRIVES + 2.0, agreeing.drives], rel=0.01)
    plain = refitted_shift(before, GyroBias(0.03), {"bias": "named 0"}, refit)
    assert plain.covariance[0, 0] == pytest.approx(0.01 + before.between[0, 0], rel=1e-6)


def test_a_refit_that_ran_to_the_bound_of_what_exists_says_no_size():
    before = shift_of(BIAS, scores(BIAS.keys[0], 4.0, 0.5), ALIKE)
    refit = scores("named 0", 0.002, 0.01)
    data = GyroBias.parameter("bias").metadata
    for bound in (data["low"], data["high"]):
        assert refitted_shift(before, GyroBias(bound), {"bias": "named 0"}, refit) is None
        assert refitted_shift(before, GyroBias(0.9 * bound), {"bias": "named 0"}, refit) is not None
    # at nothing, which is the bound of what has no sign, a size is known
    late = Compared(candidates_of(PoseLatency, DriveExtent(), 0)[0], ("pose_latency 0",))
    usual = shift_of(late, scores(late.keys[0], 4.0, 0.5), against(*(scores(late.keys[0], 0.0, 0.5),) * 3))
    assert refitted_shift(usual, PoseLatency(0.0), {"latency": "named 0"}, refit) is not None


@pytest.mark.parametrize("times", [0.5, 1.0, 2.5, -2.5])
def test_a_refit_goes_so_many_times_as_far_as_a_first_step(times):
    before = shift_of(BIAS, scores(BIAS.keys[0], 4.0, 0.5), ALIKE)
    refit = GyroBias(times * 4.0 * BIAS.candidate.probes[0].bias)
    assert times_farther(before, refit) == pytest.approx(max(abs(times), 1.0))


def test_what_is_there_or_not_goes_no_farther():
    before = shift_of(SIGN, scores(SIGN.keys[0], 0.5, 0.01), against(*(scores(SIGN.keys[0], 0.0, 0.01),) * 3))
    assert times_farther(before, GyroSign(1.0)) == 1.0


def test_what_is_there_or_not_has_no_refitted_size():
    before = shift_of(SIGN, scores(SIGN.keys[0], 0.5, 0.01), against(*(scores(SIGN.keys[0], 0.0, 0.01),) * 3))
    assert refitted_shift(before, GyroSign(1.0), {}, scores("named 0", 0.0, 1.0)) is None


def test_parameters_that_ordinary_drives_move_far_need_to_move_farther():
    """Weight 4 of the prior, three drives with moves of 3, so r.m.s. sqrt((4 + 27)/7); never below 1."""
    moved = Comparison(ALIKE.drives, moved=({"a": 3.0, "b": 0.1},) * 3)
    assert EXPECTED_DRIVES == 4.0
    assert moved.usual_move("a") == pytest.approx(np.sqrt(31.0 / 7.0))
    assert moved.usual_move("b") == 1.0
    assert moved.usual_move("absent") == 1.0


def test_how_far_parameters_move_is_known_as_well_as_from_the_drives_and_the_prior_whatever_effects_do():
    measured = Comparison(ALIKE.drives, expected=ExpectedScatter({}, 24.0), moved=({"a": 3.0},) * 3)
    assert measured.move_degrees == EXPECTED_DRIVES + 2.0
    assert measured.usual_move("a") == pytest.approx(np.sqrt(31.0 / 7.0))


def test_where_moves_were_measured_their_degrees_are_those_of_the_measurement():
    expected = ExpectedScatter({}, 16.0, {"a": 2.0})
    measured = Comparison(ALIKE.drives, expected=expected, moved=({"a": 3.0, "b": 0.0},) * 3)
    assert measured.move_degrees == 18.0
    assert measured.usual_move("a") == pytest.approx(np.sqrt((4.0 * 2.0**2 + 27.0) / 7.0))
    assert measured.usual_move("b") == 1.0


def test_a_drive_that_shows_nothing_of_an_effect_explains_nothing_by_it():
    blind = Scores(SIGN.keys, *(np.zeros(shape) for shape in ((1,), (1, 1), (1, 1), (1, 1))))
    assert explained(blind, SIGN.keys, SIGN.ridge) == 0.0
    seeing = scores(SIGN.keys[0], 2.0, 0.5)
    assert explained(seeing, SIGN.keys, np.zeros(1)) == pytest.approx(0.5 * (2.0 / 0.5) ** 2)


def test_an_ordinary_drive_that_was_not_asked_for_an_effect_says_nothing_of_it():
    """Poses in frames of their own leave slopes and places out of a drive's scan."""
    other = scores("payload 0", 1.0, 0.5)
    assert sizes_of(other, BIAS.keys, BIAS.ridge) is None
    assert explained(other, BIAS.keys, BIAS.ridge) == 0.0
    drive = scores(BIAS.keys[0], 3.0, 0.5)
    mixed, alone = (shift_of(BIAS, drive, against(*drives)) for drives in ((*ALIKE.drives, other), ALIKE.drives))
    assert mixed.distance == alone.distance
