"""The page of a diagnosis: complete, escaped, self-contained, and at home on desks, phones and paper."""

import base64
import re
from dataclasses import replace

import numpy as np
import pytest

from ddagr_gym import simulate
from ddagr_gym.diagnosis.answer.verdict import DataDoubt, GatesUsed
from ddagr_gym.diagnosis.preprocessing.repeated_readings import RepeatedReadings
from ddagr_gym.diagnosis.result.channel_fault_findings import repeat_findings
from ddagr_gym.physics.effects.registry import effect_kinds
from ddagr_gym.reporting.diagnosis_figures import MOST_BARS, MOST_POINTS, _bars, channel_figure, thinned
from ddagr_gym.reporting.diagnosis_page import PAGE, PICTURES, _Studio, write_report
from ddagr_gym.reporting.diagnosis_tables import (
    checks,
    condition_rows,
    detectable,
    finding_card,
    fit_table,
    gate_note,
    next_drive,
    shown_gates,
    sources,
    tiles,
    unnamed,
)
from ddagr_gym.reporting.figures import house_style

from .browser import Browser, find_browser
from .made_diagnosis import HOSTILE, diagnosis, entries, evidence, later_entries

pytest.importorskip("matplotlib", reason="needs the extra report")
pytest.importorskip("jinja2", reason="needs the extra report")


def test_what_comes_nearest_is_no_finding(words_alone):
    (nearest,) = entries()["findings"]
    unknown = diagnosis(verdict=["unknown"], complete=False, findings=[], rejected=[nearest])
    text = words_alone(unknown, evidence())
    assert "What comes nearest" in text
    assert "<b>Sloping ground:</b> gain 80" in text
    assert 'id="findings"' not in text


def test_a_soil_has_a_table_of_what_it_does(words_alone):
    (found,) = entries()["findings"]
    quantity = {
        "name": "traction", "unit": "N", "first": 60.0, "first_interval": [50.0, 70.0], "second": 80.0,
        "second_interval": [70.0, 90.0], "change": -0.25, "change_interval": [-0.3, -0.2],
    }  # fmt: skip
    point = {"speed": 0.15, "slip": 0.2, "slip_angle": 0.25, "load": 410.0}
    soil = {
        "first": "in the patch", "second": "outside it", "point": point, "quantities": [quantity], "correlation": 0.9,
        "told_apart": False,
    }  # fmt: skip
    text = words_alone(diagnosis(findings=[found | {"soil": soil}]), evidence())
    assert "What the soil does under a wheel" in text
    assert "<td>−25 % (−30 to −20)</td><td>60 N (50 to 70)</td><td>80 N (70 to 90)</td>" in text
    assert "gives 20 to 30 % less traction than outside it (its strength and stiffness cannot be told apart)" in text


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A report with every section."""
    made = tmp_path_factory.mktemp("report")
    write_report(made, diagnosis(**later_entries()), evidence())
    return made


@pytest.fixture(scope="module")
def page(folder):
    return (folder / PAGE).read_text()


def test_the_share_of_what_is_explicable_is_said_with_its_horizon(page):
    assert "91 % (85 % to 95 %) after 30 s" in page
    assert "of what is explicable where no size was fitted, 30 s ahead" in page


def test_the_answer_comes_first_and_every_section_is_there(page):
    headings = re.findall(r"<h[12]>(.*?)</h[12]>", page)
    assert headings[0] == "The ground slopes 3.7 ± 0.3 degrees."
    assert headings[1] == "The recordings themselves"
    assert len(headings) == len(set(headings)) == 14
    for words in (
        "slopes 3.7 ± 0.3 degrees, rising towards 32 ± 3 degrees", "uphill", "71 %", "square_both_ways",
        "sloping ground from accelerometer bias", "over the closest other explanation by 0.97",
        "0.57 degrees", "none, however large", "120 null drives", "f" * 64,
        "p = 0.0040", "85 % to 95 %",
    ):  # fmt: skip
        assert words in page, words


def test_names_from_recordings_are_escaped(page):
    assert "<script" not in page
    assert page.count("&lt;script&gt;alert(&#39;$x_1$&#39;)&lt;/script&gt;") >= 4


def test_the_page_is_one_small_file_that_points_nowhere(page):
    assert len(page.encode()) < 2_000_000
    sources = re.findall(r'(?:src|href)="([^"]*)"', page)
    assert sources
    assert all(source.startswith("data:") for source in sources)
    assert not re.search(r"https?://", page)


def test_the_page_of_a_long_drive_stays_small(tmp_path):
    """Half an hour of drive, at which the pictures of the paths alone were 3 MB."""
    write_report(tmp_path, diagnosis(**later_entries()), evidence(windows=900))
    assert len((tmp_path / PAGE).read_bytes()) < 2_000_000


def test_paths_are_thinned_and_keep_the_ends_of_their_windows():
    short, long, longest = (evidence(windows=count) for count in (100, 900, 5000))
    assert thinned(short).shape == (100, 20, 2)
    for drawn, whole in ((thinned(long), long), (thinned(longest), longest)):
        np.testing.assert_array_equal(drawn[:, [0, -1]], whole.path[:, [0, -1], :2])
    assert thinned(long).shape[0] * thinned(long).shape[1] <= MOST_POINTS
    assert thinned(longest).shape[1] == 2


def test_scores_of_a_long_drive_are_drawn_together():
    made = evidence(windows=900)
    start, end, standard = _bars(made, 0, 1)
    together = -(-900 * 4 // MOST_BARS)
    assert len(start) == 1800 // together <= MOST_BARS
    np.testing.assert_allclose(end[:-1], start[1:])
    expected = made.score[0, 450:].ravel()[:together].sum() / np.sqrt(together)
    assert standard[0] == pytest.approx(expected)
    assert len(_bars(evidence(windows=12), 0, 0)[0]) == 24


def test_pictures_are_whole_and_named(folder, page):
    images = re.findall(r'<img src="data:image/svg\+xml;base64,([^"]*)" alt="([^"]+)"', page)
    assert len(images) == len(list((folder / PICTURES).glob("*.png"))) == 20
    for data, _ in images:
        assert base64.b64decode(data).rstrip().endswith(b"</svg>")
    assert len({alt for _, alt in images}) == 20


def test_later_steps_may_be_absent(tmp_path):
    bare = diagnosis(findings=[], verdict=["none"], sentence="Nothing is missing.", detectable={}, nuisances={})
    empty = evidence()
    empty.measured[..., 3:] = np.nan
    for name, value in (("findings", ()), ("score", np.zeros((0, 12, 4))), ("information", np.zeros((0, 12, 4)))):
        object.__setattr__(empty, name, value)
    object.__setattr__(empty, "gain", np.zeros((0, 12, 4)))
    object.__setattr__(empty, "gates", np.full(2, np.nan))
    write_report(tmp_path, bare, empty)
    text = (tmp_path / PAGE).read_text()
    for absent in (
        "What to drive next", "What has no name", "not fitted to", "When it shows", "could have shown",
        "recordings themselves",
    ):  # fmt: skip
        assert absent not in text
    assert "No operating condition stands out" in text


def test_currents_are_drawn_where_the_drivetrain_was_not_asked_for(tmp_path):
    drive = simulate("straight").recording
    drive = replace(drive, channels={**drive.channels, "current_left": 2.0 + np.sin(drive.t)})
    write_report(
        tmp_path,
        diagnosis(findings=[], verdict=["none"], sentence="Nothing is missing."),
        evidence(),
        recordings=[drive],
    )
    text = (tmp_path / PAGE).read_text()
    assert "Currents and voltages as recorded" in text
    assert "its page" not in text


def test_the_same_evidence_gives_the_same_picture(tmp_path):
    with house_style():
        twice = [
            _Studio(tmp_path, lambda name: None).picture(channel_figure(evidence(), "pose_yaw", np.arange(5)), name, "")
            for name in ("a", "b")
        ]
    assert twice[0] == twice[1]
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_the_note_on_the_fit_stands_above_its_errors(page):
    section = page[page.index("How well it predicts what its sizes were not fitted to") :]
    words = (
        "on each recording, by models whose sizes were fitted to the others",
        "Decided on all drives of &lt;script",
    )
    assert section.index(words[0]) < section.index(words[1]) < section.index("yaw rate after 30 s")
    assert not re.search("has not seen|held out from|unseen drives", page)


def test_what_judges_the_fit_is_said_as_it_was():
    fit = replace(diagnosis(**later_entries()).fit, folds="by time", note="One recording.")
    halves = fit_table(fit)
    assert "each half of the one recording" in halves["judged"]
    assert halves["note"] == "One recording."


def test_what_is_wrong_with_the_data_comes_before_everything_but_the_answer(page):
    start = page.index("The recordings themselves")
    assert page.index('class="tiles"') < start < page.index('id="findings"')
    assert "<b>run_2.csv, &lt;script&gt;alert(" in page[start:]
    assert ":</b> It never changes.</p>" in page[start:]


def test_doubts_about_the_data_name_their_place():
    doubts = [
        DataDoubt("a.csv", "", "schema", "Its clock has gaps."),
        DataDoubt("", "gyro", "rotation_rate", "Over 2 runs it is 1.1."),
    ]
    assert [item["place"] for item in checks(doubts)] == ["a.csv", "Several recordings together, gyro"]
    assert checks([]) == []


def test_many_doubts_are_folded_and_none_is_lost(words_alone):
    doubts = [
        {"recording": "a.csv", "channel": f"c{number}", "finding": "wait", "sentence": "It waits.", "suspects": []}
        for number in range(9)
    ]
    bare = diagnosis(findings=[], verdict=["none"], complete=False, checks=doubts, incomplete_for=["dead"])
    text = words_alone(bare, evidence())
    folded = text[text.index("<summary>3 more</summary>") :]
    assert all(f"<b>a.csv, c{number}:</b>" in text for number in range(9))
    assert "<b>a.csv, c6:</b>" in folded
    assert "<b>a.csv, c5:</b>" not in folded
    assert tiles(bare, 60.0)[0]["label"] == "incomplete: not every channel speaks"


def test_what_is_known_is_said_without_an_equation(words_alone):
    known = {
        "equation": "",
        "terms": [],
        "equation_share": 0.0,
        "ceiling_share": 0.42,
        "where": "turning left: 80 % of it",
    }
    text = words_alone(diagnosis(unnamed=known), evidence())
    section = text[text.index("What has no name") :]
    for words in (
        "No equation for what remains was stable. A flexible model removes 42 % of the squared residual",
        "Where most is left: turning left: 80 % of it.",
    ):
        assert words in section
    assert "<pre>" not in section
    assert unnamed(None) is None


def test_an_equation_is_not_called_unstable(page):
    assert "<pre>F_x = -12 v_x" in page
    assert "Where it acts most: at speed." in page
    assert "was stable" not in page


def test_gates_are_traced_to_the_drives_behind_them():
    known = GatesUsed(nulls=60, bank="f", level=0.05)
    assert gate_note(known).startswith("set by 60 null drives at a level of 5 %")
    assert "60 simulated drives with nothing missing" in gate_note(replace(known, kind="simulated"))
    ordinary = gate_note(replace(known, kind="ordinary"))
    foreign = gate_note(replace(known, robot="warthog", soil="firm_ground"), "husky", "firm_ground")
    assert foreign.endswith("They are of warthog instead of husky: the level is not known to hold here.")
    assert "instead" not in gate_note(replace(known, robot="husky", soil="firm_ground"), "husky", "firm_ground")
    assert "60 pieces of real drives that are taken to be ordinary" in ordinary
    assert "simulat" not in ordinary


def without_findings(table, gates):
    """A diagnosis that names nothing, with gates."""
    thresholds = {"nulls": 60, "bank": "abc", "level": 0.05, "gates": gates}
    return diagnosis(findings=[], verdict=["none"], detectable=table, thresholds=thresholds)


def test_gates_stand_beside_the_least_sizes_where_nothing_was_found(words_alone):
    table = {"slope": {"angle": 0.01}, "payload": {"mass": None}}
    bare = without_findings(table, {"slope": 12.34})
    text = words_alone(bare, evidence())
    assert "<th>least size</th><th>gate</th>" in text
    assert "<td>0.57 degrees</td><td>12.3</td>" in text
    assert "<td>none, however large</td><td>–</td>" in text
    assert shown_gates(replace(bare, findings=diagnosis().findings)) == {}


def test_only_known_names_of_robot_and_soil_are_listed():
    rows = dict(sources(diagnosis(robot="warthog", soil="", options={"seed": 0})))
    assert rows["Robot"] == "warthog"
    assert rows["Seed"] == "0"
    assert "Soil" not in rows


def test_why_no_drive_would_help_is_said(words_alone):
    none = {"manoeuvre": "", "why": "Nothing would tell them apart.", "separates": [], "power": 0.0}
    none |= {"minutes": None, "alternatives": []}
    text = words_alone(diagnosis(next_drive=none), evidence())
    assert "Nothing would tell them apart." in text
    assert "raises the expected gain" not in text
    assert next_drive(None) is None


def test_what_was_seen_in_the_values_was_held_against_nothing():
    (finding,) = diagnosis().findings
    card = finding_card(replace(finding, name="gyro_sign", gate=0.0, parameters={}, equivalence_set={}), ["a"])
    assert "no other effect was compared with it" in card["equivalence_note"]


def test_tables_by_hand():
    assert [row["size"] for row in detectable({"slope": {"angle": 0.0174533}, "no_such": {"x": 2.0}})] == [
        "1.0 degrees",
        "2.0",
    ]
    assert condition_rows(None, diagnosis().findings) == [
        {"what": "Sloping ground", "where": "at speeds above 0.50 m/s", "share": "80 %", "time": "30 %", "p": "0.01"}
    ]
    assert "no null drives" in gate_note(GatesUsed(nulls=0, bank="", level=0.05))
    assert fit_table(diagnosis(**later_entries()).fit)["rows"][1][:2] == ["yaw rate after 30 s [rad/s]", "–"]
    labels = [tile["label"] for tile in tiles(diagnosis(complete=False), 24.0)]
    assert labels[0] == "incomplete: something is left"


@pytest.mark.parametrize(
    ("verdict", "reasons", "words"),
    [
        ("slope", ["names"], "nothing else shows, but what is named is doubtful"),
        ("slope", ["left", "names"], "something is left"),
        ("none", ["contradictions"], "the recordings contradict themselves"),
        ("none", [], "the recordings are in doubt"),
    ],
)
def test_the_first_tile_says_why_an_answer_is_not_complete(verdict, reasons, words):
    findings = {} if verdict == "slope" else {"findings": []}
    found = diagnosis(verdict=[verdict], complete=False, incomplete_for=reasons, **findings)
    assert tiles(found, 24.0)[0]["label"] == f"incomplete: {words}"


def test_held_readings_are_seen_in_the_values_and_in_no_window():
    (held,) = repeat_findings([RepeatedReadings("gyro", 0.5, 0.1, 4000)])
    assert finding_card(held, ["a"])["evidence"] == "seen in the values: 2000 readings are repeats"
    (finding,) = diagnosis().findings
    turned = replace(finding, name="gyro_sign", gate=0.0, parameters={}, equivalence_set={})
    assert "windows" not in finding_card(turned, ["a"])["evidence"]


def test_limits_and_signs_are_said_in_their_own_words() -> None:
    table = {"motor_saturation": {"speed_limit": 0.9, "acceleration_limit": None}, "gyro_sign": {"flip": 1.0}}
    rows = {row["title"]: row["size"] for row in detectable(table)}
    assert list(rows.values()) == ["limits up to 0.90 rad/s", "no limit that was tried", "shows"]


@pytest.fixture(scope="module")
def browser():
    program = find_browser()
    if program is None:
        pytest.skip("no Chromium is installed: the page is not opened")
    with Browser(program) as running:
        yield running


@pytest.mark.parametrize(("width", "print_out"), [(1280, False), (390, False), (720, True)])
def test_the_page_opens_without_errors_and_fits_the_view(browser, folder, width, print_out):
    seen = browser.open(folder / PAGE, width, 900, print_out)
    assert seen.problems == ()
    assert [r for r in seen.requests if not r.startswith("data:")] == [(folder / PAGE).resolve().as_uri()]
    # a phone's view widens with its page
    assert seen.page_width <= width
    assert seen.broken_images == 0
    assert HOSTILE in seen.text
    assert len(seen.screenshot) > 50_000


def test_the_gates_of_the_whole_library_fit_a_phone(browser, tmp_path):
    table = {name: dict.fromkeys(kind.size_names(), None) for name, kind in effect_kinds().items()}
    write_report(tmp_path, without_findings(table, dict.fromkeys(table, 123.4)), evidence())
    text = (tmp_path / PAGE).read_text().replace("overflow-x: auto", "overflow-x: visible")
    head, rows = text[: text.index("<body>")], text[text.index("What these drives could have shown") :]
    alone = tmp_path / "alone.html"
    alone.write_text(f"{head}<body><h2>{rows}")
    assert browser.open(alone, 390, 900).page_width <= 390


def test_the_browser_test_sees_errors_and_overflow(browser, tmp_path):
    bad = tmp_path / "bad.html"
    bad.write_text("<p style='width: 3000px'>wide</p><img src='absent.png'><script>throw Error('x')</script>")
    seen = browser.open(bad, 390, 900)
    assert seen.problems
    assert seen.page_width > seen.view_width
    assert seen.broken_images == 1
