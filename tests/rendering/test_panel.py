import dataclasses

import numpy as np
import pytest

from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.errors import InputError
from ddagr_gym.presets import get_robot
from ddagr_gym.rendering import palette
from ddagr_gym.rendering.panel import lay_out_panel, signed
from ddagr_gym.rendering.scene import Scene, turn_stage

SCENE = Scene(
    stage=turn_stage(RowTurn(), get_robot("ddagr"), "thesis_a1"),
    time=12.34,
    track=np.zeros((1, 3)),
    ruts=np.array([[0.011, 0.012, 0.013, 0.2]]),
    wheel_speed=(1.0, -0.5),
    command=(9.0, -0.5),
    slip_ratio=(0.2, -1.7, 0.0, 0.4),
    radius=0.76,
)


def words(scene):
    return [text.content for text in lay_out_panel(scene, 0.0, 1.0).texts]


def test_numbers_carry_a_true_minus_and_no_negative_zero():
    assert signed(-1.26, 1, "m") == "−1.3 m"
    assert signed(-0.004, 2) == "0.00"
    assert signed(12.0, 0, "%") == "12 %"


def test_panel_says_what_the_scene_holds():
    said = words(SCENE)
    for expected in ("12.3 s", "0.760 m", "−5.0 %", "target 0.80 m", "1.00", "−0.50", "−170 %", "13 mm", "200 mm"):
        assert expected in said
    assert "–" in words(dataclasses.replace(SCENE, radius=None))


def test_bars_are_as_long_as_their_values_and_never_longer_than_their_ground():
    drawing = lay_out_panel(SCENE, 100.0, 1.0)
    grounds = [box for box in drawing.boxes if box.colour == palette.HAIRLINE and box.height == 8.0]
    bars = [box for box in drawing.boxes if box.colour in (palette.RIGHT, palette.LEFT) and box.height == 8.0]
    assert len(grounds) == len(bars) == 10
    for ground, bar in zip(grounds, bars, strict=True):
        assert ground.x - 1e-9 <= bar.x <= bar.x + bar.width <= ground.x + ground.width + 1e-9
    left, right = bars[:2]
    assert (left.width, right.width) == pytest.approx((0.25 * grounds[0].width / 2, 0.5 * grounds[1].width / 2))
    assert left.x + left.width == pytest.approx(grounds[0].x + grounds[0].width / 2)
    assert right.x == pytest.approx(grounds[1].x + grounds[1].width / 2)


def test_measures_scale_with_the_picture():
    small, large = lay_out_panel(SCENE, 0.0, 1.0), lay_out_panel(SCENE, 0.0, 2.0)
    for one, other in zip(small.texts, large.texts, strict=True):
        assert (2 * one.x, 2 * one.y, 2 * one.size) == pytest.approx((other.x, other.y, other.size))


def test_too_many_metrics_are_refused():
    full = dataclasses.replace(SCENE, metrics=tuple((f"metric {i}", "1") for i in range(6)))
    assert "metric 5" in words(full)
    with pytest.raises(InputError, match="9 metric lines: the panel has room for"):
        words(dataclasses.replace(SCENE, metrics=tuple((f"metric {i}", "1") for i in range(9))))
