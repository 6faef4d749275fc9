"""Turns beside another simulator's: bookkeeping, then what the page says about agreement and its reasons."""

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.simulator import simulate
from ddagr_gym.validation import chrono


@pytest.fixture(scope="module")
def reference(shared_dir):
    return chrono.read_turns(shared_dir / "reference")


@pytest.fixture(scope="module")
def comparison(reference):
    turns, agreements = chrono.compare(reference)
    return turns, {item.variant: item for item in agreements}


def test_robot_is_the_described_one():
    robot = chrono.reference_robot()
    assert robot.mass == 80.0
    assert robot.wheels[0].outer_radius == pytest.approx(0.2)
    assert (2 * robot.half_track, 2 * robot.half_wheelbase) == (0.8, 0.6)
    # box, four point masses at 0.5 m, and 1 % for the wheels' own inertia
    assert robot.yaw_inertia == pytest.approx(5.9 + 20.0 * 0.25, rel=0.03)


def test_rows_are_read_with_their_wheels_and_banks(reference):
    assert len(reference.soil) == 18
    assert set(reference.soil) == {"loose_sand", "sandy_loam"}
    row = 1  # loose_sand, 3.00 +- 0.60: sink_fl 0.0295, fr 0.0291, rl 0.0418, rr 0.0414
    np.testing.assert_allclose(reference.commands[row], [3.6, 2.4])
    np.testing.assert_allclose(reference.sinkage[row], [0.0291, 0.0295, 0.0414, 0.0418])
    np.testing.assert_allclose(reference.axle_torque[row], [-10.2793, -5.5156, -16.6260, -1.7441])


def test_reference_is_consistent_with_its_own_kinematics(reference):
    """The table's yaw-rate ratio is over the kinematics without slip."""
    robot = chrono.reference_robot()
    right, left = reference.commands[1]
    kinematic = robot.wheels[0].outer_radius * (right - left) / (2.0 * robot.half_track)
    assert reference.yaw_rate[1] / kinematic == pytest.approx(0.6898, abs=2e-4)
    straight = chrono.bank_slips(reference, chrono.reference_robot())[0]
    np.testing.assert_allclose(straight, 1.0 - 0.5824 / 0.6, atol=1e-3)


def test_reference_against_itself_agrees(reference):
    same = chrono.agreement("same", reference, reference)
    turning = np.isfinite(same.yaw_rate_ratio)
    assert turning.sum() == 16
    np.testing.assert_allclose(same.yaw_rate_ratio[turning], 1.0)
    np.testing.assert_allclose(same.front_sinkage_ratio, 1.0)
    np.testing.assert_allclose(same.slip_difference[np.isfinite(same.slip_difference)], 0.0)
    assert same.correlation == pytest.approx(1.0)


def test_turns_are_steady_when_they_are_read_off():
    robot, soil = chrono.reference_robot(), chrono.reference_soil("loose_sand")
    drive = simulate(robot, soil, np.tile([6.0, 0.0], (round(chrono.DURATION * 125), 1)))
    assert abs(drive["true_yaw_rate"][-1] - drive["true_yaw_rate"][-126]) < 1e-6


def test_trends_agree(comparison, reference):
    turns, agreements = comparison
    model = agreements[chrono.HEADLINE]
    assert model.correlation > 0.9
    assert (np.sign(turns[chrono.HEADLINE].yaw_rate) == np.sign(reference.yaw_rate))[reference.yaw_rate > 0.01].all()
    # loose sand is deeper than sandy loam in both
    loose = np.array(reference.soil) == "loose_sand"
    assert turns[chrono.HEADLINE].sinkage[loose].min() > turns[chrono.HEADLINE].sinkage[~loose].max()


def test_model_turns_slower_because_it_pushes_against_compaction(comparison):
    """The figures that the module states; a change here is a change of the physics or of the page."""
    _, agreements = comparison
    model, without = agreements[chrono.HEADLINE], agreements["no compaction resistance"]
    assert np.nanmedian(model.yaw_rate_ratio) == pytest.approx(0.73, abs=0.02)
    assert np.nanmedian(without.yaw_rate_ratio) == pytest.approx(0.99, abs=0.02)
    assert np.nanmin(without.yaw_rate_ratio) == pytest.approx(0.87, abs=0.02)
    assert np.nanmax(without.yaw_rate_ratio) == pytest.approx(1.07, abs=0.02)
    assert np.nanmedian(without.speed_ratio) == pytest.approx(0.98, abs=0.02)


def test_ruts_matter_less(comparison):
    _, agreements = comparison
    median = {name: np.nanmedian(item.yaw_rate_ratio) for name, item in agreements.items()}
    assert median[chrono.HEADLINE] < median["rear wheels in stiff ruts"] < median[chrono.HEADLINE] + 0.05
    assert median["rear wheels in stiff ruts"] < median["rear wheels at full shear strength"]
    assert median["rear wheels at full shear strength"] < median["no compaction resistance"]


def test_missing_data_is_one_sentence(tmp_path):
    with pytest.raises(InputError, match="does not exist: give the folder of the reference data"):
        chrono.read_turns(tmp_path)
