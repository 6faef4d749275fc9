"""The answer in words: every effect of the library, sizes with their doubt, shares."""

import math
import re
from dataclasses import dataclass, replace

import pytest

from ddagr_gym.diagnosis.answer.amounts import Amount, amounts, number, quantity, with_interval
from ddagr_gym.diagnosis.answer.location import Unevenness
from ddagr_gym.diagnosis.answer.verdict import Estimate, Finding
from ddagr_gym.diagnosis.localisation.operating_condition_words import uneven_phrase
from ddagr_gym.diagnosis.result.sentences import headline, share_in_words
from ddagr_gym.diagnosis.wording import SENTENCES, describe, in_sentence, title
from ddagr_gym.physics.effects.registry import effect_kinds


def finding(name, **parameters):
    return Finding(name, {key: Estimate(*value) for key, value in parameters.items()}, 50.0, 10.0, 5.0, 40.0)


def text(name, **parameters):
    return describe(name, {key: Amount(*value) for key, value in parameters.items()})


PATCH = {
    "strength": (0.8, "-"), "stiffness": (1.0, "-"), "centre_x": (1.5, "m"), "centre_y": (-0.2, "m"),
    "radius": (0.9, "m"),
}  # fmt: skip
SLOPE = {"angle": (0.06458, "rad", (0.0593, 0.0698)), "direction": (0.5585, "rad", (0.49, 0.63))}


def test_the_headline_says_what_how_big_and_what_is_left():
    sentence = headline(("slope",), True, [finding("slope", **SLOPE)], 0.71)
    assert sentence == (
        "The ground slopes 3.7 ± 0.3 degrees, rising towards 32 ± 4 degrees from the x axis; 71 % of the mismatch; "
        "nothing else above what these data can show."
    )


def test_the_headline_says_where_a_size_is_another_one():
    uneven = uneven_phrase(
        Unevenness("speed", "m/s", 0.5, None, 1.42, 0.8, 0.01), f"the size of {in_sentence('slope')}"
    )
    sentence = headline(("slope",), True, [finding("slope", **SLOPE)], 0.71, [uneven])
    assert sentence.endswith(
        "; 71 % of the mismatch; the size of sloping ground is not the same everywhere: 1.4 of the fitted one at "
        "speeds above 0.50 m/s, 0.80 elsewhere; nothing else was found, but what is named is doubtful."
    )


def test_headlines_of_the_other_verdicts():
    assert headline(("none",), True, []) == "Nothing is missing that these recordings can show."
    assert headline(("unknown",), False, []).startswith("Something is missing that no effect")
    two = [finding("slope", **SLOPE), finding("command_delay", delay=(0.12, "s", (0.11, 0.13)))]
    sentence = headline(("slope", "command_delay"), False, two)
    assert ", and commands act 0.120 ± 0.010 s late; something more is left" in sentence
    three = [*two, finding("gyro_sign", flip=(1.0, "-", None))]
    assert "; and the gyro's sign is reversed;" in headline(("a", "b", "c"), True, three)


@pytest.mark.parametrize(("share", "words"), [(0.004, "less than 1 %"), (0.708, "71 %"), (0.996, "all"), (1.0, "all")])
def test_shares_in_words(share, words):
    assert share_in_words(share) == words


@pytest.mark.parametrize("name", sorted(effect_kinds()))
def test_every_effect_has_a_clause_with_its_main_size(name):
    kind = effect_kinds()[name]
    assert name in SENTENCES
    values = {}
    for field in (*kind.size_names(), *kind.shape_names()):
        data = kind.parameter(field).metadata
        default = kind.parameter(field).default
        value = default if data["neutral"] is None else min(data["neutral"] + 4.0 * data["least"], data["high"])
        value = 0.8 if name == "motor_saturation" else float(value)
        values[field] = Amount(value, data["unit"], (value - 0.01, value + 0.01))
    clause = describe(name, values)
    assert clause == clause.strip()
    assert not clause.endswith(".")
    assert "nan" not in clause
    assert kind.categorical or re.search(r"\d", clause)
    assert "_" not in clause


@pytest.mark.parametrize(
    ("clause", "words"),
    [
        (text("slope", angle=(-0.02, "rad"), direction=(0.0, "rad")), "1.1 degrees, rising towards 180 degrees"),
        (text("slope", angle=(0.02, "rad"), direction=(6.28, "rad")), "1.1 degrees, rising towards −0.18 degrees"),
        (text("slope", angle=(0.02, "rad"), direction=(-3.0, "rad")), "1.1 degrees, rising towards −172 degrees"),
        (text("slope", angle=(0.02, "rad"), direction=(-1.5708, "rad")), "towards −90 degrees"),
        (text("encoder_scale", right=(0.97, "-"), left=(1.0, "-")), "the right encoder reads 3.0 % too little"),
        (text("encoder_scale", right=(0.97, "-"), left=(1.0, "-"), loop=(1.0, "-")), "and the speed loop believes it"),
        (text("motor_droop", droop=(0.002, "rad/(s N m)"), shared=(0.4, "-")), "2.0 mrad/s per N m of both banks"),
        (text("motor_droop", droop=(0.002, "rad/(s N m)"), power=(0.9, "-")), "both banks at 0.7 rad/s, in proportion"),
        (text("motor_droop", droop=(0.002, "rad/(s N m)"), recovery=(0.5, "1/s")), "takes it back, at 0.50 1/s"),
        (text("motor_lag", lag=(0.4, "s"), slowing=(0.1, "-")), "0.40 s more slowly, mostly while they speed up"),
        (text("towed_drag", force=(60.0, "N"), hitch_distance=(0.5, "m"), rope=(0.8, "m")), "on a rope of 0.8 m"),
        (text("wheel_radius_mismatch", difference=(-0.02, "-")), "the left wheels are 2.0 % larger than the right"),
        (text("gyro_bias", bias=(-0.01, "rad/s", (-0.011, -0.009))), "off by −0.57 ± 0.06 degrees/s"),
        (text("imu_tilt", roll=(0.0, "rad"), pitch=(-0.035, "rad")), "tilted 2.0 degrees nose up"),
        (text("accelerometer_sign", flip_x=(0.0, "-"), flip_y=(1.0, "-")), "accelerometer's sideways axis is reversed"),
        (text("soil_change", strength=(0.8, "-"), stiffness=(1.0, "-"), onset=(-1e6, "s")), "20 % weaker than the"),
        (text("soil_change", strength=(0.8, "-"), stiffness=(1.0, "-"), onset=(12.0, "s")), "model's from 12 s on"),
        (text("soil_patch", **PATCH), "the soil is 20 % weaker within 0.90 m of (1.50, −0.20) m"),
        (text("soil_patch", **PATCH, half_length=(0.0, "m"), bearing=(0.3, "rad")), "weaker within 0.90 m of (1.50"),
        (
            text("soil_patch", **PATCH, half_length=(7.0, "m"), bearing=(2.0, "rad", (1.9, 2.1))),
            "20 % weaker in a band 1.8 m wide that runs at −65 ± 6 degrees from the x axis through (1.50, −0.20) m",
        ),
        (text("payload", mass=(25.0, "kg"), x=(0.0, "m"), y=(0.0, "m"), height=(0.6, "m")), "25 kg heavier, above"),
        (text("motor_saturation", speed_limit=(0.8, "rad/s"), acceleration_limit=(1e6, "rad/s^2")), "faster than 0.80"),
        (
            text(
                "motor_saturation", speed_limit=(1e3, "rad/s"), acceleration_limit=(1e6, "rad/s^2"),
                turning_limit=(0.3, "rad/s"),
            ),
            "the banks differ from their mean by no more than 0.30 rad/s, a limit of the turning",
        ),
        (
            text(
                "motor_saturation", speed_limit=(1e3, "rad/s"), acceleration_limit=(1e6, "rad/s^2"),
                torque_limit=(45.0, "N m"), power_limit=(1e6, "W"),
            ),
            "the banks have no more torque than 45 N m each, a limit of the torque",
        ),
        (
            text("sensor_hold", duration=(0.1, "s"), gyro=(1.0, "-"), accelerometer=(0.0, "-")),
            "repeated for 0.10 s (gyro)",
        ),
    ],
)  # fmt: skip
def test_directions_signs_and_factors_in_words(clause, words):
    assert words in clause


def test_what_a_drive_controller_does_to_turns_alone_is_said_of_turns():
    lag = {"lag": (0.3, "s"), "second_pole": (0.0, "-"), "slowing": (1.0, "-")}
    assert "turning answers 0.30 s more slowly" in text("motor_lag", **lag, turning=(1.0, "-"))
    assert text("motor_lag", **lag, turning=(0.0, "-")).startswith("the motors answer")
    width = {"width": (0.2, "rad/s"), "loss": (0.0, "-")}
    assert "turns of less than 0.20 rad/s" in text("command_deadband", **width, turning=(1.0, "-"))
    assert text("command_deadband", **width, turning=(0.0, "-")).startswith("commands below")


def test_soil_that_is_heaped_up_is_said_to_be():
    assert "heaped it up" in text("lateral_bulldozing", scale=(2.0, "-"), angle=(0.8, "-"), way=(0.3, "m"))
    assert "heaped" not in text("lateral_bulldozing", scale=(2.0, "-"), angle=(0.05, "-"), way=(0.0, "m"))


def test_encoders_outside_the_speed_loop_are_believed_by_nobody():
    assert "believes" not in text("encoder_scale", right=(0.97, "-"), left=(1.0, "-"), loop=(0.0, "-"))


def test_effects_of_other_packages_are_described_by_title_and_sizes(monkeypatch):
    @dataclass
    class Kind:
        title = "Wet GPS antenna"

    import ddagr_gym.diagnosis.wording as wording

    monkeypatch.setattr(wording, "effect_kinds", lambda: {"wet_antenna": Kind})
    assert title("wet_antenna") == "Wet GPS antenna"
    assert text("wet_antenna", wet_share=(0.3, "m/s^2", (0.2, 0.4))) == "wet GPS antenna (wet share +0.30 ± 0.10 m/s²)"
    assert title("not_installed") == "Not installed"
    assert in_sentence("wet_antenna") == "wet GPS antenna"


@pytest.mark.parametrize(
    ("amount", "words"),
    [
        (Amount(3.714, "-", (3.40, 4.02)), "3.7 ± 0.3 m"),
        (Amount(0.1234, "-", (0.1222, 0.1246)), "0.1234 ± 0.0012 m"),
        (Amount(151.0, "-", (136.0, 166.0)), "151 ± 15 m"),
        (Amount(3.2, "-", (2.0, 3.3)), "3.2 m (2.0 to 3.3)"),
        (Amount(-3.2, "-", (-3.3, -3.1)), "3.20 ± 0.10 m"),
        (Amount(0.0, "-", None), "0 m"),
        (Amount(float("nan"), "-", None), "– m"),
    ],
)
def test_quantities(amount, words):
    assert quantity(amount, "m") == words


def test_numbers():
    assert [number(v) for v in (0.01234, -5.0, 1234.0, 2e-5, 3e7)] == ["0.012", "−5.0", "1234", "2.0e−05", "3.0e+07"]


def test_an_interval_without_ends_is_none():
    sound = amounts({"delay": Estimate(0.1, "s", (0.09, 0.11))})["delay"]
    assert (sound.value, sound.unit, sound.interval) == (0.1, "s", (0.09, 0.11))
    assert amounts({"delay": Estimate(0.1, "s", (0.09, math.nan))})["delay"].interval is None
    assert amounts({"delay": Estimate(0.1, "s")})["delay"].interval is None


def test_the_headline_names_rivals_that_explain_as_much():
    item = replace(
        finding("slope", **SLOPE), equivalence_set={"slope": 0.5, "accelerometer_bias": 0.45, "imu_tilt": 0.05}
    )
    sentence = headline(("slope",), True, [item])
    told = "(or accelerometer bias: these drives do not tell them apart; less likely tilted IMU); nothing else"
    assert told in sentence
    alone = replace(item, equivalence_set={"slope": 0.85, "imu_tilt": 0.15})
    assert "x axis (less likely tilted IMU); nothing else" in headline(("slope",), True, [alone])


def test_a_factor_near_one_keeps_what_it_differs_by():
    assert with_interval(Amount(1.05, "-", (1.04, 1.06))) == "1.050 (1.040 to 1.060)"
    assert with_interval(Amount(0.2, "s", (0.16, 0.24))) == "0.20 s (0.16 to 0.24)"
    assert with_interval(Amount(0.2, "s")) == "0.20 s"
    assert with_interval(Amount(0.2, "s", (0.2, 0.2))) == "0.20 s (0.20 to 0.20)"
