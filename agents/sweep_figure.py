"""Courses of the trainings of a sweep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ddagr_gym.recordings.files import write_atomically
from ddagr_gym.rendering import palette
from ddagr_gym.reporting.figures import house_style

_COLOURS = (palette.BLUE, palette.ORANGE, palette.GREEN, palette.PURPLE, palette.GREY)


def draw_courses(
    courses: Mapping[str, Sequence[tuple[bool, Sequence[Mapping[str, Any]]]]], objective: str, path: Path
) -> None:
    """A line for each training, a colour for each configuration, a cross where one was stopped; PNG.

    Args:
        courses: by configuration: whether a training was stopped, and its validations.
        objective: what is drawn of a validation.
        path: where.
    """
    with house_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(8.0, 4.5), layout="constrained")
        axes = figure.subplots()
        for number, (name, trainings) in enumerate(courses.items()):
            colour, style = _COLOURS[number % len(_COLOURS)], ("-", "--", ":")[number // len(_COLOURS) % 3]
            axes.plot([], [], style, color=colour, label=name)
            for stopped, course in trainings:
                steps, values = [item["steps"] for item in course], [item[objective] for item in course]
                axes.plot(steps, values, style, color=colour, lw=1.2)
                if stopped and course:
                    axes.plot(steps[-1:], values[-1:], "x", color=colour, ms=7)
        axes.set_xlabel("control steps")
        axes.set_ylabel("mean return on the validation set")
        axes.set_title("a line is a seed; a cross: stopped, it fell behind")
        axes.legend(frameon=False)
        write_atomically(path, lambda to: figure.savefig(to, format="png", dpi=120))
