"""Video files from pictures: MP4, H.264, by the ffmpeg that imageio-ffmpeg brings (the extra ``render``)."""

from __future__ import annotations

import math
import subprocess
import tempfile
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError
from ddagr_gym.extras import need
from ddagr_gym.recordings.files import write_atomically

Frame = NDArray[np.uint8]


def ffmpeg_program() -> str:
    """Path of the ffmpeg program, or an InputError that names the extra."""
    need("imageio_ffmpeg")
    import imageio_ffmpeg

    return str(imageio_ffmpeg.get_ffmpeg_exe())


def write_video(path: str | Path, frames: Iterable[Frame], frame_rate: float = 25.0, quality: int = 18) -> Path:
    """Write pictures as an MP4 file that common players and slides take (H.264, yuv420p, BT.709, fast start).

    The file is whole or absent. Odd sizes are made even by repeating the last row or column.

    Args:
        path: file to write, ending in ``.mp4``, in a folder that exists.
        frames: pictures (height, width, 3) uint8, all of one size; taken one at a time.
        frame_rate: pictures per second.
        quality: constant rate factor of x264, 0 (lossless) to 51; 18 looks lossless.

    Returns:
        The path.

    Raises:
        InputError: no pictures, one of another size or type, a bad path, rate or quality, or imageio-ffmpeg absent.
    """
    path = Path(path)
    if path.suffix.lower() != ".mp4":
        raise InputError(f"{path} does not end in .mp4: video is written in that format only.")
    if not (math.isfinite(frame_rate) and 0.0 < frame_rate <= 1000.0):
        raise InputError(f"frame_rate is {frame_rate!r}: give frames per second in (0, 1000].")
    if not 0 <= quality <= 51:
        raise InputError(f"quality is {quality!r}: give a rate factor from 0 (lossless) to 51.")
    program = ffmpeg_program()
    pictures = iter(frames)
    first = next(pictures, None)
    if first is None:
        raise InputError(f"{path} would be empty: give at least one frame.")
    shape = _check_frame(first, np.shape(first), 0)
    size = f"{shape[1] + shape[1] % 2}x{shape[0] + shape[0] % 2}"
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", f"{frame_rate:.6f}", "-i", "-"]
    tags = "setparams=colorspace=bt709:color_primaries=bt709:color_trc=bt709"
    colour = ["-vf", f"scale=out_color_matrix=bt709:out_range=tv,{tags}"]
    codec = ["-c:v", "libx264", "-preset", "medium", "-crf", str(quality), "-pix_fmt", "yuv420p"]
    container = ["-movflags", "+faststart", "-fflags", "+bitexact", "-map_metadata", "-1", "-f", "mp4"]
    command = [program, "-y", "-v", "error", *source, *colour, *codec, *container]
    write_atomically(path, lambda temporary: _encode([*command, str(temporary)], _even(first, pictures, shape), path))
    return path


def _check_frame(frame: Frame, shape: tuple[int, ...], index: int) -> tuple[int, int, int]:
    given = np.shape(frame)
    if len(given) != 3 or given != shape or given[2] != 3 or np.asarray(frame).dtype != np.uint8 or 0 in given:
        kind = np.asarray(frame).dtype
        raise InputError(f"frame {index} has shape {given} and type {kind}: give equal (height, width, 3) uint8.")
    return given[0], given[1], given[2]


def _even(first: Frame, rest: Iterator[Frame], shape: tuple[int, int, int]) -> Iterator[bytes]:
    padding = ((0, shape[0] % 2), (0, shape[1] % 2), (0, 0))
    for index, frame in enumerate(chain([first], rest)):
        _check_frame(frame, shape, index)
        yield np.pad(frame, padding, mode="edge").tobytes()


def _encode(command: list[str], pictures: Iterator[bytes], path: Path) -> None:
    with tempfile.TemporaryFile() as complaints:
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=complaints)
        try:
            _feed(process, pictures)
            process.wait()
        finally:
            # Only still running after an error here: its file is not wanted any more.
            if process.poll() is None:
                process.kill()
                process.wait()
        if process.returncode:
            complaints.seek(0)
            reason = complaints.read().decode(errors="replace").strip().splitlines() or [f"code {process.returncode}"]
            raise InputError(f"{path} cannot be written, ffmpeg says: {reason[-1]}.")


def _feed(process: subprocess.Popen[bytes], pictures: Iterator[bytes]) -> None:
    if process.stdin is None:
        raise InputError("ffmpeg takes no pictures: its input is closed.")
    for picture in pictures:
        try:
            process.stdin.write(picture)
        except BrokenPipeError:
            # It ended early; its exit code and its last words say why.
            break
    try:
        process.stdin.close()
    except BrokenPipeError:
        return
