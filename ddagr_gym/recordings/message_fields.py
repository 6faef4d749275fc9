"""Fields and stamps of ROS messages, for rosbags' objects and for parsed JSON alike."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


def field_of(message: Any, path: str) -> Any:
    """Value at a dotted path of attributes or keys; None where a part is missing."""
    for part in path.split("."):
        message = message.get(part) if isinstance(message, Mapping) else getattr(message, part, None)
        if message is None:
            return None
    return message


def header_stamp(message: Any) -> float | None:
    """Header stamp [s]; None where the message has no header or a stamp of 0 (never filled in)."""
    stamp = field_of(message, "header.stamp")
    if stamp is None:
        return None
    seconds = _first(stamp, "sec", "secs")
    nanoseconds = _first(stamp, "nanosec", "nsec", "nsecs")
    total = seconds + 1e-9 * (nanoseconds if math.isfinite(nanoseconds) else 0.0)
    return total if math.isfinite(total) and total != 0 else None


def _first(message: Any, *names: str) -> float:
    return next((number(message, name) for name in names if field_of(message, name) is not None), math.nan)


def number(message: Any, path: str) -> float:
    """Number at a dotted path; NaN where there is none."""
    return as_number(field_of(message, path))


def as_number(value: Any) -> float:
    """Value as a number; NaN where it is none, as ``null`` in JSON."""
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan


def is_unknown(message: Any, field: str) -> bool:
    """Whether an Imu message says that it does not measure a field: the first of its covariance is -1 (REP 145)."""
    covariance = field_of(message, f"{field}_covariance")
    try:
        return as_number(covariance[0]) == -1.0
    except (TypeError, LookupError):
        return False
