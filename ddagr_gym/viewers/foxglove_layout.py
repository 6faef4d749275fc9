"""A layout of Foxglove for the files of :mod:`ddagr_gym.viewers.mcap_file`: the paths, two plots a channel, the log."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ddagr_gym.diagnosis.answer.verdict import Diagnosis
from ddagr_gym.diagnosis.wording import CHANNEL_NAMES
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.reporting.diagnosis_figures import unit_of
from ddagr_gym.viewers.annotations import finding_names
from ddagr_gym.viewers.drive_traces import MODELS, DriveTraces
from ddagr_gym.viewers.mcap_messages import WORLD
from ddagr_gym.viewers.mcap_scene import COLOURS

if TYPE_CHECKING:
    from foxglove import layouts

PLOTTED = ("yaw_rate", "encoder_right", "encoder_left", "specific_force_x", "specific_force_y", "pose_yaw")
"""Channels with plots, in this order; the places are in the map."""


def layout_of(diagnosis: Diagnosis, drives: Sequence[DriveTraces]) -> str:
    """The layout as JSON, which Foxglove imports from a file.

    Args:
        diagnosis: whose findings have a plot of their own.
        drives: whose channels have plots.
    """
    from foxglove import layouts as fl

    known = plotted(drives)
    scene = fl.ThreeDeePanel(config=_scene(drives), title="Measured and predicted paths")
    log = fl.LogPanel(config=fl.LogConfig(topic_to_render="/findings/log"), title="Findings")
    plots = [panel for name in known for panel in (_readings(name), _residuals(name))]
    names = finding_names(diagnosis)
    shows = [_plot("Where findings show", ((f"/findings/shows.{n}", n, "") for n in names))] if names else []
    left = fl.SplitContainer(
        direction="column", items=[fl.SplitItem(proportion=3, content=scene), fl.SplitItem(proportion=1, content=log)]
    )
    right = fl.StackContainer(panels=[fl.StackItem(panel=panel, size=0.3) for panel in (*shows, *plots)])
    content = fl.SplitContainer(
        direction="row", items=[fl.SplitItem(proportion=1, content=left), fl.SplitItem(proportion=1, content=right)]
    )
    return json.dumps(json.loads(fl.Layout(content=content).to_json()), indent=1)


def plotted(drives: Sequence[DriveTraces]) -> tuple[str, ...]:
    """Channels with plots: those of :data:`PLOTTED` that have samples."""
    columns = np.concatenate([drive.measured for drive in drives])
    return tuple(name for name in PLOTTED if np.isfinite(columns[:, CHANNELS.index(name)]).any())


def _scene(drives: Sequence[DriveTraces]) -> layouts.ThreeDeeConfig:
    """From above, all drives in view."""
    from foxglove import layouts as fl

    places = np.concatenate([piece[:, :2] for drive in drives for pieces in drive.paths.values() for piece in pieces])
    low, high = places.min(axis=0), places.max(axis=0)
    x, y = (0.5 * (low + high)).tolist()
    camera = fl.ThreeDeeCameraState(
        perspective=False, phi=0.0, theta_offset=0.0, distance=float(max((high - low).max(), 2.0)) * 1.5,
        target_offset=(x, y, 0.0),
    )  # fmt: skip
    shown = {
        f"/pose/{name}": fl.BaseRendererPoseTopicSettings(visible=True, type="arrow", color=colour)
        for name, colour in COLOURS.items()
    }
    scenes = {name: fl.BaseRendererSceneUpdateTopicSettings(visible=True) for name in ("/paths", "/findings/scene")}
    return fl.ThreeDeeConfig(
        camera_state=camera, fixed_frame=WORLD, follow_tf=WORLD, follow_mode="follow-none", topics={**shown, **scenes}
    )


def _readings(name: str) -> layouts.PlotPanel:
    series = ((f"/{source}.{name}", source, COLOURS[source]) for source in ("measured", *MODELS))
    unit = "rad" if name == "pose_yaw" else unit_of(name)
    return _plot(f"{CHANNEL_NAMES[name]} [{unit}]", series)


def _residuals(name: str) -> layouts.PlotPanel:
    series = ((f"/residual/{model}.{name}", model, COLOURS[model]) for model in MODELS)
    return _plot(f"{CHANNEL_NAMES[name]}: residual over noise", series)


def _plot(title: str, series: Iterable[tuple[str, str, str]]) -> layouts.PlotPanel:
    """Plot of message paths with their labels and colours, "" for one that Foxglove chooses."""
    from foxglove import layouts as fl

    lines = [
        fl.PlotSeries(value=path, label=label, color=colour or None, enabled=True, timestamp_method="receiveTime")
        for path, label, colour in series
    ]
    title = f"{title[:1].upper()}{title[1:]}"
    return fl.PlotPanel(config=fl.PlotConfig(paths=lines, show_legend=True, is_synced=True), title=title)
