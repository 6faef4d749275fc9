"""A PID loop in discrete time with clamped output and conditional integration (theory: control, eq. (3))."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ddagr_gym.validated import Validated, bounded


@dataclass(frozen=True)
class PidGains(Validated):
    """Gains of u = proportional e + integral sum(e dt) + derivative de/dt, |u| <= limit."""

    proportional: float = bounded("-", 0.0, 1e6, default=0.0)
    integral: float = bounded("1/s", 0.0, 1e6, default=0.0)
    derivative: float = bounded("s", 0.0, 1e6, default=0.0)
    limit: float = bounded("-", 0.0, 1e6, default=1.0)


class Pid:
    """State of one loop.

    Args:
        gains: of the loop.
        period: between calls [s].
    """

    def __init__(self, gains: PidGains, period: float) -> None:
        self.gains = gains
        self.period = period
        self.reset()

    def reset(self) -> None:
        """Forget the integral and the last error."""
        self._integral = 0.0
        self._last: float | None = None

    def memory(self) -> tuple[float, float]:
        """Integral and last error, NaN where there is none; see :meth:`restore`."""
        return self._integral, math.nan if self._last is None else self._last

    def restore(self, integral: float, last: float) -> None:
        """Back to what :meth:`memory` gave."""
        self._integral, self._last = integral, None if math.isnan(last) else last

    def update(self, error: float) -> float:
        """Output for an error; the integral stands still while it would push further into the limit."""
        gains = self.gains
        slope = 0.0 if self._last is None else (error - self._last) / self.period
        self._last = error
        integral = self._integral + error * self.period
        output = gains.proportional * error + gains.integral * integral + gains.derivative * slope
        if abs(output) <= gains.limit or output * error < 0.0:
            self._integral = integral
        return min(max(output, -gains.limit), gains.limit)
