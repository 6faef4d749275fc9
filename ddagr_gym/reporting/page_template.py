"""Templates of the pages, and figures as data inside them."""

from __future__ import annotations

from typing import Any

from ddagr_gym.extras import need
from ddagr_gym.reporting.figures import svg_data

_PIXELS_PER_INCH = 96
"""Of CSS."""


def page_template(name: str) -> Any:
    """Template of ``templates/``: every text is escaped, an unknown name is an error.

    Raises:
        InputError: jinja2 is not installed.
    """
    need("jinja2")
    from jinja2 import Environment, PackageLoader, StrictUndefined

    loader = PackageLoader("ddagr_gym.reporting", "templates")
    environment = Environment(
        loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.get_template(name)


def embedded(figure: Any, alt: str, dpi: float | None = None) -> dict[str, Any]:
    """A figure as data of an SVG, with its size on the page; ``dpi`` as for :func:`svg_data`."""
    data = svg_data(figure, dpi)
    width, height = (round(_PIXELS_PER_INCH * side) for side in figure.get_size_inches())
    return {"data": data, "alt": alt, "width": width, "height": height}
