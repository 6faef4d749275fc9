"""Mark of tests that start a Ray cluster."""

from __future__ import annotations

from importlib.util import find_spec

import pytest

NEEDS_RAY = pytest.mark.skipif(find_spec("ray") is None, reason="needs ray: pip install 'ddagr-gym[cluster]'")
