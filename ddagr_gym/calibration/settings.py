"""Choices of a calibration."""

from __future__ import annotations

from dataclasses import dataclass

LONGEST_DELAY = 1.0
"""Longest delay of the commands that a fit finds [s]: twice that of the slowest robot we know (0.43 s, a Warthog)."""

HISTORY = 1.2
"""Commands kept from before a window [s]: the longest delay and two samples at 10 Hz."""


@dataclass(frozen=True)
class CalibrationSettings:
    """How drives are cut and how much of them is used.

    Attributes:
        window: length of the windows [s]: long enough for an integral part to wind up, and one step of the DRIVE
            protocol.
        fitted: windows of a drive that the joint fit uses, evenly spread over it.
        compared: windows of a drive that the fits use which only decide on parts.
        judged: windows of a left-out drive that are forecast.
        settlings: times that a fit without a part goes on, where its forecasts are worse and it is not settled (ours):
            with the wheels' places of a Warthog as on its data sheet, forecasts of its six drives were 4 % worse after
            8 steps and 2 % better after 16.
        threads: of the simulator.
        seed: of resampled intervals.
        supply_currents: also use currents that motors draw from their supply; their own always count. On simulated
            drives those of the supply, at 1 Hz, made nothing better known (benchmarks/motor_currents.py).
        least_explained: share of the squared error of left-out wheel speeds that all parts together must take away from
            the data sheet's; below it no single part is asked for.
        doubted: names of parts that forecasts may ask for as well, encoder_scale and command_gain; where nothing makes
            them suspicious, they would be one more way for the wheels to fall short of their commands.
    """

    window: float = 6.0
    fitted: int = 30
    compared: int = 12
    judged: int = 100
    settlings: int = 3
    threads: int = 1
    seed: int = 0
    supply_currents: bool = False
    least_explained: float = 0.0
    doubted: tuple[str, ...] = ()
