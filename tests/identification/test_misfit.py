"""How much of a misfit names explain, and which channel stands out."""

import pytest

from ddagr_gym.identification.misfit import explained_share, roughest

LIMITS = {"yaw_rate": 1.2, "encoder_right": 1.0, "local_gyro": 0.5}


def test_roughest_is_relative_to_the_limits() -> None:
    name, ratio = roughest({"yaw_rate": 2.4, "local_gyro": 1.5, "pose_x": 90.0}, LIMITS)
    assert (name, ratio) == ("local_gyro", pytest.approx(3.0))
    assert roughest({"pose_x": 3.0}, LIMITS) == ("", 0.0)


def test_explained_share_counts_what_is_beyond_the_ordinary() -> None:
    before = {"yaw_rate": 1.2 * 2.75, "encoder_right": 0.7}
    assert explained_share(before, {"yaw_rate": 1.2 * 0.75, "encoder_right": 0.7}, LIMITS) == pytest.approx(1.0)
    assert explained_share(before, {"yaw_rate": 1.2 * 1.75, "encoder_right": 0.7}, LIMITS) == pytest.approx(0.5)
    assert explained_share(before, {"yaw_rate": 9.0, "encoder_right": 0.7}, LIMITS) == 0.0
    assert explained_share({"yaw_rate": 0.3}, {"yaw_rate": 0.3}, LIMITS) is None
