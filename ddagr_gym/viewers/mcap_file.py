"""MCAP files that Foxglove and PlotJuggler open, written by the ``foxglove-sdk`` in the order of time.

Poses, scene, events and log have the schemas of Foxglove, numbers are JSON.
"""

from __future__ import annotations

import heapq
import json
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ddagr_gym.diagnosis.answer.verdict import Diagnosis
from ddagr_gym.diagnosis.result.files import as_mapping
from ddagr_gym.errors import InputError
from ddagr_gym.files import atomic_path, check_output_file, write_text
from ddagr_gym.progress import counting
from ddagr_gym.viewers.annotations import annotated, doubts
from ddagr_gym.viewers.drive_traces import DriveTraces
from ddagr_gym.viewers.foxglove_layout import layout_of
from ddagr_gym.viewers.mcap_findings import FindingTopics
from ddagr_gym.viewers.mcap_messages import Message, nanoseconds
from ddagr_gym.viewers.mcap_numbers import NumberTopics
from ddagr_gym.viewers.mcap_scene import PoseTopics

if TYPE_CHECKING:
    import foxglove

SUFFIX = ".mcap"
LAYOUT_SUFFIX = ".layout.json"
"""Replaces that of the MCAP file in the name of the layout beside it."""

_STEPS = 20000
"""Messages between two lines of progress (ours)."""


def check_mcap_path(path: str | os.PathLike[str]) -> None:
    """Refuse what cannot be written as an MCAP file, before any work is done for it.

    Raises:
        InputError: another suffix, a folder or a device.
    """
    if Path(path).suffix != SUFFIX:
        raise InputError(f"the MCAP file is to be {os.fspath(path)}: give a name that ends in {SUFFIX}.")
    for name in (Path(path), layout_path(path)):
        check_output_file(name)


def layout_path(path: str | os.PathLike[str]) -> Path:
    """Where the layout for an MCAP file is written."""
    return Path(path).with_suffix(LAYOUT_SUFFIX)


def write_mcap(
    path: str | os.PathLike[str],
    diagnosis: Diagnosis,
    drives: Sequence[DriveTraces],
    progress: Callable[[str], None] | None = None,
) -> None:
    """Write drives, predictions, residuals and findings, whole or not at all, and a layout for Foxglove beside it.

    Args:
        path: file to write, which ends in ``.mcap``.
        diagnosis: the answer.
        drives: that it is of, with their predictions.
        progress: called with a line of text from time to time.

    Raises:
        InputError: see :func:`check_mcap_path`.
    """
    import foxglove
    from foxglove.mcap import MCAPWriteOptions

    check_mcap_path(path)
    context = foxglove.Context()
    messages = _messages(context, diagnosis, drives)
    with atomic_path(path) as temporary:
        options = MCAPWriteOptions(compression_threads=0)
        with foxglove.open_mcap(temporary, allow_overwrite=True, context=context, writer_options=options) as writer:
            _log(messages, drives, progress)
            writer.write_metadata("ddagr diagnosis", _metadata(diagnosis, drives))
            body = json.dumps(as_mapping(diagnosis)).encode()
            stamp = nanoseconds(drives[0], 0.0)
            writer.attach(
                log_time=stamp, create_time=stamp, name="diagnosis.json", media_type="application/json", data=body
            )
    write_text(layout_path(path), layout_of(diagnosis, drives) + "\n")


def _log(messages: Iterator[Message], drives: Sequence[DriveTraces], progress: Callable[[str], None] | None) -> None:
    """Log all messages at their times; the share of the time that is done is the progress."""
    first = nanoseconds(drives[0], 0.0)
    whole = max(nanoseconds(drives[-1], drives[-1].end) - first, 1)
    with counting(100, "writing the MCAP file", progress) as percent:
        done = 0
        for number, (stamp, _, send) in enumerate(messages):
            send(stamp)
            if number % _STEPS == 0:
                now = min(100 * (stamp - first) // whole, 99)
                percent.advance(max(now - done, 0))
                done = max(done, now)
        percent.advance(100 - done)


def _messages(context: foxglove.Context, diagnosis: Diagnosis, drives: Sequence[DriveTraces]) -> Iterator[Message]:
    """All messages in the order of time."""
    found = annotated(diagnosis, drives)
    numbers, poses = NumberTopics(context, diagnosis), PoseTopics(context)
    findings = FindingTopics(context)
    for number, drive in enumerate(drives):
        own = tuple(item for item in found if item.drive == number)
        streams = [
            findings.begin(diagnosis, drive, number, doubts(diagnosis, drive)),
            poses.scene(diagnosis, drive, own),
            findings.stretches(drive, own),
            *poses.motion(drive),
            *numbers.of(drive, number, own),
        ]
        yield from heapq.merge(*streams, key=lambda message: message[:2])


def _metadata(diagnosis: Diagnosis, drives: Sequence[DriveTraces]) -> dict[str, str]:
    """What the file is of, as text."""
    sources = {
        f"recording {number}": (
            f"{drive.recording.meta.source}, begins at {drive.stamp:.3f} s here, at "
            f"{drive.recording.meta.start_time:.3f} s of its own clock"
        )
        for number, drive in enumerate(drives, 1)
    }
    return {
        "sentence": diagnosis.sentence,
        "verdict": ", ".join(diagnosis.verdict),
        "robot": diagnosis.robot,
        "soil": diagnosis.soil,
        "version": diagnosis.version,
        **sources,
    }
