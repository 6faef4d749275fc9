"""What is compared of drives: sizes that mean the same in each of them."""

from ddagr_gym.diagnosis.change.drive_scan import _compared, _of_any_drive
from ddagr_gym.diagnosis.search.candidates import candidates_of
from ddagr_gym.physics.effects import DriveExtent
from ddagr_gym.physics.effects.registry import effect_kinds

USUAL = DriveExtent()
"""A drive like that by which probes are told to be of any: 60 s long, at the very same speeds."""


def compared(name: str) -> list:
    kind = effect_kinds()[name]
    found = [_compared(item, 0, _of_any_drive(kind)) for item in candidates_of(kind, USUAL, 0)]
    return [item for item in found if item is not None]


def test_a_threshold_at_a_share_of_a_drives_speed_is_not_held_against_others():
    (zone,) = compared("command_deadband")
    assert all((probe.loss, probe.turning) == (1.0, 0.0) for probe in zone.candidate.probes)


def test_a_change_at_a_time_of_a_drive_has_no_counterpart():
    (always,) = compared("soil_change")
    assert all(probe.onset < -1e3 for probe in always.candidate.probes)


def test_limits_and_sizes_of_any_drive_are_compared():
    assert len(compared("motor_saturation")) == len(candidates_of(effect_kinds()["motor_saturation"], USUAL, 0))
    for name in ("gyro_bias", "payload", "motor_lag", "multipass", "lateral_bulldozing", "slope"):
        assert len(compared(name)) == len(candidates_of(effect_kinds()[name], USUAL, 0)), name
