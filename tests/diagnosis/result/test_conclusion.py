"""Named, named but incomplete, or none of these: what is left over decides, and what was seen in the values stays."""

from types import SimpleNamespace
from typing import Any

import pytest

from ddagr_gym.diagnosis.gates.thresholds import Gate, Thresholds
from ddagr_gym.diagnosis.result.conclusion import _gain, _verdict, accept
from ddagr_gym.diagnosis.search.scanned_model import SearchResult

GATE = 10.0
"""Of every effect."""

GATES = dict.fromkeys(("slope", "gyro_bias"), Gate(GATE, 1.0))
THRESHOLDS = Thresholds(GATES, {"encoder_left": 1.0, "yaw_rate": 1.0, "local_strength": 1.0}, 20, "a test")


def model(*names: str, gain: float = 0.0, held_out: float = 0.0, **misfit: float) -> Any:
    """A model; gains and held-out gains are those of the slope and of the gyro's bias at it."""
    effects = [SimpleNamespace(name=name, confused_with=()) for name in names]
    return SimpleNamespace(
        names=names,
        gains=[SimpleNamespace(name=name, gain=gain) for name in ("slope", "gyro_bias")],
        held_out=dict.fromkeys(("slope", "gyro_bias"), held_out),
        misfit={"encoder_left": 0.5, "yaw_rate": 0.5} | misfit,
        dispersion=1.0,
        terms=SimpleNamespace(overlap={}, imitated={}),
        fitted=SimpleNamespace(cost=0.0, point=SimpleNamespace(effects=effects)),
    )


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


@pytest.mark.parametrize(
    ("gain", "held_out", "yaw_rate", "verdict"),
    [
        (56.0, 55.0, 0.5, ("gyro_bias",)),
        # not many times its gate; not on left-out windows; its own channel is not quiet with it
        (9.0, 9.0, 0.5, ("unknown",)),
        (56.0, 30.0, 0.5, ("unknown",)),
        (56.0, 55.0, 4.0, ("unknown",)),
    ],
)
def test_a_name_that_stands_by_itself_is_said_whatever_is_left(
    gain: float, held_out: float, yaw_rate: float, verdict: tuple[str, ...]
) -> None:
    """An encoder stands at 12 times its limit, of which the bias of a gyro explains nothing."""
    nominal = model(encoder_left=12.0, yaw_rate=40.0, gain=gain * GATE, held_out=held_out * GATE)
    search = found(nominal, model("gyro_bias", encoder_left=12.0, yaw_rate=yaw_rate))
    assert concluded(search) == (verdict, False)


def test_the_gain_of_a_name_is_that_of_the_step_that_added_it() -> None:
    """The slope explained 90 before the gyro's bias was named, and 30 beside it."""
    nominal, biased, both = model(gain=20.0), model("gyro_bias", gain=25.0), model("gyro_bias", "slope")
    step = [SimpleNamespace(name=name, gain=gain) for name, gain in (("gyro_bias", 100.0), ("slope", 90.0))]
    further = [SimpleNamespace(name="slope", gain=30.0)]
    search: Any = SearchResult((nominal, biased, both), (tuple(step), tuple(further)))  # type: ignore[arg-type]
    assert _gain(search, 0, "gyro_bias") == 100.0
    assert _gain(search, 1, "slope") == 30.0
    swapped: Any = SearchResult((nominal, biased, both), (tuple(step), ()))  # type: ignore[arg-type]
    assert _gain(swapped, 1, "slope") == 90.0


def test_what_was_added_to_a_name_that_stands_is_refused_alone() -> None:
    nominal = model(encoder_left=12.0, yaw_rate=40.0, gain=56.0 * GATE, held_out=56.0 * GATE)
    biased = model("gyro_bias", encoder_left=12.0, gain=5.0 * GATE, held_out=5.0 * GATE)
    both = model("gyro_bias", "slope", encoder_left=11.0)
    search = SearchResult((nominal, biased, both), ())
    assert accept(search, THRESHOLDS).chosen is biased
    assert concluded(search) == (("gyro_bias",), False)


def test_a_name_that_the_search_took_back_does_not_stand() -> None:
    nominal = model(encoder_left=12.0, yaw_rate=40.0, gain=56.0 * GATE, held_out=56.0 * GATE)
    swapped = model("slope", encoder_left=12.0)
    search = SearchResult((nominal, model("gyro_bias", encoder_left=12.0), swapped), ())
    assert concluded(search) == (("unknown",), False)
