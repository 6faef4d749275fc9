"""Plain-text tables, as the commands print them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence


def format_value(value: object) -> str:
    """Numbers with six significant digits, tuples and mappings as lists of their values, the rest as text."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {format_value(item)}" for name, item in value.items())
    if isinstance(value, tuple):
        return ", ".join(map(format_value, value))
    return str(value)


def short(value: float | None) -> str:
    """A number with three significant digits; "-" for none."""
    return "-" if value is None else f"{value:.3g}"


def format_table(header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Plain-text table: two spaces between columns, numbers to the right, text to the left.

    Args:
        header: column titles.
        rows: one sequence per row, each as long as ``header``.
    """
    cells = [[format_value(value) for value in row] for row in rows]
    widths = [max(len(line[i]) for line in [list(header), *cells]) for i in range(len(header))]
    numeric = [all(isinstance(row[i], int | float) for row in rows) and bool(rows) for i in range(len(header))]

    def line(values: Sequence[str]) -> str:
        padded = (v.rjust(w) if n else v.ljust(w) for v, w, n in zip(values, widths, numeric, strict=True))
        return "  ".join(padded).rstrip()

    return "\n".join([line(header), "  ".join("-" * width for width in widths), *map(line, cells)])
