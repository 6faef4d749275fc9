"""Arm and seed from policy names, with substitutes for trained policies."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.evaluation.policy_seeds import arm_and_seed, one_arm_each, policy_version
from ddagr_gym.policies import shipped


@pytest.fixture
def policy(monkeypatch, tmp_path):
    """Every policy was trained with seed 3 and has this file."""
    file = tmp_path / "policy.npz"
    file.write_bytes(b"weights")
    monkeypatch.setattr(shipped, "find_policy", lambda name: SimpleNamespace(training={"seed": 3}))
    monkeypatch.setattr(shipped, "policy_file", lambda name: file)
    return file


@pytest.mark.parametrize(
    ("name", "arm"),
    [
        ("ppo_ekf_seed_3", "ppo_ekf"),
        ("ppo_ekf_3", "ppo_ekf"),
        ("ppo_ekf-s3", "ppo_ekf"),
        ("ppo_ekf", "ppo_ekf"),
        ("ppo_ekf_13", "ppo_ekf_13"),
        ("ppo_ekf_4", "ppo_ekf_4"),
        ("runs/ppo_ekf/seed_3/policy.npz", "runs/ppo_ekf"),
        ("runs/ppo_ekf_seed_3/policy.npz", "runs/ppo_ekf"),
        ("other/ppo_ekf/seed_3/policy.npz", "other/ppo_ekf"),
        ("runs/ppo_raw_3.npz", "runs/ppo_raw"),
        ("runs/mine/policy.npz", "runs/mine"),
        ("ppo_ekf_seed_3@frozen", "ppo_ekf@frozen"),
    ],
)
def test_seeds_of_a_training_are_one_arm(policy, name, arm):
    assert arm_and_seed(name) == (arm, 3)


def test_version_changes_with_file_and_estimate(policy):
    first = policy_version("ppo_ekf")
    assert policy_version("ppo_ekf@wrong") != first
    assert policy_version("ppo_ekf") == first
    policy.write_bytes(b"other weights")
    assert policy_version("ppo_ekf") != first


def test_a_policy_in_the_present_folder_is_no_published_one(policy):
    assert arm_and_seed("ppo_ekf_3.npz") == (str(Path("ppo_ekf").absolute()), 3)


def test_two_policies_that_are_one_seed_of_one_arm_are_refused_before_they_drive(policy):
    both = ["runs/a/seed_3/policy.npz", "runs/a_3.npz"]
    with pytest.raises(InputError, match="training seed 3 of 'runs/a'"):
        one_arm_each(both)
    one_arm_each(["B1", "ppo_ekf_seed_3", "runs/ppo_ekf/seed_3/policy.npz", "runs/ppo_raw/seed_3/policy.npz"])
