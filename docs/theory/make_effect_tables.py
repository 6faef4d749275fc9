"""Facts of every effect from the library, written into ``effects.md`` between the marks of each effect.

Run from the root of the checkout: ``python docs/theory/make_effect_tables.py``. A test compares page and library.
"""

from __future__ import annotations

import re
from pathlib import Path

from ddagr_gym.physics import layout
from ddagr_gym.physics.effects.base import Effect
from ddagr_gym.physics.effects.registry import effect_kinds

PAGE = Path(__file__).parent / "effects.md"

POINTS = {
    getattr(layout, f"POINT_{name.upper()}"): name
    for name in ("commands", "set_points", "motors", "loads", "soil", "wheel_forces", "body_forces", "readings")
}


def field_rows(kind: type[Effect]) -> list[str]:
    """One row of the table per parameter of an effect."""
    rows = []
    for role, names in (("size", kind.size_names()), ("shape", kind.shape_names())):
        for name in names:
            data = kind.parameter(name).metadata
            least = f"{data['least']:g}" if role == "size" and kind.differentiable else "–"
            neutral = f"{data['neutral']:g}" if role == "size" else "–"
            bounds = f"{data['low']:g} to {data['high']:g}"
            meaning = kind.meaning(name) or "–"
            rows.append(f"| `{name}` | {role} | {data['unit']} | {bounds} | {neutral} | {least} | {meaning} |")
    return rows


def facts(kind: type[Effect]) -> str:
    """Where an effect attaches, its parameters, signature, what it is confused with, and its source."""
    points = ", ".join(dict.fromkeys(POINTS[point] for point, _ in kind.actions))
    confused = ", ".join(f"[{name}](#{name})" for name in kind.confused_with) or "nothing of the library"
    return "\n".join(
        [
            f"*{kind.title}.* Attaches at: {points}. Signature: {kind.signature}.",
            f"Confused with: {confused}. Source: {kind.source}.",
            "",
            "| parameter | role | unit | bounds | neutral | least | meaning |",
            "|---|---|---|---|---|---|---|",
            *field_rows(kind),
        ]
    )


def written(page: str) -> str:
    """The page with the facts of every effect between its marks."""
    for name, kind in effect_kinds().items():
        marks = (f"<!-- facts of {name} -->", f"<!-- end of {name} -->")
        block = re.compile(f"{re.escape(marks[0])}.*?{re.escape(marks[1])}", re.DOTALL)
        text = f"{marks[0]}\n\n{facts(kind)}\n\n{marks[1]}"
        page = block.sub(lambda _, text=text: text, page)
    return page


if __name__ == "__main__":
    PAGE.write_text(written(PAGE.read_text()))
