"""The answer on many drives: their order, the first at which something changed, and what."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ddagr_gym.diagnosis.answer.drive_series import BY_NAME, BY_TIME, PASSES, SINGLE, STAYS
from ddagr_gym.diagnosis.series.change_points import Sizes
from ddagr_gym.diagnosis.series.conclusion import _is_small, conclude_series, drive_row, in_order, natural
from ddagr_gym.diagnosis.series.files import load, save
from ddagr_gym.errors import InputError
from ddagr_gym.reporting.drive_series_page import _tiles, write_page
from ddagr_gym.reporting.drive_series_text import drives_csv, series_text
from tests.diagnosis.series.made_points import answer

DAY = 86400.0
MAY = 1.7776e9
ORDINARY = SimpleNamespace(robot=SimpleNamespace(name="ddagr"), source="cal", references=(SimpleNamespace(drive="a"),))


def series(shifts, names=(), started=True):
    """Drives whose first size is shifted, with the names that each answer has; None stands for a refused one."""
    rng = np.random.default_rng(0)
    rows, points = [], []
    for number, shift in enumerate(shifts):
        values = 0.3 * rng.normal(size=6)
        values[0] += shift or 0.0
        named = names[number] if number < len(names) else ()
        found = answer(values, *named, started=MAY + number * DAY if started else 0.0)
        rows.append(drive_row(f"run_{number + 1}.csv", "0", "no such column." if shift is None else found))
        points.append(() if shift is None else found.points)
    return conclude_series(rows, points, BY_TIME if started else BY_NAME, ORDINARY, "")


def test_a_change_that_stays_is_said_with_its_first_drive_name_and_size():
    named = [()] * 6 + [("gyro_bias",)] * 4
    found = series([0.0] * 5 + [None] + [14.0] * 4, named)
    (event,) = found.events
    assert (event.kind, event.drive, event.drives, event.names) == (STAYS, 6, 4, {"gyro_bias": 4})
    assert not event.small
    assert found.sentence == (
        "From drive 7 of 10 (run_7.csv, 2026-05-07) on something changed, and stays: gyro bias (bias 0.020 rad/s), "
        "named in 4 of 4 drives. 1 of 10 was refused; the table says why."
    )
    assert found.charts[0].effect == "gyro_bias"


def test_a_change_without_a_name_says_what_moved_most():
    found = series([0.0] * 8 + [9.0] * 8)
    assert "no effect is named in most of these drives; most moves gyro bias (size +9.0)" in found.sentence


def test_drives_of_one_event_with_different_names_have_each_their_own():
    found = series([0.0] * 5 + [14.0] * 2 + [0.0] * 5, [()] * 5 + [("gyro_bias",), ("payload",)])
    (event,) = found.events
    assert (event.kind, event.drives) == (PASSES, 2)
    said = "its drives have different names, gyro bias (bias 0.020 rad/s) in drive 6 and payload (bias 0.020 rad/s) in "
    assert said + "drive 7." in found.sentence
    assert "most moves" not in found.sentence
    few = series([0.0] * 5 + [14.0] * 4 + [0.0] * 5, [()] * 5 + [("gyro_bias",)])
    assert "most moves gyro bias (size +14); named is gyro bias (bias 0.020 rad/s) in drive 6." in few.sentence


def test_only_a_change_that_stays_is_the_first_of_the_tile():
    label = "first drive of a change that stays"
    over, stays = series([0.0] * 5 + [14.0] * 5 + [0.0] * 5), series([0.0] * 5 + [14.0] * 5)
    assert [dict(map(reversed, _tiles(item)))[label] for item in (over, stays)] == ["none", "6"]


def test_a_small_change_is_said_to_be_within_ordinary_drives():
    found = series([0.0] * 20 + [3.4] * 40)
    (event,) = found.events
    assert event.small
    assert not any(point.outside for point in found.charts[0].points)
    assert "less than what single ordinary drives differ by" in found.sentence


def test_an_odd_drive_is_no_change():
    found = series([0.0, 0.0, 14.0, 0.0, 0.0], [(), (), ("payload",)])
    assert [event.kind for event in found.events] == [SINGLE]
    assert found.sentence.startswith("Nothing changed over 5 drives but in single ones. Drive 3 of 5 (run_3.csv")


def test_a_change_that_ends_is_said_to_be_over():
    found = series([0.0] * 5 + [14.0] * 5 + [0.0] * 5)
    (event,) = found.events
    assert (event.kind, event.drive, event.last, event.drives) == (PASSES, 5, 9, 5)
    said = "From drive 6 of 15 (run_6.csv, 2026-05-06) to 10 of 15 (run_10.csv, 2026-05-10) something was different"
    assert said in found.sentence


def test_a_name_that_no_other_drive_bears_out_is_beside_what_chance_makes():
    found = series([0.0] * 20, [(), ("slope",)])
    assert not found.events
    said = "Drive 2 is out of the ordinary by its own answer, which is no event of the series; by chance 1.0 of so many"
    assert said in found.sentence


def test_nothing_changed_and_nothing_answered():
    assert series([0.0] * 4).sentence == "Nothing changed over 4 drives that they could show."
    assert series([None, None]).sentence == "None of the 2 drives could be compared."


def test_drives_are_in_the_order_of_time_where_all_have_a_clock():
    rows = [drive_row(name, "0", answer([0.0], started=t)) for name, t in (("b", MAY), ("a", MAY + DAY))]
    rows.append(drive_row("0", "0", "refused."))
    assert in_order(rows) == (BY_TIME, [0, 1, 2])
    rows.append(drive_row("c", "0", answer([0.0], started=120.0)))  # a clock that counts from the start
    assert in_order(rows) == (BY_NAME, [2, 1, 0, 3])


@pytest.mark.parametrize("wild", [3e11, 1e18, float("inf"), float("nan"), -3e11])
def test_a_wild_clock_gives_no_date(wild):
    assert drive_row("a", "0", answer([0.0], started=wild)).started is None


def test_numbers_in_names_sort_as_numbers():
    assert sorted(["run_10.csv", "run_9.csv", "Run_1.csv"], key=natural) == ["Run_1.csv", "run_9.csv", "run_10.csv"]


def test_the_answer_survives_its_file(tmp_path):
    found = series([0.0] * 5 + [None] + [14.0] * 4, [()] * 6 + [("gyro_bias",)] * 4)
    save(found, tmp_path / "drives.json")
    again = load(tmp_path / "drives.json")
    assert again.events == found.events
    assert again.charts == found.charts
    assert [row.sentence for row in again.rows] == [row.sentence for row in found.rows]
    (tmp_path / "drives.json").write_text('{"schema": "ddagr-drives/0"}')
    with pytest.raises(InputError, match="has schema 'ddagr-drives/0' and this version reads 'ddagr-drives/1'"):
        load(tmp_path / "drives.json")


def test_text_table_and_page_have_every_drive(tmp_path):
    pytest.importorskip("matplotlib", reason="needs the extra report")
    pytest.importorskip("jinja2", reason="needs the extra report")
    found = series([0.0] * 5 + [None] + [14.0] * 4, [()] * 6 + [("gyro_bias",)] * 4)
    said = series_text(found)
    assert "run_6.csv: no such column." in said
    assert "bias 0.020 rad/s (0.010 to 0.030)" in said
    lines = drives_csv(found).splitlines()
    assert len(lines) == 11
    assert lines[7].split(",")[9:15] == ["gyro_bias", "bias", "0.02", "0.01", "0.03", "rad/s"]
    write_page(tmp_path, found)
    page = (tmp_path / "index.html").read_text()
    assert page.count("<figure>") == 1 + len(found.charts)
    assert "http" not in page.replace("http-equiv", "")


def test_a_page_of_nothing_but_refused_drives(tmp_path):
    pytest.importorskip("matplotlib", reason="needs the extra report")
    pytest.importorskip("jinja2", reason="needs the extra report")
    write_page(tmp_path, series([None, None]))
    assert "None of the 2 drives could be compared." in (tmp_path / "index.html").read_text()


def test_drives_that_do_not_show_a_size_do_not_widen_what_is_usual():
    """A size that three drives in four do not have keeps its own scale, here a hundredth of the others'."""
    values = np.full((8, 1), np.nan)
    values[[0, 4]] = 0.3
    deviations = np.where(np.isfinite(values), 0.01, 1.0)
    sizes = Sizes(values, deviations, np.array([0.005]), np.array([9.0]))
    event = SimpleNamespace(
        place=SimpleNamespace(first=0, end=8), shifts=np.array([0.3]), probabilities=np.array([1e-9])
    )
    assert not _is_small(event, sizes)
    assert _is_small(SimpleNamespace(**{**vars(event), "shifts": np.array([0.01])}), sizes)
