"""What the figures of an estimated run show, in the order of the thesis's chapter 6."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.estimation import CHANNELS, channel_statistics
from ddagr_gym.evaluation.estimate_panels import DEVIATIONS, EstimateView, Line, Panel
from ddagr_gym.evaluation.estimate_run import EstimatedRun, dead_reckoned
from ddagr_gym.evaluation.thesis_runs import thesis_run
from ddagr_gym.rendering import palette

Array = NDArray[np.float64]

_STATES = ("v_x", "v_y", "yaw_rate", "omega_right", "omega_left")
_FILES = {
    "path": "path", "bank_speeds": "bank_speeds", "right_bank": "right_bank_speed", "left_bank": "left_bank_speed",
    "v_x": "longitudinal_velocity", "v_y": "lateral_velocity", "yaw_rate": "yaw_rate", "a1": "a1", "a2": "a2",
    "b": "b", "resistance": "motion_resistance", "trace": "covariance_trace",
}  # fmt: skip


def estimate_view(estimated: EstimatedRun, thesis: str | None) -> EstimateView:
    """Panels of a run; those of the thesis's runs carry the numbers of the thesis's figures."""
    numbers = _numbers(thesis)
    motion = [
        ("v_x", "Longitudinal velocity", "m/s", None),
        ("v_y", "Lateral velocity", "m/s", None),
        ("yaw_rate", "Yaw rate", "rad/s", "yaw_rate"),
    ]
    panels = _bank_panels(estimated, numbers)
    panels += [
        Panel(figure_file(name, numbers), _title(title, name, numbers), unit, [_state_line(estimated, name, reading)])
        for name, title, unit, reading in motion
    ]
    panels += _parameter_panels(estimated, numbers)
    panels.append(_trace_panel(estimated, numbers))
    statistics = channel_statistics(estimated.run.standardised, lags=1)
    return EstimateView(
        title=estimated.title,
        t=estimated.run.t,
        spans=estimated.recording.meta.spans,
        panels=panels,
        paths=dead_reckoned(estimated),
        innovations=estimated.run.standardised,
        channels=CHANNELS,
        bands={name: (item.nis, *item.band) for name, item in statistics.items()},
    )


def _numbers(thesis: str | None) -> Mapping[str, str]:
    """Numbers of the thesis's figures of a run, none for a recording."""
    return {} if thesis is None else thesis_run(thesis).figures


def figure_file(name: str, numbers: Mapping[str, str]) -> str:
    """Name of a figure's file, without suffix."""
    number = numbers.get(name)
    return _FILES[name] if number is None else f"figure_{number.replace('.', '_')}_{_FILES[name]}"


def path_file(thesis: str | None) -> str:
    """Name of the path's file."""
    return figure_file("path", _numbers(thesis))


def _title(title: str, name: str, numbers: Mapping[str, str]) -> str:
    return title if name not in numbers else f"{title} (Fig. {numbers[name]})"


def _state_line(estimated: EstimatedRun, name: str, reading: str | None, label: str = "", colour: str = "") -> Line:
    k = _STATES.index(name)
    value, deviation = estimated.run.states[:, k], DEVIATIONS * estimated.run.deviations[:, k]
    return Line(
        label,
        value,
        value - deviation,
        value + deviation,
        estimated.truth.get(name),
        None if reading is None else estimated.recording[reading],
        colour or palette.ESTIMATE,
    )


def _bank_panels(estimated: EstimatedRun, numbers: Mapping[str, str]) -> list[Panel]:
    if "right_bank" in numbers:
        return [
            Panel(
                figure_file(f"{bank}_bank", numbers),
                _title(f"{bank.capitalize()} bank speed", f"{bank}_bank", numbers),
                "rad/s",
                [_state_line(estimated, f"omega_{bank}", f"encoder_{bank}", "", colour)],
            )
            for bank, colour in (("right", palette.RIGHT), ("left", palette.LEFT))
        ]
    lines = [
        _state_line(estimated, f"omega_{bank}", f"encoder_{bank}", bank, colour)
        for bank, colour in (("right", palette.RIGHT), ("left", palette.LEFT))
    ]
    return [Panel(figure_file("bank_speeds", numbers), _title("Bank speeds", "bank_speeds", numbers), "rad/s", lines)]


def _parameter_panels(estimated: EstimatedRun, numbers: Mapping[str, str]) -> list[Panel]:
    values, deviations = estimated.parameters
    truth = None if estimated.law_fit is None else np.exp(estimated.law_fit.logs)
    names = [
        ("a1", "Traction limit $a_1$", "N"),
        ("a2", "Traction rate $a_2$", "-"),
        ("b", "Lateral stiffness $b$", "N/rad"),
        ("resistance", "Motion resistance $R_c$", "N"),
    ]
    panels = []
    for k, (name, title, unit) in enumerate(names[: values.shape[1]]):
        value, spread = values[:, k], DEVIATIONS * deviations[:, k]
        if estimated.model is None:
            low, high = value * (1.0 - spread), value * (1.0 + spread)
        else:
            low, high = value * np.exp(-spread), value * np.exp(spread)
        line = Line("", value, low, high, None if truth is None else float(truth[k]))
        panels.append(Panel(figure_file(name, numbers), _title(title, name, numbers), unit, [line]))
    return panels


def _trace_panel(estimated: EstimatedRun, numbers: Mapping[str, str]) -> Panel:
    """The thesis's filter has one trace over all states; ours has one for each block, because units differ."""
    variances = np.square(estimated.run.deviations)
    if estimated.model is None:
        lines = [Line("tr P", variances.sum(axis=1))]
    else:
        lines = [
            Line("soil (logs)", variances[:, 5:9].sum(axis=1), colour=palette.VERMILLION),
            Line("velocities", variances[:, :3].sum(axis=1), colour=palette.BLUE),
            Line("banks", variances[:, 3:5].sum(axis=1), colour=palette.GREEN),
        ]
    title = _title("Trace of the error covariance", "trace", numbers)
    return Panel(figure_file("trace", numbers), title, "SI", lines, logarithmic=True)
