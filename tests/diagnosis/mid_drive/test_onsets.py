"""Effects that are switched on in a simulated drive, and the sentence and the picture of them."""

from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.answer.onset import Onset, TimedSize
from ddagr_gym.diagnosis.mid_drive import search_in_time
from ddagr_gym.diagnosis.mid_drive.change_in_time import FEWEST_ASIDE
from ddagr_gym.diagnosis.mid_drive.onsets import THRESHOLD, onsets_of, spells_of
from ddagr_gym.diagnosis.mid_drive.search_in_time import ALIKE, SpellGain, best_spells, parts_tried, spell_gains
from ddagr_gym.diagnosis.result.sentences import onset_in_words
from ddagr_gym.diagnosis.search.gains import gains
from ddagr_gym.diagnosis.search.scan import scan
from ddagr_gym.identification.gauss_newton import fit
from ddagr_gym.identification.nuisances import TILT
from ddagr_gym.identification.spells import Spell
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.physics.effects.registry import effect_kinds

BIAS, TIME = 0.02, 13.1
KINDS = ("gyro_bias", "imu_tilt", "payload")


@pytest.fixture(scope="module")
def plain(drive):
    return drive()


@pytest.fixture(scope="module")
def biased(plain, problem_of):
    """A gyro whose zero jumps at 13.1 s of 24 s: its problem and the fit without effects."""
    late = plain.t >= TIME
    channels = {**plain.channels, "yaw_rate": plain["yaw_rate"] + BIAS * late}
    problem = problem_of(replace(plain, channels=channels))
    problem.prior[[p.name for p in problem.nuisances.parameters].index(TILT)] = 0.0  # known to be none
    return problem, fit(problem, iterations=4)


@pytest.fixture(scope="module")
def constant(biased):
    """The same with a bias that holds all along, which is what a search without time finds."""
    problem, nominal = biased
    return fit(problem, replace(nominal.point, effects=load_effects(f"gyro_bias={0.5 * BIAS}")), first=nominal)


def test_a_bias_that_begins_is_timed(biased, constant):
    problem, _ = biased
    spells = spells_of(problem, constant)
    assert spells.keys() == {"gyro_bias"}
    assert not spells["gyro_bias"].ends
    parts = problem.during(spells)
    final = fit(parts, constant.point)
    assert final.cost < constant.cost
    assert final.point.effects[0].bias == pytest.approx(BIAS, rel=0.1)
    onset = onsets_of(parts, final)["gyro_bias"]
    assert onset.kind == "begins"
    assert onset.interval[0] <= TIME <= onset.interval[1]
    assert onset.evidence > THRESHOLD
    sizes = np.array([item.size for item in onset.sizes if item.start >= TIME])
    assert sizes == pytest.approx(np.ones(len(sizes)), abs=0.25)
    assert [item.size for item in onset.sizes if item.end <= TIME] == pytest.approx([0.0] * 6, abs=0.25)


def test_a_bias_that_holds_all_along_is_constant(plain, problem_of):
    channels = {**plain.channels, "yaw_rate": plain["yaw_rate"] + BIAS}
    problem = problem_of(replace(plain, channels=channels))
    nominal = fit(problem, iterations=4)
    fitted = fit(problem, replace(nominal.point, effects=load_effects(f"gyro_bias={BIAS}")), first=nominal)
    assert spells_of(problem, fitted) == {}
    onset = onsets_of(problem, fitted)["gyro_bias"]
    assert (onset.kind, onset.value, onset.interval) == ("constant", None, None)
    assert onset.sizes


@pytest.fixture(scope="module")
def terms(biased):
    problem, nominal = biased
    return scan(problem, nominal, {name: effect_kinds()[name] for name in KINDS})


def test_the_scan_in_parts_finds_name_and_time(biased, terms):
    problem, _ = biased
    candidates = [(item, item.columns) for item in terms.candidates]
    windows = problem.blocked.windows
    found = spell_gains(terms, candidates, windows, 1.0)
    assert found[0].name == "gyro_bias"
    assert found[0].gain > 1.5 * found[0].constant
    spell = best_spells(terms, candidates, windows, 1.0, found[0].constant)["gyro_bias"]
    assert not spell.ends
    assert abs(spell.time - TIME) <= windows.duration
    assert best_spells(terms, candidates, windows, 1.0, 10.0 * found[0].gain) == {}


def test_effects_that_explain_about_alike_are_tried_in_parts_together(monkeypatch):
    """What might begin at any time is freer than a rival that might not."""
    listed = [
        SpellGain("towed_drag", Spell(0, 30.0), 500.0, 20.0),
        SpellGain("viscous_drag", Spell(0, 34.0), 500.0 * ALIKE + 1.0, 20.0),
        SpellGain("slope", Spell(0, 34.0), 490.0, 489.0),
        SpellGain("payload", Spell(0, 30.0), 500.0 * ALIKE - 1.0, 20.0),
    ]
    monkeypatch.setattr(search_in_time, "spell_gains", lambda *_: listed)
    assert best_spells(None, [], None, 1.0, 0.0) == {"towed_drag": Spell(0, 30.0), "viscous_drag": Spell(0, 34.0)}


def test_parts_begin_or_end_where_enough_windows_are_on_either_side(biased):
    windows = biased[0].blocked.windows
    count = windows.count
    assert parts_tried(windows) == 2 * (count - 2 * FEWEST_ASIDE + 1)
    assert parts_tried(windows.subset(np.arange(2 * FEWEST_ASIDE - 1))) == 1


def test_all_along_the_scan_in_parts_is_the_scan(biased, terms):
    problem, _ = biased
    candidates = [(item, item.columns) for item in terms.candidates]
    by_name = {item.name: item.gain for item in gains(terms)}
    for item in spell_gains(terms, candidates, problem.blocked.windows, 1.0):
        assert item.constant == pytest.approx(by_name[item.name], rel=1e-9)


def onset(kind, **changes):
    sizes = (TimedSize(0, 0.0, 20.0, 0.0, 0.1), TimedSize(0, 20.0, 40.0, 1.0, 0.1))
    return replace(Onset(kind, 20.0, (18.0, 22.0), 0, 0.0, 1.0, 30.0, THRESHOLD, sizes), **changes)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (onset("constant", value=None, interval=None), ""),
        (onset("begins"), ", from 20 s (18 to 22 s) of the drive on"),
        (onset("ends", recording=1), ", until 20 s (18 to 22 s) of drive 2"),
        (
            onset("steps", before=0.4, after=1.6),
            ", 0.4 times that before 20 s (18 to 22 s) of the drive and 1.6 times after it",
        ),
        (
            onset("drifts", value=None, interval=None, after=2.0),
            ", drifting from 0.0 to 2.0 times that in the course of the drive",
        ),
    ],
)
def test_the_time_in_words(given, words):
    assert onset_in_words(given) == words


def test_the_figure_marks_the_time():
    pytest.importorskip("matplotlib", reason="needs the extra report")
    from ddagr_gym.diagnosis.answer.verdict import Finding
    from ddagr_gym.reporting.onset_figure import onset_figure, timed

    finding = Finding("gyro_bias", {}, 10.0, 5.0, 3.0, 8.0, onset=onset("begins"))
    assert timed([replace(finding, onset=None)]) == []
    (axis,) = onset_figure([finding], ["drive.csv"]).axes
    assert axis.get_title() == "drive.csv"
    assert any(list(line.get_xdata()) == [20.0, 20.0] for line in axis.get_lines())
