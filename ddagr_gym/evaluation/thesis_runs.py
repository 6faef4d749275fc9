"""The thesis's two runs (chapter 6), which ``ddagr estimate --thesis`` drives again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from ddagr_gym.config import configs_dir, load_config
from ddagr_gym.errors import unknown_name


@dataclass(frozen=True)
class ThesisRun:
    """One of the thesis's runs.

    Attributes:
        manoeuvre: commands.
        motor_rate: k_omega [1/s].
        soil: on which it is driven here.
        title: in words.
        figures: numbers of the thesis's figures by what they show.
    """

    manoeuvre: str
    motor_rate: float
    soil: str
    title: str
    figures: Mapping[str, str]


@dataclass(frozen=True)
class _File:
    runs: Mapping[str, ThesisRun]


@cache
def thesis_runs() -> Mapping[str, ThesisRun]:
    """Runs by the thesis's table of their commands, of ``configs/evaluation/thesis_runs.yaml``."""
    return load_config(configs_dir() / "evaluation" / "thesis_runs.yaml", _File).runs


def thesis_run(name: str) -> ThesisRun:
    """The run of a table; InputError with the known tables for another name."""
    runs = thesis_runs()
    if name not in runs:
        raise unknown_name("run of the thesis", name, tuple(runs))
    return runs[name]
