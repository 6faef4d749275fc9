"""MCAP files as the readers of another project see them."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ddagr_gym.diagnosis.answer.location import Place
from ddagr_gym.errors import InputError
from ddagr_gym.identification.gauss_newton import fit
from ddagr_gym.identification.misfit import channel_misfit
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.viewers.drive_traces import MODELS, PAUSE, drive_traces
from ddagr_gym.viewers.mcap_file import check_mcap_path, layout_path, write_mcap
from ddagr_gym.viewers.mcap_numbers import NumberTopics
from ddagr_gym.viewers.mcap_scene import _shape
from tests.viewers.conftest import CLOCK
from tests.viewers.reading import read

pytest.importorskip("foxglove", reason="needs the extra foxglove")


@pytest.fixture(scope="module")
def path(answered, tmp_path_factory):
    found = tmp_path_factory.mktemp("mcap") / "drives.mcap"
    write_mcap(found, answered.diagnosis, answered.drives)
    return found


@pytest.fixture(scope="module")
def written(path):
    return read(path)


def test_every_topic_has_a_schema_that_viewers_know(written):
    """PlotJuggler refuses a file with a channel without one."""
    own = {"/drive", "/measured", "/findings/shows"}
    own |= {f"/{name}" for name in MODELS} | {f"/residual/{name}" for name in MODELS}
    known = {
        "/tf": "foxglove.FrameTransform", "/paths": "foxglove.SceneUpdate", "/findings/scene": "foxglove.SceneUpdate",
        "/findings/log": "foxglove.Log", "/findings/events": "foxglove.Event",
        **{f"/pose/{name}": "foxglove.PoseInFrame" for name in ("measured", *MODELS)},
    }  # fmt: skip
    assert {topic for topic, schema in written.schemas.items() if schema.encoding == "jsonschema"} == own
    assert {t: s.name for t, s in written.schemas.items() if s.encoding == "protobuf"} == known
    assert written.stamps == sorted(written.stamps)
    fields = json.loads(written.schemas["/measured"].data)["properties"]
    assert fields["yaw_rate"]["description"].endswith("[rad/s]")


@pytest.mark.parametrize("model", ["refitted", "corrected"])
def test_residuals_have_the_misfit_of_the_models(answered, written, model):
    misfit = channel_misfit(answered.problem, getattr(answered, model))
    for name in CHANNELS:
        values = written.column(f"/residual/{model}", name)[:, 2]
        assert np.mean(values**2) == pytest.approx(misfit[name], rel=1e-6)


def test_the_correction_is_seen_in_the_gyro(written):
    def left(model):
        return np.mean(written.column(f"/residual/{model}", "yaw_rate")[:, 2] ** 2)

    assert left("corrected") < 0.5 * min(left("nominal"), left("refitted"))


def test_measured_means_stand_at_their_times(answered, written):
    """Those of the first drive against its own rows."""
    recording = answered.recordings[0]
    column = written.column("/measured", "yaw_rate")
    column = column[column[:, 0] < CLOCK + recording.t[-1] + 0.5 * PAUSE]
    assert len(column) == 100
    for stamp, time, value in column[::7]:
        assert stamp == pytest.approx(CLOCK + time, abs=1e-6)
        rows = np.abs(recording.t - time) < 0.05
        assert value == pytest.approx(recording["yaw_rate"][rows].mean(), abs=1e-9)


def test_the_drive_is_as_it_was_read(answered, written):
    for name in ("command_right", "encoder_left", "pose_x"):
        expected = np.concatenate([item[name][np.isfinite(item[name])] for item in answered.recordings])
        assert written.column("/drive", name)[:, 2] == pytest.approx(expected)
    assert {item["recording"] for _, item in written.messages["/drive"]} == {1, 2}


def test_several_drives_come_one_after_the_other(answered, written):
    second = next(stamp for stamp, item in written.messages["/drive"] if item["recording"] == 2)
    assert second == pytest.approx(CLOCK + answered.recordings[0].t[-1] + PAUSE, abs=1e-6)
    assert "second.csv" in written.metadata["recording 2"]


def test_poses_and_frames_are_those_of_the_model(answered, written):
    drive = answered.drives[0]
    stamp, first = written.messages["/pose/corrected"][0]
    assert stamp == pytest.approx(CLOCK + drive.time[0], abs=1e-6)
    x, y, yaw = drive.predictions["corrected"][0, -3:]
    assert (first.pose.position.x, first.pose.position.y) == pytest.approx((x, y))
    assert 2.0 * np.arctan2(first.pose.orientation.z, first.pose.orientation.w) == pytest.approx(yaw)
    frames = {item.child_frame_id for _, item in written.messages["/tf"]}
    assert frames == {f"base_link_{name}" for name in ("measured", *MODELS)}
    assert {item.parent_frame_id for _, item in written.messages["/tf"]} == {"world"}


def test_paths_break_between_windows_and_give_way_to_the_next_drive(answered, written):
    updates = [item for _, item in written.messages["/paths"]]
    assert len(updates) == len(answered.drives)
    for update, drive in zip(updates, answered.drives, strict=True):
        entities = {item.id: item for item in update.entities}
        assert set(entities) == {"measured", *MODELS}
        assert len(entities["corrected"].lines) == len(np.unique(drive.window))
        assert len(entities["measured"].lines) == 1
        assert len(update.deletions) == 1


def test_findings_have_their_stretches(written):
    events = [
        ({pair.key: pair.value for pair in item.metadata}, item.start_time, item.end_time)
        for _, item in written.messages["/findings/events"]
    ]
    said = [(item["finding"], item["recording"], item["start"], item["end"], item["located"]) for item, _, _ in events]
    assert said == [
        ("gyro_bias", "1", "0.000 s", "11.980 s", "no"),
        ("gyro_scale", "1", "6.000 s", "12.000 s", "yes"),
        ("gyro_bias", "2", "0.000 s", "9.980 s", "no"),
        ("gyro_scale", "2", "2.000 s", "4.000 s", "yes"),
    ]
    _, begin, end = events[1]
    assert (begin.seconds, begin.nanos) == (int(CLOCK) + 6, 250_000_000)
    assert (end.seconds, end.nanos) == (int(CLOCK) + 12, 250_000_000)


def test_a_number_says_where_a_finding_shows(written):
    values = written.column("/findings/shows", "gyro_scale")
    first = values[values[:, 0] < CLOCK + 12.0]
    assert (first[:, 2] == (first[:, 1] >= 6.0)).all()
    assert {0.0, 1.0} == set(first[:, 2])
    assert set(written.column("/findings/shows", "gyro_bias")[:, 2]) == {1.0}


def test_the_log_has_the_answer_the_doubts_and_the_stretches(written):
    lines = [item.message for _, item in written.messages["/findings/log"]]
    assert "recording 1, first.csv: The gyro reads too much." in lines
    assert lines.count("The poses of second.csv come late.") == 1
    assert any(line.startswith("gyro_scale: ") and "from 6.0 s to 12.0 s, 60 % of its gain" in line for line in lines)
    assert "gyro_scale ends at 4.0 s" in lines


def test_findings_and_places_are_in_the_scene(written):
    (_, update), _ = written.messages["/findings/scene"]
    texts = [text.text for entity in update.entities for text in entity.texts]
    assert any("60 % of its gain" in text for text in texts)
    (disc,) = [disc for entity in update.entities for disc in entity.cylinders]
    assert (disc.pose.position.x, disc.pose.position.y, disc.size.x) == pytest.approx((1.0, 0.5, 0.8))


def test_a_band_is_as_long_as_it_is_and_turned():
    (box,) = _shape(Place(1.0, 0.5, 0.4, half_length=3.0, bearing=math.pi))["cubes"]
    assert "size=Some(Vector3 { x: 6.8, y: 0.8" in repr(box)
    assert "Quaternion { x: 0.0, y: 0.0, z: 1.0, w: 6" in repr(box)  # the cosine of 90 degrees is 6e-17


def test_the_answer_is_attached(answered, written):
    assert json.loads(written.attached["diagnosis.json"])["sentence"] == answered.diagnosis.sentence


def test_the_layout_shows_what_is_in_the_file(path, written):
    layout = json.loads(layout_path(path).read_text())
    shown = set(paths_of(layout))
    assert "/corrected.yaw_rate" in shown
    for name in shown:
        topic, field = name.split(".")
        assert field in json.loads(written.schemas[topic].data)["properties"]
        assert len(written.column(topic, field)) > 0


def paths_of(layout: Any) -> list[str]:
    """Message paths of all plots in a layout."""
    if isinstance(layout, list):
        return [name for item in layout for name in paths_of(item)]
    if not isinstance(layout, dict):
        return []
    own = [layout["value"]] if "timestampMethod" in layout else []
    return own + [name for item in layout.values() for name in paths_of(item)]


def test_a_drive_without_poses_has_paths_of_the_models_only(answered, problem_of, tmp_path):
    whole = answered.recordings[0]
    blind = replace(whole, channels={k: v for k, v in whole.channels.items() if not k.startswith("pose")})
    problem = problem_of(blind)
    refitted = fit(problem, iterations=1)
    drives = drive_traces(problem, refitted, refitted, [blind])
    plain = replace(answered.diagnosis, findings=(), verdict=("none",))
    write_mcap(tmp_path / "blind.mcap", plain, drives)
    found = read(tmp_path / "blind.mcap")
    ((_, update),) = found.messages["/paths"]
    lines = {item.id: len(item.lines) for item in update.entities}
    assert lines["measured"] == 0
    assert lines["nominal"] == len(np.unique(drives[0].window))
    assert "/findings/shows" not in found.schemas


def test_a_file_is_whole_or_as_it_was(answered, path, tmp_path, monkeypatch):
    target = tmp_path / "old.mcap"
    target.write_bytes(b"old")

    def fails(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(NumberTopics, "of", fails)
    with pytest.raises(KeyboardInterrupt):
        write_mcap(target, answered.diagnosis, answered.drives)
    assert [item.name for item in tmp_path.iterdir()] == ["old.mcap"]
    assert target.read_bytes() == b"old"


def test_names_that_no_viewer_opens_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"drive\.bag: give a name that ends in \.mcap"):
        check_mcap_path(tmp_path / "drive.bag")
    (tmp_path / "folder.mcap").mkdir()
    with pytest.raises(InputError, match="is a folder"):
        check_mcap_path(tmp_path / "folder.mcap")
