"""RRD files as Rerun's own reader sees them."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.viewers.drive_traces import MODELS, PAUSE
from ddagr_gym.viewers.rerun_file import check_rrd_path, write_rrd

chunks = pytest.importorskip("rerun.chunk", reason="needs the extra rerun")


@pytest.fixture(scope="module")
def columns(answered, tmp_path_factory):
    """Record batches by entity."""
    path = tmp_path_factory.mktemp("rrd") / "drives.rrd"
    write_rrd(path, answered.diagnosis, answered.drives)
    reader = chunks.RrdReader(path)
    assert len(reader.blueprints()) == 1
    found = {}
    for chunk in reader.stream():
        found.setdefault(chunk.entity_path, []).append(chunk.to_record_batch())
    return found


def series(batches, name: str) -> tuple[np.ndarray, list]:
    """Times [s] and values of a component, in the order of time."""
    rows = []
    for batch in batches:
        (column,) = [item for item in batch.schema.names if item.endswith(name)] or [None]
        if column is not None and "time" in batch.schema.names:
            seconds = batch.column("time").cast("int64").to_numpy() * 1e-9
            rows += list(zip(seconds, batch.column(column).to_pylist(), strict=True))
    rows.sort(key=lambda row: row[0])
    return np.array([row[0] for row in rows]), [row[1] for row in rows]


@pytest.mark.parametrize("model", MODELS)
def test_residuals_are_those_of_the_drives(answered, columns, model):
    time, values = series(columns[f"/residual/yaw_rate/{model}"], "scalars")
    expected = np.concatenate([drive.residuals[model][:, 2] for drive in answered.drives])
    assert np.array(values).ravel() == pytest.approx(expected[np.isfinite(expected)])
    assert (np.diff(time) > 0.0).all()
    assert time[0] == pytest.approx(answered.drives[0].time[0], abs=1e-6)


def test_the_second_drive_comes_after_the_first(answered, columns):
    time, values = series(columns["/drive/yaw_rate"], "scalars")
    first, second = answered.recordings
    assert len(values) == len(first) + len(second)
    assert time[len(first)] == pytest.approx(first.t[-1] + PAUSE, abs=1e-6)


def test_poses_paths_and_findings_are_there(answered, columns):
    _, places = series(columns["/world/robot/corrected"], "translation")
    assert np.array(places[0]).ravel()[:2] == pytest.approx(
        answered.drives[0].predictions["corrected"][0, 5:7], abs=1e-5
    )
    _, strips = series(columns["/world/paths/corrected"], "strips")
    assert [len(item) for item in strips] == [len(np.unique(drive.window)) for drive in answered.drives]
    time, shown = series(columns["/findings/shows/gyro_scale"], "scalars")
    inside = time < 12.0
    assert (np.array(shown).ravel()[inside] == (time[inside] >= 6.0)).all()
    times, texts = series(columns["/findings/log"], "text")
    assert any(
        "from 6.0 s to 12.0 s" in item[0] and at == pytest.approx(6.0) for at, item in zip(times, texts, strict=True)
    )


def test_names_that_rerun_does_not_open_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"drive\.mcap: give a name that ends in \.rrd"):
        check_rrd_path(tmp_path / "drive.mcap")
