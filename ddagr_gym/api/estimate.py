"""``ddagr_gym.estimate``: speeds and soil over a recording, by the filter."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from ddagr_gym.api.inputs import Source, recording_from
from ddagr_gym.api.nominal import RobotLike, SoilLike, robot_from, robot_or_recorded, soil_from
from ddagr_gym.api.results import Report, Table
from ddagr_gym.errors import InputError, at_least, unknown_name
from ddagr_gym.files import atomic_path, write_json
from ddagr_gym.progress import counting

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ddagr_gym.evaluation.estimate_run import EstimatedRun

ThesisTable = Literal["6.2", "6.3"]
UNITS = {"traction_limit": "N", "traction_rate": "-", "lateral_stiffness": "N/rad", "motion_resistance": "N"}
"""Of the force law's parameters a1, a2, b and Rc."""


@dataclass(frozen=True)
class SoilParameter:
    """A parameter of the force law at the end of a drive; ``float()`` gives its value.

    Attributes:
        value: in unit; None where the filter broke down.
        unit: SI.
        relative_deviation: standard deviation of its logarithm.
        best_fit: value that the true forces fit best, None where they are unknown.
    """

    value: float | None
    unit: str
    relative_deviation: float | None
    best_fit: float | None

    def __float__(self) -> float:
        return float("nan") if self.value is None else self.value


@dataclass(frozen=True, eq=False, repr=False)
class EstimateResult(Report):
    """Estimates over a recording.

    ``report`` writes estimates.parquet, summary.json and the figures; it needs pyarrow. Figures come in the order of
    the thesis's chapter 6, with bands of two standard deviations, and the truth where the recording has it.

    Attributes:
        run: states, covariances, innovations and the recording behind them.
        thesis: table of the thesis whose run was driven, None for a recording.
    """

    run: EstimatedRun
    thesis: ThesisTable | None = None

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Final parameters, errors where the truth is known, normalised innovations squared with bands."""
        from ddagr_gym.evaluation.estimate_run import summary_of

        return summary_of(self.run)

    @cached_property
    def columns(self) -> dict[str, NDArray[np.float64]]:
        """(T,) by name: ``t`` [s], states with standard deviations, soil parameters, path, innovations."""
        from ddagr_gym.evaluation.estimate_run import table_of

        return table_of(self.run)

    @property
    def parameters(self) -> dict[str, SoilParameter]:
        """Final parameters of the force law by name."""
        return {
            name: SoilParameter(item["value"], UNITS[name], item["log_deviation"], item["best_fit"])
            for name, item in self.summary["parameters"].items()
        }

    @property
    def errors(self) -> dict[str, float | None]:
        """Root mean square errors and the radius error, empty without truth; None where the filter broke down."""
        return dict(self.summary["errors"])

    @property
    def headline(self) -> str:
        """What was estimated, by which filter."""
        found = self.summary
        return f"{found['title']}: {found['seconds']:.0f} s, filter {found['filter']}, force law {found['force_law']}"

    def tables(self) -> Sequence[Table]:
        """Final parameters, and errors where the truth is known."""
        from ddagr_gym.reporting.estimate_text import HEADER, error_rows, parameter_rows

        errors = error_rows(self.summary)
        return [
            Table(HEADER, parameter_rows(self.summary)),
            *([Table(("error", "value"), errors)] if errors else []),
        ]

    def __str__(self) -> str:
        from ddagr_gym.reporting.estimate_text import estimate_text

        return estimate_text(self.summary)

    def to_pandas(self) -> Any:
        """The columns as a pandas.DataFrame."""
        from ddagr_gym.api.tables import pandas_of

        return pandas_of(self.columns)

    def to_json(self, path: str | os.PathLike[str]) -> None:
        """Write the summary as JSON, whole or not at all."""
        write_json(path, self.summary)

    def _fill(self, folder: Path, progress: Callable[[str], None] | None) -> None:
        from ddagr_gym.evaluation.estimate_view import estimate_view, path_file
        from ddagr_gym.reporting.estimate_figures import figure_count, save_estimate_figures

        view = estimate_view(self.run, self.thesis)
        self._write_table(folder / "estimates.parquet")
        self.to_json(folder / "summary.json")
        with counting(figure_count(view), "figures", progress) as steps:
            save_estimate_figures(view, folder, path_file(self.thesis), steps.advance)

    def _write_table(self, path: Path) -> None:
        import pyarrow as pa
        from pyarrow import parquet

        with atomic_path(path) as part:
            parquet.write_table(pa.table(self.columns), part)


def estimate(
    recording: Source | None = None,
    robot: RobotLike | None = None,
    *,
    thesis: ThesisTable | None = None,
    soil: SoilLike | None = None,
    motor_rate: float | None = None,
    filter: Literal["ours", "thesis"] = "ours",
    law: Literal["coupled", "thesis"] = "coupled",
    attitude: bool = False,
    seed: int = 0,
    column_map: str | os.PathLike[str] | None = None,
) -> EstimateResult:
    """Estimate speeds and soil over a recording.

    Args:
        recording: one recording, table with the schema's columns, or path; None with ``thesis``.
        robot: that drove: name, YAML file or object; where it is None the one that the recording names, else the
            ddagr with a warning.
        thesis: drive and estimate the run of this table of the thesis's chapter 6 instead.
        soil: with ``thesis`` the name of the soil to drive on; else the soil whose parameters are shown for comparison.
        motor_rate: of the speed loop [1/s], where it is not the robot's.
        filter: ours, or the thesis's eight-state filter.
        law: force law of our filter.
        attitude: our filter uses the recorded roll and pitch [rad]; only right where they count from the horizon.
        seed: of the simulated run, and of what is resampled.
        column_map: shipped map by name or the path of one's own, for a file that is not imported yet.

    Returns:
        States, soil parameters, errors where the recording holds the truth, figures.

    Raises:
        InputError: neither a recording nor a table of the thesis, or both; unknown names; no rows; the attitude for
            the thesis's filter or run, which are level.

    Examples:
        >>> import ddagr_gym
        >>> drive = ddagr_gym.simulate("arcs", rate=50.0)
        >>> result = ddagr_gym.estimate(drive)
        >>> abs(result.errors["radius_error"]) < 0.08
        True
        >>> result.parameters["motion_resistance"].unit
        'N'
    """
    from ddagr_gym.estimation import ForceLaw
    from ddagr_gym.evaluation.estimate_run import estimate_recording, estimate_thesis_run

    at_least(seed=(seed, 0))
    if (recording is None) == (thesis is None):
        raise InputError(
            "give either a recording or --thesis 6.2 or 6.3 (thesis=... in Python): one of them is what is estimated."
        )
    chosen = ForceLaw[_known("force law", law, ForceLaw.__members__)]
    _known("filter", filter, ("ours", "thesis"))
    if thesis is not None:
        own = {"motor_rate": (motor_rate, None), "map": (column_map, None), "attitude": (attitude, False)}
        _refuse_own(robot=(robot, None), **own)
        return EstimateResult(estimate_thesis_run(thesis, str(soil or ""), filter, chosen, seed), thesis)
    assert recording is not None
    if attitude and filter == "thesis":
        raise InputError(
            "attitude True with the thesis's filter, which knows level ground alone: leave one of them out."
        )
    read = recording_from(recording, robot, column_map)
    known = robot_from(robot_or_recorded(robot, [read]))
    read = recording_from(read, known)
    found = known if motor_rate is None else replace(known, motor_rate=motor_rate)
    expected = None if soil is None else soil_from(soil)
    return EstimateResult(estimate_recording(read, found, expected, filter, chosen, attitude, seed))


def _known(kind: str, name: str, known: Iterable[str]) -> str:
    """The name, where it is one of the known ones."""
    names = tuple(known)
    if name not in names:
        raise unknown_name(kind, name, names)
    return name


def _refuse_own(**options: tuple[Any, Any]) -> None:
    """Refuse what a run of the thesis has already."""
    for name, (given, default) in options.items():
        if given != default:
            raise InputError(f"{name.replace('_', '-')} {given}: the thesis's runs have their own; leave it out.")
