"""The page of an evaluation: the answer first, escaped, self-contained, and at home on desks, phones and paper."""

import base64
import re
from pathlib import PurePosixPath

import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.report_data import Film
from ddagr_gym.presets import ddagr
from ddagr_gym.reporting.evaluation_page import FIGURES, PAGE, PICTURE, write_page

from .browser import Browser, find_browser
from .evaluation_example import HOSTILE, evaluation

pytest.importorskip("matplotlib", reason="needs the extra report")
pytest.importorskip("jinja2", reason="needs the extra report")

FILM = Film(PurePosixPath("videos/1_B1_S1_4.mp4"), "The worst turn of B1", "ddagr evaluate --replay B1:S1:4")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A page with every section."""
    made = tmp_path_factory.mktemp("page")
    drawn = []
    write_page(made, evaluation(films=[FILM]), ddagr(), lambda: drawn.append(1))
    assert len(drawn) == FIGURES
    return made


@pytest.fixture(scope="module")
def page(folder):
    return (folder / PAGE).read_text()


def test_the_answer_comes_first_and_every_section_is_there(page):
    headings = re.findall(r"<h[12]>(.*?)</h[12]>", page)
    assert headings[0].startswith("ppo_ekf turns closest")
    assert headings[1:] == [
        "What was said beforehand", "How far off, on which soils", "How sure that one is better", "The turns",
        "The worst", "What the filter knew", "What a turn costs", "What the learned controllers need",
        "On another soil law", "Where the numbers come from",
    ]  # fmt: skip
    first_table = page[page.index("<table") : page.index("</table>")]
    assert first_table.index("ppo_ekf") < first_table.index("can never be deployed") < first_table.index("true_path")
    for words in ("1 held, 1 did not", "512.2", "ddagr evaluate --replay B1:S1:4", "T drives scenarios of S1"):
        assert words in page, words


def test_names_are_escaped(page):
    assert "<script" not in page
    assert page.count("&lt;script&gt;alert(&#39;$x_1$&#39;)&lt;/script&gt;") >= 3


def test_the_page_is_one_file_that_points_only_to_its_videos(folder, page):
    assert len(page.encode()) < 1_500_000
    sources = set(re.findall(r'(?:src|href|poster)="([^"]*)"', page))
    assert {source for source in sources if not source.startswith("data:")} == {str(FILM.file)}
    assert not re.search(r"https?://", page)
    assert (folder / f"{PICTURE}.png").stat().st_size > 10_000


def test_pictures_are_whole_and_named(page):
    images = re.findall(r'<img src="data:image/svg\+xml;base64,([^"]*)" alt="([^"]+)"', page)
    assert len({alt for _, alt in images}) == len(images) == FIGURES
    for data, _ in images:
        assert base64.b64decode(data).rstrip().endswith(b"</svg>")


def test_what_was_not_done_has_no_section(tmp_path):
    bare = evaluation(drives=[], tracked=[], claims=[], films=[], infeasible=[], note="A look, not a result.")
    text = write_page(tmp_path, bare, ddagr()).read_text()
    for absent in ("What was said beforehand", "<video", "Their soils", "True paths"):
        assert absent not in text
    assert "A look, not a result." in text


def test_nothing_driven_is_an_error(tmp_path):
    with pytest.raises(InputError, match="no episodes"):
        write_page(tmp_path, evaluation(rows=[]), ddagr())


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
    assert seen.page_width <= seen.view_width
    assert seen.broken_images == 0
    assert HOSTILE in seen.text
    assert len(seen.screenshot) > 50_000
