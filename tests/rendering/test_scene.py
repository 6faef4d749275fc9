import math

import numpy as np
import pytest

from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.errors import InputError
from ddagr_gym.presets import get_robot
from ddagr_gym.rendering.scene import Scene, View, bed_layout, open_stage, scenes, turn_stage

ROBOT = get_robot("ddagr")


def columns_of(turn, rate=125.0):
    t = np.arange(0.0, turn.duration, 1.0 / rate)
    distance = turn.distance_at(t)
    x, y = turn.position(distance).T
    speed = np.full_like(t, turn.speed / 0.2794)
    columns = {"t": t, "true_x": x, "true_y": y, "true_yaw": turn.heading(distance)}
    columns |= dict.fromkeys(("command_right", "command_left", "encoder_right", "encoder_left"), speed)
    for wheel in range(1, 5):
        columns |= {f"true_slip_ratio_{wheel}": 0.1 * wheel + 0 * t, f"true_sinkage_{wheel}": 0.005 * wheel + 0 * t}
    return columns


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("radius", [0.58, 0.65, 0.8, 1.2, 2.0])
def test_robot_straddles_a_bed_on_both_rows(side, radius):
    turn = RowTurn(radius=radius, side=side)
    beds = bed_layout(turn, 0.58, (-1.0, 3.0))
    pitch = np.diff(beds.centres)
    np.testing.assert_allclose(pitch, pitch[0])
    for row in (0.0, 2.0 * turn.sign * radius):
        assert np.min(np.abs(np.array(beds.centres) - row)) < 1e-9 or not -1.0 <= row <= 3.0
    wheels = np.array([-0.58, 0.58])
    clear = np.abs(wheels[:, None] - np.array(beds.centres)) - beds.width / 2.0 - 0.1016
    assert clear.min() > 0.0


@pytest.mark.parametrize("radius", [0.3, 0.4, 5.0])
def test_beds_keep_a_width_and_a_furrow_at_any_radius(radius):
    beds = bed_layout(RowTurn(radius=radius), 0.58, (-1.0, 1.0))
    assert 0.1 < beds.width <= 0.648
    assert np.diff(beds.centres)[0] > beds.width


@pytest.mark.parametrize(("radius", "side"), [(0.65, "right"), (0.8, "left"), (1.2, "left")])
def test_view_holds_the_robot_on_the_whole_path(radius, side):
    turn = RowTurn(radius=radius, side=side)
    stage = turn_stage(turn, ROBOT, "soil")
    reach = math.hypot(0.33 + 0.2794, 0.58 + 0.1016)
    path = turn.sample()
    assert stage.view.x_min < path.x.min() - 0.33 - 0.28
    assert stage.view.x_max > path.x.max() + reach
    assert stage.view.y_min < path.y.min() - reach
    assert stage.view.y_max > path.y.max() + reach
    assert stage.target_radius == radius


def test_scenes_follow_the_drive_in_real_time():
    turn = RowTurn(side="right")
    columns = columns_of(turn)
    shown = list(scenes(columns, turn_stage(turn, ROBOT, "soil"), frame_rate=10.0, side="right"))
    times = np.array([scene.time for scene in shown])
    assert len(shown) == math.ceil(columns["t"][-1] * 10.0) + 1
    np.testing.assert_allclose(times[:-1], np.arange(len(shown) - 1) / 10.0, atol=0.008)
    assert times[-1] == columns["t"][-1]
    last = shown[-1]
    assert last.pose == pytest.approx((columns["true_x"][-1], columns["true_y"][-1], columns["true_yaw"][-1]))
    assert last.sinkage == pytest.approx((0.005, 0.01, 0.015, 0.02))
    assert last.slip_ratio == pytest.approx((0.1, 0.2, 0.3, 0.4))
    assert last.radius == pytest.approx(0.8, rel=1e-6)
    assert last.wheel_angle == pytest.approx((0.2 / 0.2794 * times[-1],) * 2, rel=1e-2)
    assert shown[0].radius is None
    assert shown[0].estimated_track is None


def test_estimate_is_shown_where_the_columns_have_one():
    turn = RowTurn()
    columns = columns_of(turn)
    columns |= {"estimated_x": columns["true_x"] + 0.1, "estimated_y": columns["true_y"]}
    scene = list(scenes(columns, turn_stage(turn, ROBOT, "soil"), frame_rate=1.0))[5]
    np.testing.assert_allclose(scene.estimated_track[:, 0], scene.track[:, 0] + 0.1)


def test_open_stage_frames_the_drive():
    stage = open_stage([0.0, 4.0], [0.0, 0.0], ROBOT, "soil", "Straight")
    assert stage.view.x_min < -0.9
    assert stage.view.x_max > 4.9
    assert stage.beds is None
    assert stage.target_path is None


def scene_with(**changes):
    stage = open_stage([0.0], [0.0], ROBOT, "soil", "Test")
    values = {"track": np.zeros((1, 3)), "ruts": np.zeros((1, 4))} | changes
    return Scene(stage, 0.0, values["track"], values["ruts"], (0.0, 0.0), (0.0, 0.0), (0.0, 0.0, 0.0, 0.0),
                 estimated_track=values.get("estimated_track"))  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"track": np.zeros((0, 3))}, r"track has shape \(0, 3\)"),
        ({"ruts": np.zeros((2, 4))}, "track has 1 rows and ruts 2"),
        ({"ruts": np.full((1, 4), math.nan)}, "ruts holds values that are not finite"),
        ({"estimated_track": np.zeros((3, 3))}, "estimated_track has shape"),
    ],
)
def test_bad_scenes_are_refused(changes, message):
    with pytest.raises(InputError, match=message):
        scene_with(**changes)


def test_other_bad_input_is_one_sentence():
    turn = RowTurn()
    stage = turn_stage(turn, ROBOT, "soil")
    columns = columns_of(turn)
    with pytest.raises(InputError, match="frame_rate is 0"):
        next(scenes(columns, stage, frame_rate=0.0))
    del columns["true_sinkage_3"]
    with pytest.raises(InputError, match="column 'true_sinkage_3' is missing"):
        next(scenes(columns, stage))
    with pytest.raises(InputError, match="view of 0 x 1 m"):
        View(0.0, 0.0, 0.0, 1.0)
    with pytest.raises(InputError, match="give one x and one y"):
        open_stage([0.0], [0.0, 1.0], ROBOT, "soil", "Test")
