"""Pages that are run: what their blocks mean, what counts as the same output, and the tutorials themselves."""

from __future__ import annotations

import pytest

from tools.documentation.mathematics import EquationError, with_mathml
from tools.documentation.pages import (
    TUTORIALS,
    blocks,
    command_lines,
    differences,
    pages_that_run,
    pictures,
    run_page,
    same_text,
    with_printed,
)

PAGE = """# A page

```yaml title="robot.yaml"
mass: 2.0
```

```python
print("mass", open("robot.yaml").read().split()[1])
two = 2
```

```{ .text .printed }
mass 2.01
```

```python
open("square.png", "w").write(str(two))
print(two * 3)
```

![](page/square.png) ![](../pictures/other.png)
"""


@pytest.fixture
def page(tmp_path):
    path = tmp_path / "page.md"
    path.write_text(PAGE)
    return path


def test_blocks_say_what_they_are():
    kinds = [(block.language, block.title, block.printed, block.runs) for block in blocks(PAGE)]
    assert kinds == [
        ("yaml", "robot.yaml", False, False),
        ("python", "", False, True),
        ("text", "", True, False),
        ("python", "", False, True),
    ]
    assert PAGE.splitlines()[blocks(PAGE)[1].line - 1].startswith("print(")


def test_a_page_is_run_in_its_folder(page, tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    printed = run_page(page, folder)
    assert list(printed.values()) == ["mass 2.0\n", "6\n"]
    assert [(folder / name).is_file() for name in pictures(PAGE, "page")] == [True]
    (sentence,) = differences(PAGE, printed)
    assert sentence.startswith("line 17: the page shows\n\nand the run prints\n6")
    completed = with_printed(PAGE, printed)
    assert "mass 2.01" in completed  # near enough to stay
    assert differences(completed, printed) == []


def test_an_error_names_the_page(page, tmp_path):
    page.write_text("```python\n1 / 0\n```\n")
    with pytest.raises(RuntimeError, match=r"page\.md does not run(.|\n)*line 2(.|\n)*ZeroDivisionError"):
        run_page(page, tmp_path)


def test_commands_go_over_several_lines():
    assert command_lines("./ddagr check a.csv \\\n  --robot husky  # note\n\n./ddagr soils\n") == [
        ["check", "a.csv", "--robot", "husky"],
        ["soils"],
    ]
    with pytest.raises(ValueError, match="rm -r"):
        command_lines("rm -r /\n")


@pytest.mark.parametrize(
    ("expected", "found", "same"),
    [
        ("gain 100.0 at 3", "gain 101.0 at 3", True),
        ("gain 100.0 at 3", "gain 103.0 at 3", False),
        ("gain 100.0", "loss 100.0", False),
        ("0.01 m", "0.02 m", True),  # the last place
        ("4 of 20", "5 of 20", False),
        ("-0.5 m", "0.5 m", False),
        ("replayed in 3.1 s of one core", "replayed in 9.8 s of one core", True),
        ("2176 times real time on one core", "990 times real time on one core", True),
    ],
)
def test_outputs_agree_within_the_tolerance(expected, found, same):
    assert same_text(expected, found) is same


def test_equations_become_mathml():
    html = r'<p><span class="arithmatex">\(a &lt; b_1\)</span></p><div class="arithmatex">\[x^2 \tag{2.1}\]</div>'
    shown = with_mathml(html)
    assert shown.count("<math") == 2
    assert "&#x0003C;" in shown
    assert 'id="equation-2.1"' in shown
    assert r"\tag" not in shown


@pytest.mark.parametrize(
    ("latex", "sentence"),
    [
        (r"\nosuchcommand{x}", "nosuchcommand"),
        (r"x \tag{1}\]</div><div class=\"arithmatex\">\[y \tag{1}", "given twice"),
    ],
)
def test_equations_that_cannot_be_shown_are_errors(latex, sentence):
    with pytest.raises(EquationError, match=sentence):
        with_mathml(rf'<div class="arithmatex">\[{latex}\]</div>')


@pytest.mark.parametrize("name", pages_that_run())
def test_pictures_of_tutorials_are_there_and_small(name):
    text = (TUTORIALS / f"{name}.md").read_text()
    sizes = [(TUTORIALS / name / picture).stat().st_size for picture in pictures(text, name)]
    assert sum(sizes) < 400_000


@pytest.mark.slow
@pytest.mark.parametrize("name", pages_that_run())
def test_tutorials_run_and_print_what_they_show(name, tmp_path):
    page = TUTORIALS / f"{name}.md"
    printed = run_page(page, tmp_path)
    assert differences(page.read_text(), printed) == []
    assert [p for p in pictures(page.read_text(), name) if not (tmp_path / p).is_file()] == []
