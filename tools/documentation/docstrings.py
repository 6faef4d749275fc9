"""Docstrings as the package writes them (roles, simple tables, literal blocks) to the Markdown of the reference."""

from __future__ import annotations

import re
from itertools import pairwise, takewhile
from typing import Any

from griffe import Extension, Module, Object

_ROLE = re.compile(r":(?:class|func|mod|data|attr|meth):`(~?)([\w.]+)`")
_LITERAL = re.compile(r"(?<!`)``([^`\n]+)``(?!`)")
_SHARED_ENTRY = re.compile(r"^( +)([a-z]\w*(?:, [a-z]\w*)+): (.*)$")
_TERM = re.compile(r"^[^\s`|#*-].*[^:\s]$")
_ALIGNED = re.compile(r"^    (\*[^*]+\*) {2,}")
_RULE = re.compile(r"^\s*=+(?: +=+)+\s*$")


class PlainDocstrings(Extension):
    """Changes the docstring of every object to Markdown before it is parsed."""

    def __init__(self) -> None:
        super().__init__()
        self._changed: set[str] = set()

    def on_object(self, *, obj: Object, **_: Any) -> None:
        """Called for each class, function, module and attribute that is read."""
        self._change(obj)

    def on_package(self, *, pkg: Module, **_: Any) -> None:
        """Called for the package as a whole, whose own docstring is read before extensions see objects."""
        self._change(pkg)

    def _change(self, obj: Object) -> None:
        if obj.docstring is not None and obj.docstring.value not in self._changed:
            obj.docstring.value = to_markdown(obj.docstring.value)
            self._changed.add(obj.docstring.value)


def to_markdown(text: str) -> str:
    """Docstring with Markdown tables, fenced literal blocks and links to what it names."""
    lines = _with_definitions(_with_single_names(_with_fences(_with_tables(text.splitlines()))))
    return "\n".join(_inline(line) for line in lines)


def _inline(line: str) -> str:
    return _LITERAL.sub(r"`\1`", _ROLE.sub(_link, line))


def _link(found: re.Match[str]) -> str:
    short, target = found[1], found[2]
    shown = target.rsplit(".", 1)[-1] if short else target
    return f'<autoref identifier="{target}" optional><code>{shown}</code></autoref>'


def _with_definitions(lines: list[str]) -> list[str]:
    """A term with an indented text below it as a definition; aligned ``*word*  meaning`` lines in it as a list."""
    result: list[str] = []
    fenced = False
    number = 0
    while number < len(lines):
        line = lines[number]
        fenced ^= line.lstrip().startswith("```")
        block = [] if fenced or not _TERM.match(line) else list(takewhile(_is_indented, lines[number + 1 :]))
        result += _definition(line, block) if block else [line]
        number += 1 + len(block)
    return result


def _is_indented(line: str) -> bool:
    return line.startswith("    ")


def _definition(term: str, block: list[str]) -> list[str]:
    if not any(_ALIGNED.match(line) for line in block):
        return ["", term, f":   {block[0].strip()}", *block[1:], ""]
    items = [_ALIGNED.sub(r"- \1: ", line) if _ALIGNED.match(line) else f"  {line.strip()}" for line in block]
    return ["", f"**{term}**", "", *items, ""]


def _with_single_names(lines: list[str]) -> list[str]:
    """Entries that describe several parameters at once (``x, y: position``) as one entry each."""
    result: list[str] = []
    for number, line in enumerate(lines):
        found = _SHARED_ENTRY.match(line)
        if found is None:
            result.append(line)
            continue
        indent, names, text = found.groups()
        more = takewhile(lambda other: other.startswith(indent + "    "), lines[number + 1 :])  # noqa: B023
        meaning = " ".join([text, *(other.strip() for other in more)])
        *first, last = names.split(", ")
        result += [f"{indent}{name}: {meaning}" for name in first]
        result.append(f"{indent}{last}: {text}")
    return result


def _with_tables(lines: list[str]) -> list[str]:
    result: list[str] = []
    rest = list(lines)
    while rest:
        if not _RULE.match(rest[0]):
            result.append(rest.pop(0))
            continue
        rules = [number for number, line in enumerate(rest) if _RULE.match(line) and line.strip() == rest[0].strip()]
        last = _last_rule(rest, rules)
        result += ["", *_table(rest[: last + 1]), ""]
        indent = rest[0][: len(rest[0]) - len(rest[0].lstrip())]
        rest = _without_indent(rest[last + 1 :], indent) if indent else rest[last + 1 :]
    return result


def _without_indent(lines: list[str], indent: str) -> list[str]:
    """Lines with what stands below an indented table, which is drawn at the margin, moved to the margin too."""
    below = list(takewhile(lambda line: not line or line.startswith(indent), lines))
    return [line.removeprefix(indent) for line in below] + lines[len(below) :]


def _last_rule(lines: list[str], rules: list[int]) -> int:
    """Line that ends the table which begins at line 0: its third rule when it has a header, else its second."""
    for number in rules[1:]:
        following = lines[number + 1] if number + 1 < len(lines) else ""
        if not following.strip():
            return number
    raise ValueError(f"a table of a docstring has no end: {lines[0].strip()}")


def _table(lines: list[str]) -> list[str]:
    starts = [found.start() for found in re.finditer("=+", lines[0])]
    inner = [number for number, line in enumerate(lines) if _RULE.match(line)]
    body = [_cells(line, starts) for line in lines[inner[-2] + 1 : inner[-1]]]
    head = [_cells(line, starts) for line in lines[1 : inner[1]]] if len(inner) == 3 else []
    header = [" ".join(filter(None, column)) for column in zip(*head, strict=True)] if head else [""] * len(starts)
    rows = [header, ["---"] * len(starts), *_joined(body)]
    return ["| " + " | ".join(row) + " |" for row in rows]


def _cells(line: str, starts: list[int]) -> list[str]:
    edges = pairwise([*starts, len(line) + max(starts)])
    return [line[a:b].strip().replace("|", r"\|") for a, b in edges]


def _joined(rows: list[list[str]]) -> list[list[str]]:
    """Rows whose first cell is empty go on with the row above them."""
    joined: list[list[str]] = []
    for row in rows:
        if joined and not row[0]:
            joined[-1] = [" ".join(filter(None, pair)) for pair in zip(joined[-1], row, strict=True)]
        else:
            joined.append(row)
    return joined


def _with_fences(lines: list[str]) -> list[str]:
    """Literal blocks (announced by two colons, indented) as fenced ones."""
    result: list[str] = []
    number = 0
    while number < len(lines):
        line = lines[number]
        if not line.rstrip().endswith("::"):
            result.append(line)
            number += 1
            continue
        indent = len(line) - len(line.lstrip())
        end = number + 1
        while end < len(lines) and (not lines[end].strip() or len(lines[end]) - len(lines[end].lstrip()) > indent):
            end += 1
        block = "\n".join(lines[number + 1 : end]).strip("\n").splitlines()
        result += [line.rstrip()[:-1], "", " " * indent + "```text", *block, " " * indent + "```", ""]
        number = end
    return result
