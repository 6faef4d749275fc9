import sys

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.rendering.video import write_video

imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg", reason="needs the extra render")


def frames(count=12, size=(64, 96)):
    """A bright square that moves right by 4 px a frame on a dark ground."""
    for index in range(count):
        frame = np.full((*size, 3), (30, 40, 50), np.uint8)
        frame[20:40, 4 * index : 4 * index + 20] = (230, 120, 40)
        yield frame


def read(path):
    reader = imageio_ffmpeg.read_frames(str(path))
    meta = next(reader)
    width, height = meta["size"]
    return meta, [np.frombuffer(data, np.uint8).reshape(height, width, 3) for data in reader]


def test_pictures_come_back_in_order(tmp_path):
    path = write_video(tmp_path / "turn.mp4", frames(), frame_rate=20.0)
    meta, pictures = read(path)
    assert meta["codec"] == "h264"
    assert meta["pix_fmt"].startswith("yuv420p")
    assert meta["fps"] == 20.0
    assert meta["size"] == (96, 64)
    assert len(pictures) == 12
    for picture, original in zip(pictures, frames(), strict=True):
        assert np.abs(picture.astype(int) - original).mean() < 4.0
    np.testing.assert_allclose(pictures[0][50, 80], (30, 40, 50), atol=6)


def test_odd_sizes_are_made_even(tmp_path):
    meta, pictures = read(write_video(tmp_path / "odd.mp4", frames(size=(63, 95))))
    assert meta["size"] == (96, 64)
    np.testing.assert_allclose(pictures[0][-1].mean(axis=0), pictures[0][-2].mean(axis=0), atol=4)


def test_same_pictures_same_bytes(tmp_path):
    paths = [write_video(tmp_path / name, frames()) for name in ("one.mp4", "two.mp4")]
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_index_comes_first_so_that_players_start_at_once(tmp_path):
    data = write_video(tmp_path / "turn.mp4", frames()).read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")


def broken():
    yield from frames(5)
    raise RuntimeError("simulated failure")


def test_failure_on_the_way_leaves_what_was_there(tmp_path):
    path = tmp_path / "turn.mp4"
    path.write_text("earlier")
    with pytest.raises(RuntimeError, match="simulated failure"):
        write_video(path, broken())
    assert path.read_text() == "earlier"
    assert [p.name for p in tmp_path.iterdir()] == ["turn.mp4"]


def test_encoder_that_fails_is_told_in_its_words(tmp_path, monkeypatch):
    script = tmp_path / "ffmpeg"
    script.write_text("#!/bin/sh\nhead -c 1000 >/dev/null\necho 'disk quota exceeded' >&2\nexit 3\n")
    script.chmod(0o755)
    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", lambda: str(script))
    with pytest.raises(InputError, match=r"turn\.mp4 cannot be written, ffmpeg says: disk quota exceeded"):
        write_video(tmp_path / "turn.mp4", frames(200, (480, 640)))
    assert [p.name for p in tmp_path.iterdir()] == ["ffmpeg"]


@pytest.mark.parametrize(
    ("name", "pictures", "options", "message"),
    [
        ("turn.mp4", [], {}, "would be empty"),
        ("turn.avi", frames(), {}, "does not end in .mp4"),
        ("turn.mp4", frames(), {"frame_rate": 0.0}, "frame_rate is 0"),
        ("turn.mp4", frames(), {"quality": 60}, "quality is 60"),
        ("turn.mp4", [np.zeros((4, 4), np.uint8)], {}, "frame 0 has shape"),
        ("turn.mp4", [np.zeros((4, 4, 3))], {}, "type float64"),
        ("turn.mp4", [*frames(2), *frames(1, (32, 32))], {}, r"frame 2 has shape \(32, 32, 3\)"),
    ],
)
def test_bad_input_is_one_sentence_and_writes_nothing(tmp_path, name, pictures, options, message):
    with pytest.raises(InputError, match=message):
        write_video(tmp_path / name, pictures, **options)
    assert list(tmp_path.iterdir()) == []


def test_missing_ffmpeg_names_the_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(InputError, match=r"-e '\.\[render\]'"):
        write_video(tmp_path / "turn.mp4", frames())
