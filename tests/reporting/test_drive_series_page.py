"""The page of many drives, seen by a browser at the width of a desk and of a phone."""

from __future__ import annotations

import pytest

from ddagr_gym.reporting.drive_series_page import write_page
from tests.diagnosis.series.test_conclusion import series
from tests.reporting.browser import Browser, find_browser


@pytest.mark.slow
@pytest.mark.skipif(find_browser() is None, reason="needs Chromium")
def test_the_page_fits_a_desk_and_a_phone(tmp_path):
    write_page(tmp_path, series([0.0] * 60 + [None] + [14.0] * 40, [()] * 61 + [("gyro_bias",)] * 40))
    with Browser(find_browser()) as browser:
        for width in (1200, 400):
            seen = browser.open(tmp_path / "index.html", width, 900)
            assert seen.page_width <= seen.view_width
            assert (seen.broken_images, seen.problems) == (0, ())
            assert all(request.startswith(("file:", "data:")) for request in seen.requests)
            assert "From drive 62 of 101 (run_62.csv" in seen.text
