"""First guesses stay inside what an effect allows."""

from ddagr_gym.diagnosis.candidates import candidates_of
from ddagr_gym.diagnosis.hypotheses import first_guess
from ddagr_gym.physics.effects.base import DriveExtent
from ddagr_gym.physics.effects.registry import effect_kinds

EXTENT = DriveExtent(60.0, (-3.0, 3.0), (-2.0, 4.0), 1.2, 3.0)


def test_every_candidate_becomes_an_effect_whatever_its_multiples() -> None:
    for name, kind in effect_kinds().items():
        if name == "sensor_hold":
            continue
        for candidate in candidates_of(kind, EXTENT, 0):
            for size in (0.1, 0.3333333333333333, 1.7, 1e6):
                multiples = [size * (k + 1) / 3.0 for k in range(len(candidate.probes))]
                assert first_guess(candidate, multiples).name == name


def test_reversed_axes_go_all_the_way_together() -> None:
    both = candidates_of(effect_kinds()["accelerometer_sign"], EXTENT, 0)[-1]
    assert first_guess(both, [1.0]).as_mapping()["parameters"] == {"flip_x": 1.0, "flip_y": 1.0}
