from itertools import pairwise

import numpy as np
import pytest

from ddagr_gym.rendering.sketch import dashes, dots, ribbons, rounded_rectangle, thin_out


def area(outline):
    x, y = np.asarray(outline).T
    return 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)


def test_rounded_rectangle_fills_all_but_the_corners():
    outline = rounded_rectangle((1.0, 5.0), (-2.0, 1.0), 0.5)
    assert area(outline) == pytest.approx(12.0 - (4.0 - np.pi) * 0.25, rel=2e-3)
    assert (outline.min(axis=0), outline.max(axis=0)) == (pytest.approx([1.0, -2.0]), pytest.approx([5.0, 1.0]))
    assert area(rounded_rectangle((0.0, 2.0), (0.0, 1.0), 0.0)) == pytest.approx(2.0)


def test_ribbons_cover_a_circle_that_closes():
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    circle = np.column_stack([50.0 * np.cos(angle), 50.0 * np.sin(angle)])
    assert sum(abs(area(part)) for part in ribbons(circle, 4.0)) == pytest.approx(2.0 * np.pi * 50.0 * 4.0, rel=1e-2)
    assert ribbons(np.zeros((3, 2)), 4.0) == []


def test_dashes_begin_and_end_the_line():
    line = np.column_stack([np.linspace(0.0, 100.0, 30), np.zeros(30)])
    pieces = dashes(line, 10.0, 5.0)
    assert pieces[0][0] == pytest.approx((0.0, 0.0))
    assert pieces[-1][-1] == pytest.approx((100.0, 0.0))
    gaps = [after[0, 0] - before[-1, 0] for before, after in pairwise(pieces)]
    np.testing.assert_allclose(gaps, gaps[0])
    assert gaps[0] == pytest.approx(5.0, rel=0.1)


def test_dots_do_not_move_when_the_line_grows():
    line = np.column_stack([np.linspace(0.0, 100.0, 1001), np.zeros(1001)])
    np.testing.assert_allclose(dots(line, 9.0)[:, 0], np.arange(0.0, 100.0, 9.0))
    np.testing.assert_array_equal(dots(line[:500], 9.0), dots(line, 9.0)[: len(dots(line[:500], 9.0))])


def test_thinning_keeps_the_ends_and_the_spacing():
    line = np.column_stack([np.linspace(0.0, 10.0, 5000), np.zeros(5000)])
    thin = thin_out(line, 3.0)
    assert thin[:, 0] == pytest.approx([0.0, 2.5, 5.0, 7.5, 10.0])
