"""Tools for work on ddagr-gym itself, started by ``./ddagr NAME`` or ``python -m tools NAME`` from the checkout.

They are written as :mod:`ddagr_gym.commands` describes, and are not in the wheel.
"""

from pathlib import Path

from ddagr_gym.commands import CHECKOUT_TOOLS as NAMES

__all__ = ["CHECKOUT", "NAMES", "PURPOSE", "USAGE"]

USAGE = "./ddagr TOOL [OPTIONS]"
PURPOSE = "Tools for work on ddagr-gym itself: test, document, measure, tune."

CHECKOUT = Path(__file__).resolve().parents[1]
"""Root of the repository."""
