"""An effect that contains another one stays in the set where its further size cannot be told."""

import pytest

import ddagr_gym
from ddagr_gym.physics.effects.centre_of_mass_offset import CentreOfMassOffset
from ddagr_gym.physics.effects.payload import Payload


@pytest.mark.slow
@pytest.mark.parametrize("truth", [Payload(50.0, -0.3, 0.1, 0.6), CentreOfMassOffset(-0.06, 0.0)])
def test_a_load_off_the_centre_and_an_offset_centre_of_mass_are_one_set(truth):
    drives = [
        ddagr_gym.simulate(name, effects=(truth,), rate=25.0, pose_rate=5.0, seed=seed).recording
        for seed, name in enumerate(("arcs", "s_weave"))
    ]
    result = ddagr_gym.diagnose(drives, names_only=True)
    (finding,) = result.findings
    assert set(finding.equivalence_set) == {"centre_of_mass_offset", "payload"}
    assert "these drives do not tell them apart" in result.sentence
