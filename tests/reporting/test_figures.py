import base64
import re
import sys
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.errors import InputError
from ddagr_gym.presets import get_robot
from ddagr_gym.rendering import palette
from ddagr_gym.reporting import figures
from ddagr_gym.reporting.figures import (
    TURN_FIGURE_COLUMNS,
    headland_times,
    house_style,
    save_figure,
    svg_data,
    turn_figure,
)

matplotlib = pytest.importorskip("matplotlib", reason="needs the extra report")

ROBOT = get_robot("ddagr")


def columns_of(turn):
    t = np.arange(0.0, turn.duration, 0.02)
    distance = turn.distance_at(t)
    x, y = turn.position(distance).T
    columns = {name: np.sin(t + index) for index, name in enumerate(TURN_FIGURE_COLUMNS)}
    columns |= {f"true_sinkage_{wheel}": 0.01 + 0.001 * wheel * np.cos(t) for wheel in range(1, 5)}
    columns["yaw_rate"] = np.where(np.arange(len(t)) % 7, 0.2, np.nan)
    return columns | {"t": t, "true_x": x, "true_y": y, "true_yaw": turn.heading(distance)}


@pytest.mark.parametrize(("side", "radius"), [("left", 0.8), ("right", 1.2)])
def test_turn_figure_writes_both_formats(tmp_path, side, radius):
    turn = RowTurn(radius=radius, side=side)
    png, svg = turn_figure(columns_of(turn), turn, tmp_path / "turn", robot=ROBOT, soil_name="thesis_a1")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["turn.png", "turn.svg"] == [png.name, svg.name]
    assert png.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = (int.from_bytes(png.read_bytes()[i : i + 4]) for i in (16, 20))
    assert (width, height) == (1628, 1012)
    assert ElementTree.parse(svg).getroot().tag.endswith("svg")
    assert svg.stat().st_size < 400_000


def test_same_data_same_bytes_whatever_the_user_has_set(tmp_path):
    turn = RowTurn()
    first = turn_figure(columns_of(turn), turn, tmp_path / "a.png", robot=ROBOT, soil_name="soil")
    with matplotlib.rc_context({"lines.linewidth": 9.0, "font.size": 20.0, "figure.facecolor": "black"}):
        second = turn_figure(columns_of(turn), turn, tmp_path / "b.svg", robot=ROBOT, soil_name="soil")
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes() == other.read_bytes()


def test_nothing_global_changes(tmp_path):
    before = dict(matplotlib.rcParams)
    turn_figure(columns_of(RowTurn()), RowTurn(), tmp_path / "turn", robot=ROBOT, soil_name="soil")
    assert dict(matplotlib.rcParams) == before
    with pytest.raises(ZeroDivisionError), house_style():
        assert matplotlib.rcParams["axes.spines.top"] is False
        raise ZeroDivisionError
    assert dict(matplotlib.rcParams) == before


@pytest.mark.parametrize("with_estimate", [False, True])
def test_the_estimated_path_is_a_line_of_its_own_where_there_is_one(tmp_path, monkeypatch, with_estimate):
    drawn = []
    monkeypatch.setattr(figures, "save_figure", lambda figure, path: drawn.append(figure) or (path, path))
    columns = columns_of(RowTurn())
    if with_estimate:
        columns |= {"estimated_x": columns["true_x"] + 0.02, "estimated_y": columns["true_y"]}
    turn_figure(columns, RowTurn(), tmp_path / "turn", robot=ROBOT, soil_name="soil")
    path = drawn[0].axes[0]
    names = [text.get_text() for text in path.get_legend().get_texts()]
    assert names == ["commanded", "driven", "estimated"][: 2 + with_estimate]
    lines = {line.get_label(): line for line in path.lines}
    assert ("estimated" in lines) is with_estimate
    if with_estimate:
        np.testing.assert_array_equal(lines["estimated"].get_xdata(), columns["true_x"] + 0.02)
        assert lines["estimated"].get_color() == palette.ESTIMATE != lines["driven"].get_color()


def test_headland_times():
    t = np.arange(8.0)
    assert headland_times(t, np.array([-1, -1, 0, 1, 1, -1, -1, -1.0])) == [(2.0, 4.0)]
    assert headland_times(t, np.array([1, -1, -1, -1, 1, 1, 1, 1.0])) == [(0.0, 0.0), (4.0, 7.0)]
    assert headland_times(t, -np.ones(8)) == []


def test_a_turn_that_never_turned_is_drawn_too(tmp_path):
    turn = RowTurn()
    columns = columns_of(turn)
    columns |= {"true_x": 0 * columns["t"] - 1.0, "true_y": 0 * columns["t"], "true_yaw": 0 * columns["t"]}
    png, _ = turn_figure(columns, turn, tmp_path / "turn", robot=ROBOT, soil_name="soil")
    assert png.exists()


def test_bad_input_is_one_sentence_and_writes_nothing(tmp_path, monkeypatch):
    turn = RowTurn()
    columns = columns_of(turn)
    (tmp_path / "turn.png").mkdir()
    with pytest.raises(InputError, match=r"turn\.png is a folder"):
        turn_figure(columns, turn, tmp_path / "turn", robot=ROBOT, soil_name="soil")
    (tmp_path / "turn.png").rmdir()
    monkeypatch.setitem(sys.modules, "matplotlib.style", None)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(InputError, match=r"-e '\.\[report\]'"):
        turn_figure(columns, turn, tmp_path / "turn", robot=ROBOT, soil_name="soil")
    del columns["true_slip_ratio_2"]
    with pytest.raises(InputError, match="column 'true_slip_ratio_2' is missing"):
        turn_figure(columns, turn, tmp_path / "turn", robot=ROBOT, soil_name="soil")
    assert list(tmp_path.iterdir()) == []


def test_failed_save_leaves_no_file(tmp_path):
    from matplotlib.figure import Figure

    class Broken(Figure):
        def savefig(self, path, **options):
            path.write_text("half")
            raise RuntimeError("no memory")

    with pytest.raises(RuntimeError, match="no memory"):
        save_figure(Broken(), tmp_path / "turn")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("dpi", [None, 110])
def test_a_figure_for_a_page_is_an_svg_with_rounded_paths(dpi):
    from matplotlib.figure import Figure

    with house_style():
        figure = Figure(figsize=(2.0, 1.0), layout="constrained")
        figure.subplots().plot([0.0, 1.0, 2.0], [0.123456789, 0.5, 0.3])
        data = svg_data(figure, dpi)
    kind, _, content = data.partition(",")
    assert kind == "data:image/svg+xml;base64"
    svg = base64.b64decode(content).decode()
    root = ElementTree.fromstring(svg)
    assert root.get("viewBox") == "0 0 144 72"  # points, whatever the dots
    places = " ".join(re.findall(r' (?:d|x|y)="([^"]*)"', svg))
    assert re.search(r"\.\d\d\b", places)
    assert not re.search(r"\.\d\d\d", places)
    assert "<text" not in svg
