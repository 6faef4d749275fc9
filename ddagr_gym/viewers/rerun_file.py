"""RRD files for Rerun: the same as in the MCAP files, with a blueprint that arranges it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.diagnosis.answer.verdict import Diagnosis
from ddagr_gym.errors import InputError
from ddagr_gym.files import atomic_path, check_output_file
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.recordings.channels import CHANNELS as SCHEMA
from ddagr_gym.rendering.palette import rgb
from ddagr_gym.viewers.annotations import Annotation, annotated, doubts, finding_names, shows
from ddagr_gym.viewers.drive_traces import MODELS, POSE, DriveTraces
from ddagr_gym.viewers.foxglove_layout import plotted
from ddagr_gym.viewers.mcap_scene import COLOURS

if TYPE_CHECKING:
    import rerun as rr
    from rerun.blueprint import Blueprint

Array = NDArray[np.float64]

SUFFIX = ".rrd"

TIMELINE = "time"
"""Seconds since time 0 of the first drive; further ones come after it."""

_ARROW = 0.3
"""Length of the arrow that stands for the robot [m] (ours)."""


def check_rrd_path(path: str | os.PathLike[str]) -> None:
    """Refuse what cannot be written as an RRD file, before any work is done for it.

    Raises:
        InputError: another suffix, a folder or a device.
    """
    if Path(path).suffix != SUFFIX:
        raise InputError(f"the RRD file is to be {os.fspath(path)}: give a name that ends in {SUFFIX}.")
    check_output_file(path)


def write_rrd(path: str | os.PathLike[str], diagnosis: Diagnosis, drives: Sequence[DriveTraces]) -> None:
    """Write drives, predictions, residuals and findings, whole or not at all.

    Args:
        path: file to write, which ends in ``.rrd``.
        diagnosis: the answer.
        drives: that it is of, with their predictions.

    Raises:
        InputError: see :func:`check_rrd_path`.
    """
    import rerun as rr

    check_rrd_path(path)
    with atomic_path(path) as temporary:
        stream = rr.RecordingStream("ddagr diagnose")
        stream.save(temporary, default_blueprint=_blueprint(diagnosis, drives))
        try:
            _write(_Entities(stream, drives), diagnosis, drives)
            stream.flush()
        finally:
            stream.disconnect()


def _write(entities: _Entities, diagnosis: Diagnosis, drives: Sequence[DriveTraces]) -> None:
    entities.describe(diagnosis)
    found = annotated(diagnosis, drives)
    names = finding_names(diagnosis)
    for number, drive in enumerate(drives):
        own = tuple(item for item in found if item.drive == number)
        entities.drive(drive)
        entities.paths(drive)
        entities.findings(drive, names, own)
        said = f"recording {number + 1}, {drive.recording.meta.source}: {diagnosis.sentence}"
        entities.log(drive, ((said, "INFO"), *((text, "WARN") for text in doubts(diagnosis, drive))), own)


class _Entities:
    """Sends a drive to a recording of Rerun.

    Args:
        stream: of the file.
        drives: of the diagnosis.
    """

    def __init__(self, stream: rr.RecordingStream, drives: Sequence[DriveTraces]) -> None:
        self._stream = stream
        self._first = drives[0].stamp
        self._channels = [k for k in range(len(CHANNELS)) if any(np.isfinite(d.measured[:, k]).any() for d in drives)]

    def describe(self, diagnosis: Diagnosis) -> None:
        """The answer in words, and how lines look."""
        import rerun as rr

        self._stream.log("answer", rr.TextDocument(diagnosis.sentence), static=True)
        self._stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        for name, colour in COLOURS.items():
            arrow = rr.Arrows3D(vectors=[[_ARROW, 0.0, 0.0]], colors=[rgb(colour)])
            self._stream.log(f"world/robot/{name}", arrow, static=True)
            line = rr.SeriesLines(colors=[rgb(colour)], names=name)
            for k in self._channels:
                self._stream.log(f"readings/{CHANNELS[k]}/{name}", line, static=True)
                if name in MODELS:
                    self._stream.log(f"residual/{CHANNELS[k]}/{name}", line, static=True)

    def drive(self, drive: DriveTraces) -> None:
        """Numbers and poses: as they were read, as they were compared, predicted, and what is left over the noise."""
        recording = drive.recording
        for name in SCHEMA:
            self._scalars(f"drive/{name}", drive, recording.t, recording[name])
        sources = {"measured": drive.measured, **drive.predictions}
        for name, values in sources.items():
            self._moved(f"world/robot/{name}", drive, values[:, POSE])
            for k in self._channels:
                self._scalars(f"readings/{CHANNELS[k]}/{name}", drive, drive.time, values[:, k])
        for name, values in drive.residuals.items():
            for k in self._channels:
                self._scalars(f"residual/{CHANNELS[k]}/{name}", drive, drive.time, values[:, k])

    def paths(self, drive: DriveTraces) -> None:
        """Paths of the whole drive, in place of those of the drive before."""
        import rerun as rr

        self._stream.set_time(TIMELINE, duration=drive.stamp - self._first)
        for name, pieces in drive.paths.items():
            strips = [np.pad(piece[:, :2], ((0, 0), (0, 1))) for piece in pieces if len(piece) > 1]
            self._stream.log(f"world/paths/{name}", rr.LineStrips3D(strips, colors=[rgb(COLOURS[name])]))

    def findings(self, drive: DriveTraces, names: Sequence[str], found: Sequence[Annotation]) -> None:
        """1 where a finding shows, else 0."""
        for name, values in zip(names, shows(drive.time, names, found).T, strict=True):
            self._scalars(f"findings/shows/{name}", drive, drive.time, values)

    def log(self, drive: DriveTraces, begin: Sequence[tuple[str, str]], found: Sequence[Annotation]) -> None:
        """Sentences (text, level) at the start of a drive, and a line for each stretch at its start."""
        import rerun as rr

        lines = [(float(drive.recording.t[0]), text, level) for text, level in begin]
        lines += [(item.start, f"{item.finding}: {item.text}, {item.stretch}", "WARN") for item in found]
        for time, text, level in lines:
            self._stream.set_time(TIMELINE, duration=drive.stamp - self._first + time)
            self._stream.log("findings/log", rr.TextLog(text, level=level))

    def _column(self, drive: DriveTraces, time: Array) -> rr.TimeColumn:
        import rerun as rr

        return rr.TimeColumn(TIMELINE, duration=drive.stamp - self._first + time)

    def _scalars(self, path: str, drive: DriveTraces, time: Array, values: Array) -> None:
        """Values (n,) over time; what is not finite is left out."""
        import rerun as rr

        known = np.isfinite(values)
        if known.any():
            columns = rr.Scalars.columns(scalars=values[known])
            rr.send_columns(path, [self._column(drive, time[known])], columns, recording=self._stream, strict=True)

    def _moved(self, path: str, drive: DriveTraces, poses: Array) -> None:
        """Poses (n, 3) of the robot."""
        import rerun as rr

        known = np.isfinite(poses).all(axis=1)
        if known.any():
            x, y, yaw = poses[known].T
            none = np.zeros(len(x))
            places = np.stack([x, y, none], axis=1)
            turns = np.stack([none, none, np.sin(0.5 * yaw), np.cos(0.5 * yaw)], axis=1)
            columns = rr.Transform3D.columns(translation=places, quaternion=turns)
            time = [self._column(drive, drive.time[known])]
            rr.send_columns(path, time, columns, recording=self._stream, strict=True)


def _blueprint(diagnosis: Diagnosis, drives: Sequence[DriveTraces]) -> Blueprint:
    """Paths and log on the left, plots on the right."""
    import rerun.blueprint as rrb

    plots = [
        rrb.TimeSeriesView(
            origin=f"{kind}/{name}", name=f"{name.replace('_', ' ')}{words}",
            # one legend for all: it hides much of so small a plot
            plot_legend=rrb.PlotLegend(visible=number == 0 and not words),
        )
        for number, name in enumerate(plotted(drives))
        for kind, words in (("readings", ""), ("residual", ", residual over noise"))
    ]  # fmt: skip
    where = [rrb.TimeSeriesView(origin="findings/shows", name="where findings show")] if diagnosis.findings else []
    left = rrb.Vertical(
        rrb.Spatial3DView(origin="world", name="paths"),
        rrb.TextDocumentView(origin="answer", name="answer"),
        rrb.TextLogView(origin="findings/log", name="findings"),
        row_shares=[4, 1, 1],
    )
    channels = rrb.Grid(*plots, grid_columns=2, name="channels")
    return rrb.Blueprint(rrb.Horizontal(left, rrb.Tabs(channels, *where)), collapse_panels=True)
