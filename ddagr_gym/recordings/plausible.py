"""What no log of a robot holds: stamps in another unit than seconds, gaps of years, readings beyond any sensor."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import numpy as np
import numpy.typing as npt

from ddagr_gym.errors import InputError

FloatArray = npt.NDArray[np.float64]

LONGEST = 1e6
"""Longest recording that is taken [s] (ours): eleven days; beyond it a clock is wrong or several drives are in one
file, and what counts blocks of a drive would fill the memory."""
FASTEST_PERIOD = 1e-6
"""Mean time between rows below which stamps have another unit [s] (ours): no log has a million rows a second."""
SLOWEST_PERIOD = 1.5
"""Time between rows beyond which the unit of the stamps is doubted [s] (ours): logs of 1 Hz exist, and no check of
motion can use a slower one. Milliseconds of 500 Hz, read as seconds, are 2 s apart."""
LONGEST_PAUSE = 600.0
"""Time without rows beyond which a recording may hold two drives [s] (ours)."""
LARGEST_STAMP = 1e305
"""Magnitude of a time stamp beyond which no clock counts [s] (ours): differences of two would overflow."""
IMPOSSIBLE: Mapping[str, float] = {
    # Gyros end at 350 rad/s and motor shafts at 5e3 rad/s, 5e6 in thousandths.
    "rad/s": 1e7,
    # Accelerometers for explosions end at 1e6 m/s^2; those of robots at 2e3 m/s^2, 2e5 in thousandths of g.
    "m/s^2": 1e7,
    # Coordinates fixed to the Earth stay below 1e7 m, 1e10 in millimetres.
    "m": 1e11,
    # A heading that counts turns at 10 rad/s for the longest recording ends at 1e7 rad, 6e8 in degrees.
    "rad": 1e9,
    # Motors of vehicles draw up to 2e3 A from up to 1e3 V, 2e6 and 1e6 in thousandths.
    "A": 1e8,
    "V": 1e8,
}
"""Magnitude by unit beyond which a reading is no number of a sensor (ours). A wild reading, or a channel in a smaller
unit, stays below: the checks and the doubts speak of those."""


def check_stamps(t: FloatArray) -> None:
    """Refuse stamps whose differences would overflow.

    Args:
        t: (n,) clock of the rows [s].

    Raises:
        InputError: with the first stamp beyond :data:`LARGEST_STAMP`.
    """
    beyond = np.flatnonzero(np.abs(t) > LARGEST_STAMP)
    if beyond.size and np.isfinite(t).all():
        row = beyond[0]
        raise InputError(
            f"row {row + 1} has the time {t[row]:g} s, and no clock counts that far: correct it or delete the row."
        )


def check_extent(t: FloatArray) -> None:
    """Refuse times that are not seconds of one recording.

    Args:
        t: (n,), finite [s].

    Raises:
        InputError: longer than :data:`LONGEST`, with the unit that the stamps look like or the place of the gap; rows
            closer together than :data:`FASTEST_PERIOD`.
    """
    if t.size > 1 and t[-1] - t[0] < FASTEST_PERIOD * (t.size - 1):
        raise InputError(
            f"{t.size} rows lie within {t[-1] - t[0]:.3g} s, and no log of a robot is that fast: check the unit of the "
            "time stamps in the column map."
        )
    if t.size < 2 or t[-1] - t[0] <= LONGEST:
        return
    steps = np.diff(t)
    period, row = float(np.median(steps)), int(np.argmax(steps))
    unit = likely_unit(period)
    if unit:
        raise InputError(
            f"rows come every {period:.3g} s and the recording lasts {t[-1] - t[0]:.3g} s: the stamps look like "
            f"{unit}, not seconds; say unit: {unit} under time in the column map, or divide them."
        )
    raise InputError(
        f"between rows {row + 1} and {row + 2} lie {steps[row]:.3g} s, and a recording may last {LONGEST:g} s: correct "
        "the time there, or cut the recording into drives."
    )


def likely_unit(period: float) -> str:
    """Unit in which a time between rows that is too long for seconds would be usual; "" for none.

    Args:
        period: between rows, taken for seconds.
    """
    if period <= SLOWEST_PERIOD:
        return ""
    units = (("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9))
    return next((unit for unit, factor in units if period * factor <= 1.0), "")


def slow_rows(period: float) -> Iterator[str]:
    """A sentence where rows come too slowly for seconds.

    Args:
        period: between rows [s].
    """
    if period > SLOWEST_PERIOD:
        unit = likely_unit(period)
        hint = f" ({unit}?)" if unit else ""
        yield f"rows come every {period:.3g} s: check the unit of the time stamps in the column map{hint}."


def pauses(t: FloatArray, spans: Iterable[slice]) -> Iterator[str]:
    """A sentence on the longest time without rows where it is that between two drives.

    Args:
        t: (n,) time of the rows [s].
        spans: rows that share one clock.
    """
    longest = [(float(np.max(np.diff(t[s]))), s.start + int(np.argmax(np.diff(t[s])))) for s in spans if t[s].size > 1]
    pause, row = max(longest, default=(0.0, 0))
    if pause > LONGEST_PAUSE:
        yield f"no rows come for {pause:.4g} s after row {row + 1}: if two drives are in one file, cut it there."


def check_magnitude(name: str, values: FloatArray, unit: str, t: FloatArray) -> None:
    """Refuse readings that no sensor gives, by :data:`IMPOSSIBLE`.

    Args:
        name: of the channel.
        values: (n,), NaN where there is none.
        unit: of the channel, one of :data:`IMPOSSIBLE`.
        t: (n,) time of the rows [s].

    Raises:
        InputError: with the first such reading, its row and its time.
    """
    wild = np.flatnonzero(np.abs(values) > IMPOSSIBLE[unit])
    if wild.size:
        row = wild[0]
        raise InputError(
            f"{name} is {values[row]:g} {unit} in row {row + 1} at t = {t[row]:.6g} s, which no sensor gives: correct "
            "it or its unit in the map, or leave the field empty."
        )
