"""LaTeX in pages to MathML at build time, so that equations need neither scripts nor network."""

from __future__ import annotations

import re
from html import escape, unescape

from latex2mathml.converter import convert

_INLINE = re.compile(r'<span class="arithmatex">\\\((.*?)\\\)</span>', re.DOTALL)
_DISPLAY = re.compile(r'<div class="arithmatex">\s*\\\[(.*?)\\\]\s*</div>', re.DOTALL)
_TAG = re.compile(r"\\tag\{([^{}]*)\}")
_LEFT_OVER = re.compile(r"\\[A-Za-z]+")
_FUNCTION = re.compile(r"(<ms(?:ub|up|ubsup)>)?<mi>(arccos|arcsin|arctan|cos|cot|exp|ln|sin|tan|tanh)</mi>")
_THIN = '<mspace width="0.17em"/>'


class EquationError(ValueError):
    """An equation that cannot be shown."""


def with_mathml(html: str) -> str:
    """HTML of a page with every equation that `pymdownx.arithmatex` marked replaced by MathML.

    Raises:
        EquationError: LaTeX that the converter does not know, or one number given to two equations.
    """
    numbers = _TAG.findall(html)
    twice = sorted({number for number in numbers if numbers.count(number) > 1})
    if twice:
        raise EquationError(f"the equation numbers {', '.join(twice)} are given twice: each needs its own.")
    html = _DISPLAY.sub(lambda found: _display(unescape(found[1])), html)
    return _INLINE.sub(lambda found: _mathml(unescape(found[1]), "inline"), html)


def _display(latex: str) -> str:
    tag = _TAG.search(latex)
    body = _mathml(_TAG.sub("", latex).strip(), "block")
    if tag is None:
        return f'<div class="equation">{body}</div>'
    number = escape(tag[1])
    anchor = f'<a class="equation-number" href="#equation-{number}">({number})</a>'
    return f'<div class="equation" id="equation-{number}">{body}{anchor}</div>'


def _mathml(latex: str, display: str) -> str:
    try:
        mathml = convert(latex, display=display)
    except Exception as error:  # the converter raises its own classes without a common base
        raise EquationError(f"the equation {latex!r} cannot be read: {error!r}") from error
    unknown = _LEFT_OVER.search(re.sub(r"<[^>]*>", "", unescape(mathml)))
    if unknown:
        raise EquationError(f"the equation {latex!r} holds {unknown[0]}, which has no MathML: write it otherwise.")
    # browsers follow styles, not the converter's attribute
    for side in ("left", "right"):
        mathml = mathml.replace(f'<mtd columnalign="{side}">', f'<mtd style="text-align:{side}">')
    return _FUNCTION.sub(_spaced, mathml)


def _spaced(found: re.Match[str]) -> str:
    """A function's name set off from its neighbours, which the converter does not do; an index keeps to its name."""
    opening, name = found[1] or "", found[2]
    return f"{opening}<mrow>{_THIN}<mi>{name}</mi>{'' if opening else _THIN}</mrow>"
