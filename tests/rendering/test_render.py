import dataclasses
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.errors import InputError
from ddagr_gym.extras import how_to_install
from ddagr_gym.presets import get_robot
from ddagr_gym.rendering import palette, render
from ddagr_gym.rendering.camera import Camera
from ddagr_gym.rendering.panel import lay_out_panel
from ddagr_gym.rendering.render import SceneRenderer
from ddagr_gym.rendering.scene import Scene, open_stage, turn_stage

pytest.importorskip("pygame", reason="needs the extra render")

ROBOT = get_robot("ddagr")


def make_scene(turn, share=1.0, **changes):
    """A kinematic drive along the commanded path up to ``share`` of it."""
    path = turn.sample(0.01)
    count = max(1, round(share * len(path.x)))
    track = np.column_stack([path.x, path.y, path.yaw])[:count]
    ruts = np.tile([0.012, 0.016, 0.02, 0.024], (count, 1))
    scene = Scene(
        stage=turn_stage(turn, ROBOT, "thesis_a1"),
        time=share * turn.duration,
        track=track,
        ruts=ruts,
        wheel_speed=(1.2, -0.1),
        command=(1.3, -0.2),
        slip_ratio=(0.2, -0.6, 0.3, 1.4),
        radius=0.84,
        metrics=(("slip energy", "412 J"),),
    )
    return dataclasses.replace(scene, **changes)


@pytest.fixture(scope="module")
def renderer():
    renderer = SceneRenderer((720, 540))
    yield renderer
    renderer.close()


def near(picture, colour, tolerance=12):
    return np.all(np.abs(picture.astype(int) - palette.rgb(colour)) <= tolerance, axis=-1)


@pytest.mark.parametrize("size", [(640, 480), (721, 541), (960, 720)])
def test_pictures_have_the_size_asked_for(size):
    renderer = SceneRenderer(size)
    picture = renderer.draw(make_scene(RowTurn(), 0.5))
    assert picture.shape == (size[1], size[0], 3)
    assert picture.dtype == np.uint8
    assert picture.flags.writeable
    assert picture.flags.owndata or picture.base.flags.owndata
    renderer.close()


def test_same_scene_same_bytes_whatever_was_drawn_before(renderer):
    turn = RowTurn()
    scene = make_scene(turn, 0.7)
    first = renderer.draw(scene)
    for share in (0.1, 0.3, 0.69):
        renderer.draw(dataclasses.replace(make_scene(turn, share), stage=scene.stage))
    np.testing.assert_array_equal(renderer.draw(scene), first)
    other = SceneRenderer((720, 540))
    np.testing.assert_array_equal(other.draw(make_scene(turn, 0.7)), first)
    other.close()


def test_new_stage_starts_on_untouched_ground(renderer):
    """Episodes of one turn share the painted field, not the ruts on it."""
    turn = RowTurn()
    start = renderer.draw(make_scene(turn, 0.01))
    renderer.draw(make_scene(turn, 0.9))
    np.testing.assert_array_equal(renderer.draw(make_scene(turn, 0.01)), start)


def test_picture_is_not_reused(renderer):
    first = renderer.draw(make_scene(RowTurn(), 0.2))
    kept = first.copy()
    renderer.draw(make_scene(RowTurn(), 0.9))
    np.testing.assert_array_equal(first, kept)


@pytest.mark.parametrize(("side", "radius"), [("left", 0.8), ("right", 0.65), ("left", 1.2)])
def test_robot_and_paths_are_where_the_scene_says(renderer, side, radius):
    turn = RowTurn(radius=radius, side=side)
    scene = make_scene(turn, 0.55)
    picture = renderer.draw(scene)
    field = 720 - round(264 * 540 / 720)
    camera = Camera(scene.stage.view, field, 540)
    deck = near(picture, palette.DECK, 3)[:, :field]
    expected = camera.pixels(scene.pose[:2])
    rows, columns = np.nonzero(deck)
    assert (columns.mean(), rows.mean()) == pytest.approx(tuple(expected), abs=4.0)
    driven, target = near(picture, palette.TRUE, 30), near(picture, palette.TARGET, 30)
    behind = camera.pixels(turn.position(turn.run_in * 0.5)).astype(int)
    ahead = turn.position(np.linspace(0.8, 1.0, 40) * turn.length)
    assert driven[behind[1] - 4 : behind[1] + 5, behind[0] - 4 : behind[0] + 5].any()
    columns, rows = camera.pixels(ahead).astype(int).T
    assert 10 < np.count_nonzero(target[rows, columns]) < 40
    assert not driven[rows, columns].any()


def test_estimate_and_metrics_appear_only_when_given(renderer):
    turn = RowTurn()
    plain = make_scene(turn, 0.5, metrics=())
    estimated = dataclasses.replace(plain, estimated_track=plain.track[:, :2] + 0.3)
    without, with_estimate = renderer.draw(plain), renderer.draw(estimated)
    change = np.any(without != with_estimate, axis=-1)
    field = 720 - round(264 * 540 / 720)
    camera = Camera(plain.stage.view, field, 540)
    columns, rows = camera.pixels(estimated.estimated_track).astype(int).T
    assert change[rows, columns].mean() > 0.3
    assert change[: 540 * 600 // 720, field:].sum() == 0
    assert change[540 * 600 // 720 :, field:].any()


def test_field_stays_out_of_the_panel_and_texts_inside_of_it():
    renderer = SceneRenderer((960, 720))
    scene = make_scene(RowTurn(), 0.5, track=np.array([[2.0, 0.8, 0.0]]), ruts=np.zeros((1, 4)))
    picture = renderer.draw(scene)
    for margin in (picture[:, 696:716], picture[:, 939:]):
        assert (margin == 255).all()
    renderer.close()


def test_texts_of_the_panel_do_not_overlap():
    renderer = SceneRenderer((960, 720))
    stage = dataclasses.replace(make_scene(RowTurn()).stage, title="A very long title of a drive", soil_name="w" * 60)
    scene = make_scene(RowTurn(), stage=stage, metrics=tuple((f"metric {i}", "0.123 m/s") for i in range(4)))
    boxes = []
    for text in lay_out_panel(scene, 696.0, 1.0).texts:
        content = renderer._cut(text.content, text.size, text.width)
        width = renderer._advance(content, text.size)
        left = text.x - {"left": 0.0, "centre": 0.5, "right": 1.0}[text.align] * width
        boxes.append((left, text.y - 0.75 * text.size, left + width, text.y + 0.2 * text.size, content))
    for index, (left, top, right, bottom, name) in enumerate(boxes):
        assert left >= 715.0, name
        assert right <= 940.0, name
        for other in boxes[index + 1 :]:
            apart = right <= other[0] or other[2] <= left or bottom <= other[1] or other[3] <= top
            assert apart, (name, other[4])
    renderer.close()


def test_open_ground_without_a_target(renderer):
    track = np.column_stack([np.linspace(0, 3, 50), np.zeros(50), np.zeros(50)])
    stage = open_stage(track[:, 0], track[:, 1], get_robot("warthog"), "sand", "Straight")
    scene = make_scene(RowTurn(), stage=stage, track=track, ruts=np.full((50, 4), 0.02), radius=None)
    picture = renderer.draw(scene)
    assert near(picture[:, :500], palette.TRUE, 30).any()
    plants = [near(picture[:, :500], leaf, 8).any() for leaf in palette.LEAVES]
    assert not any(plants)
    assert "Turn radius" not in [text.content for text in lay_out_panel(scene, 0.0, 1.0).texts]


@pytest.mark.slow
def test_drawing_keeps_up_with_the_drive():
    """Aim: 15 ms a picture at 960 x 720 on a quiet core; slow, since a time says little on a busy machine."""
    renderer = SceneRenderer((960, 720))
    turn = RowTurn()
    whole = make_scene(turn)
    parts = [dataclasses.replace(whole, track=whole.track[:end], ruts=whole.ruts[:end]) for end in range(200, 300, 2)]
    renderer.draw(parts[0])
    started = time.process_time()
    for scene in parts[1:]:
        renderer.draw(scene)
    assert (time.process_time() - started) / (len(parts) - 1) < 0.040
    renderer.close()


def growth_over_stages() -> int:
    """Growth of the largest memory of this process while further stages are drawn [KiB]."""
    import resource

    renderer = SceneRenderer((640, 480))
    scenes = [make_scene(RowTurn(radius=0.7 + 0.01 * i), 0.3) for i in range(7)]
    for scene in scenes[:2]:
        renderer.draw(scene)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for scene in scenes:
        renderer.draw(scene)
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before


def test_memory_stays_flat_over_stages():
    """In a process of its own: what other tests leave to be collected is no growth."""
    pytest.importorskip("resource")
    code = "from tests.rendering.test_render import growth_over_stages; print(growth_over_stages())"
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    assert 0 <= int(done.stdout.split()[-1]) < 40_000


def test_window_shows_the_picture(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    renderer = SceneRenderer((640, 480), "human", frame_rate=200.0)
    pygame = render.import_pygame()
    picture = renderer.draw(make_scene(RowTurn(), 0.4))
    shown = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
    np.testing.assert_array_equal(shown, picture)
    renderer.close()
    assert not pygame.display.get_init()
    renderer.close()


def test_no_screen_is_one_sentence(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "no_such_driver")
    with pytest.raises(InputError, match=r"no window can be opened .*: use render mode 'rgb_array'"):
        SceneRenderer(mode="human")


def test_closed_renderer_says_so():
    renderer = SceneRenderer((640, 480))
    renderer.draw(make_scene(RowTurn(), 0.1))
    renderer.close()
    renderer.close()
    with pytest.raises(InputError, match="this renderer is closed"):
        renderer.draw(make_scene(RowTurn(), 0.1))


def test_bad_input_is_one_sentence(renderer):
    with pytest.raises(InputError, match="picture of 320 x 200 px: give at least 640 x 480"):
        SceneRenderer((320, 200))
    with pytest.raises(InputError, match="unknown render mode 'rgb': did you mean 'rgb_array'"):
        SceneRenderer(mode="rgb")
    many = tuple((f"metric {i}", "1") for i in range(30))
    with pytest.raises(InputError, match="30 metric lines: the panel has room for"):
        renderer.draw(make_scene(RowTurn(), metrics=many))


@pytest.mark.parametrize("module", [None, type(sys)("pygame")], ids=["absent", "the older pygame"])
def test_missing_pygame_names_the_extra(monkeypatch, module):
    monkeypatch.setitem(sys.modules, "pygame", module)
    monkeypatch.setitem(sys.modules, "pygame.freetype", module)
    with pytest.raises(InputError, match=re.escape(how_to_install("render"))):
        SceneRenderer()


def test_import_is_light_and_drawing_needs_no_display():
    code = (
        "import sys, os; os.environ['SDL_VIDEODRIVER'] = 'no_such_driver'\n"
        "import ddagr_gym.rendering.render, ddagr_gym.rendering.video, ddagr_gym.reporting.figures\n"
        "assert not {'pygame', 'matplotlib', 'imageio_ffmpeg'} & set(sys.modules)\n"
        "ddagr_gym.rendering.render.SceneRenderer().close()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""
