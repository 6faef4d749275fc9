"""Named, named but incomplete, or none of these: what is left over decides, and what was seen in the values stays."""

from types import SimpleNamespace
from typing import Any

import pytest

from ddagr_gym.diagnosis.gates.thresholds import Thresholds
from ddagr_gym.diagnosis.result.conclusion import _verdict, accept
from ddagr_gym.diagnosis.search.scanned_model import SearchResult

THRESHOLDS = Thresholds({}, {"encoder_left": 1.0, "yaw_rate": 1.0, "local_strength": 1.0}, 20, "a test")


def model(*names: str, **misfit: float) -> Any:
    return SimpleNamespace(names=names, gains=(), misfit={"encoder_left": 0.5, "yaw_rate": 0.5} | misfit)


def found(nominal: Any, chosen: Any) -> SearchResult:
    return SearchResult((nominal, chosen), ())


def concluded(search: SearchResult, seen: tuple[str, ...] = ()) -> tuple[tuple[str, ...], bool]:
    return _verdict(accept(search, THRESHOLDS), seen, THRESHOLDS)


@pytest.mark.parametrize(
    ("before", "left", "verdict", "complete"),
    [
        (8.0, {}, ("slope",), True),
        (8.0, {"encoder_left": 1.2}, ("slope",), False),
        (8.0, {"encoder_left": 6.0}, ("unknown",), False),
        (80.0, {"encoder_left": 11.0}, ("unknown",), False),
        (80.0, {"encoder_left": 9.0}, ("slope",), False),
        # the share explained is one of the channels: what local variations make up for leaves the name incomplete
        (0.9, {"encoder_left": 0.9, "local_strength": 1.7}, ("slope",), False),
    ],
)
def test_what_is_left_in_the_channels_takes_a_name_away(
    before: float, left: dict[str, float], verdict: tuple[str, ...], complete: bool
) -> None:
    search = found(model(encoder_left=before), model("slope", **left))
    assert concluded(search) == (verdict, complete)


def test_repeats_stay_named_whatever_is_left() -> None:
    search = found(model(encoder_left=8.0), model("slope", encoder_left=7.9))
    assert concluded(search) == (("unknown",), False)
    assert concluded(search, ("sensor_hold",)) == (("sensor_hold",), False)
    alone = model(encoder_left=0.5)
    assert concluded(found(alone, alone), ("sensor_hold",)) == (("sensor_hold",), True)


def test_names_that_leave_too_much_leave_the_model_too() -> None:
    rough = found(model(encoder_left=8.0), model("slope", encoder_left=7.9))
    assert accept(rough, THRESHOLDS).chosen is rough.nominal
    good = found(model(encoder_left=8.0), model("slope"))
    assert accept(good, THRESHOLDS) is good
