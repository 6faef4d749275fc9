"""What is cited exists: documents, theory pages, their equations; every effect, controller and set is on its page."""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from ddagr_gym.evaluation.controllers import controller_names, controller_title
from ddagr_gym.physics.effects.registry import effect_kinds

PAGES = {
    "wheel model": "wheel_model.md",
    "drivetrain": "drivetrain.md",
    "real drivetrains": "real_drivetrains.md",
    "effects": "effects.md",
    "filter": "filter.md",
    "control": "control.md",
    "identification": "identification.md",
    "diagnosis": "diagnosis.md",
}
"""Names by which docstrings cite the pages of docs/theory."""

SEARCHED = ("ddagr_gym", "agents", "benchmarks", "tests", "configs", "docs")
DOCUMENT = re.compile(r"[\w./-]*\w\.md\b")
PLACE = r"(?:eq\. |sections? |metric |E)?\(?[\d.]+\)?(?:(?:,| and)\s+\(?E?[\d.]+\)?)*"
CITATION = re.compile(rf"[Tt]heory:\s+({'|'.join(PAGES)}),\s+({PLACE})")


def texts(root: Path) -> Iterator[tuple[Path, str]]:
    """Text files of the checkout that may cite a document."""
    files = [path for folder in SEARCHED for path in sorted((root / folder).rglob("*"))]
    for path in [*files, *sorted(root.glob("*.md"))]:
        if path.suffix in (".py", ".md", ".yaml", ".yml", ".html") and path.name != Path(__file__).name:
            yield path, path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def theory(repository: Path) -> dict[str, str]:
    return {name: (repository / "docs" / "theory" / file).read_text() for name, file in PAGES.items()}


def numbers_of(page: str) -> list[int]:
    """Numbers of the equations of a page, in order."""
    return [int(number) for number in re.findall(r"\\tag\{(\d+)\}", page)]


def sections_of(page: str) -> set[str]:
    """Numbers of the sections of a page: "3", "6.1"."""
    return set(re.findall(r"^#{2,3} ([\d.]*\d)\.? ", page, re.MULTILINE))


def missing(theory: dict[str, str], page: str, target: str) -> list[str]:
    """What a citation names and the page lacks."""
    text = theory[page]
    cited = re.findall(r"[\d.]*\d", target)
    if target.startswith("eq."):
        return [f"eq. ({n})" for n in re.findall(r"\((\d+)\)", target) if int(n) not in numbers_of(text)]
    if target.startswith("metric"):
        return [f"metric {n}" for n in cited if f"**Metric {n}:" not in text]
    if target.startswith("E"):
        return [f"E{n}" for n in cited if f"| E{n} |" not in text]
    return [f"section {n}" for n in cited if n not in sections_of(text)]


def test_no_file_cites_a_document_that_is_not_here(repository: Path):
    """Links between pages are checked when the site is built: some of its pages are written then."""
    absent = []
    for path, text in texts(repository):
        if path.relative_to(repository).parts[0] == "docs" or (repository / "tests" / "docs") in path.parents:
            continue
        for name in DOCUMENT.findall(text):
            places = (path.parent / name, repository / name, repository / "docs" / name)
            if not any(place.exists() for place in places):
                absent.append(f"{path.relative_to(repository)} cites {name}")
    assert absent == []


def test_every_cited_equation_and_section_is_on_its_page(repository: Path, theory: dict[str, str]):
    wrong, found = [], 0
    for path, text in texts(repository):
        for page, target in CITATION.findall(" ".join(text.replace("#", " ").split())):
            found += 1
            wrong += [f"{path.relative_to(repository)}: {page} has no {item}" for item in missing(theory, page, target)]
    assert found > 50
    assert wrong == []


def test_every_citation_of_the_theory_has_the_form(repository: Path):
    """A citation that the pattern does not see would not be checked."""
    for path, text in texts(repository):
        joined = " ".join(text.replace("#", " ").split())
        assert len(re.findall(r"\b[Tt]heory: ", joined)) == len(CITATION.findall(joined)), path


@pytest.mark.parametrize("page", PAGES)
def test_equations_are_numbered_in_order(theory: dict[str, str], page: str):
    numbers = numbers_of(theory[page])
    assert numbers == list(range(1, len(numbers) + 1))


def test_references_inside_a_page_lead_to_its_equations(theory: dict[str, str]):
    for page, text in theory.items():
        own = re.sub(rf"\b({'|'.join(PAGES)}), eq\. \(\d+\)(?:, \(\d+\))*", "", text)
        cited = {int(number) for number in re.findall(r"\beq\. \((\d+)\)", own)}
        assert cited <= set(numbers_of(text)), page


def test_references_between_pages_lead_to_equations(theory: dict[str, str]):
    for text in theory.values():
        for page, number in re.findall(rf"\b({'|'.join(PAGES)}), eq\. \((\d+)\)", text):
            assert int(number) in numbers_of(theory[page]), (page, number)


def test_errata_are_numbered_in_order(theory: dict[str, str]):
    numbers = [int(number) for number in re.findall(r"^\| E(\d+) \|", theory["wheel model"], re.MULTILINE)]
    assert numbers == list(range(1, len(numbers) + 1))
    assert len(numbers) > 20


def tables(repository: Path) -> ModuleType:
    """The script that writes the facts of the effects."""
    spec = importlib.util.spec_from_file_location(
        "make_effect_tables", repository / "docs" / "theory" / "make_effect_tables.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_page_of_effects_says_what_the_library_says(repository: Path, theory: dict[str, str]):
    assert tables(repository).written(theory["effects"]) == theory["effects"], (
        "run python docs/theory/make_effect_tables.py"
    )


@pytest.mark.parametrize("name", effect_kinds())
def test_every_effect_has_its_equation(theory: dict[str, str], name: str):
    section = theory["effects"].partition(f"\n### {name}\n")[2].partition("\n### ")[0]
    assert "\\tag{" in section
    assert f"<!-- facts of {name} -->" in section


@pytest.mark.parametrize("name", controller_names())
def test_every_controller_is_on_its_page(theory: dict[str, str], name: str):
    assert controller_title(name)
    assert re.search(rf"^\| {name} \| ", theory["control"], re.MULTILINE)


def test_every_scenario_set_is_on_its_page(repository: Path, theory: dict[str, str]):
    sets = [
        path.name.removesuffix(".json.gz") for path in (repository / "configs" / "evaluation" / "scenarios").iterdir()
    ]
    assert len(sets) == 83
    for name in sets:
        assert re.search(rf"^\| {re.escape(name)} \| \d+ \| ", theory["control"], re.MULTILINE), name


def test_figures_of_the_theory_exist_and_are_small(repository: Path):
    folder = repository / "docs" / "theory"
    for page in folder.glob("*.md"):
        for figure in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", page.read_text()):
            assert (folder / figure).stat().st_size < 100_000, figure


def test_glossary_explains_each_word_once(repository: Path):
    text = (repository / "docs" / "glossary.md").read_text()
    entries = re.findall(r"\*\*([^*]+)\*\*:", text)
    assert len(entries) > 60
    assert len(entries) == len(set(entries))


def test_changelog_has_no_relative_links(repository: Path):
    """It is read beside the README and as a page of the site, where relative paths differ."""
    links = re.findall(r"\]\(([^)]+)\)", (repository / "CHANGELOG.md").read_text())
    assert links
    assert [link for link in links if not link.startswith("https://")] == []
