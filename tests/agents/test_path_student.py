"""A student of the path tracker on the true pose: what it is taught, and that it becomes a policy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="the extra rl is not installed")

from agents.main import load_settings
from agents.path_student import PathStudent, StudentSettings
from ddagr_gym.errors import InputError
from ddagr_gym.parameters import Sensors
from ddagr_gym.policies.archive import load_policy, save_policy
from ddagr_gym.policies.design import PolicyDesign
from ddagr_gym.policies.view import PolicyView
from ddagr_gym.presets import ddagr

SETTINGS = replace(load_settings("ppo_path"), environments=4)
HOW = StudentSettings(rounds=2, steps=20, gradient_steps=5, batch=16, units=8)


def test_a_student_is_a_policy_that_corrects_the_curvature_alone(tmp_path):
    one = PathStudent(SETTINGS, 0, HOW)
    untaught = one.policy()
    policy = load_policy(save_policy(one.teach(), tmp_path / "policy.npz"))
    inputs = np.random.default_rng(0).normal(size=(5, len(policy.design.inputs))).astype(np.float32)
    np.testing.assert_array_equal(untaught(inputs), 0.0)
    assert np.abs(policy(inputs)[:, 0]).min() > 0.0
    np.testing.assert_array_equal(policy(inputs)[:, 1], 0.0)
    assert policy.training["algorithm"] == "student"
    assert len(one.explained) == HOW.rounds


def test_seeds_differ_and_repeat():
    first, again, other = (PathStudent(SETTINGS, seed, HOW).teach() for seed in (0, 0, 1))
    np.testing.assert_array_equal(first.weights[0], again.weights[0])
    assert (first.weights[0] != other.weights[0]).any()


def test_nothing_is_taught_where_the_estimate_is_the_truth():
    """At the start, at rest, both are known but for the offsets of the start: labels are these times the gains."""
    level = replace(SETTINGS.task.randomisation, lateral_offset=0.0, heading_offset=0.0)
    one = PathStudent(replace(SETTINGS, task=replace(SETTINGS.task, randomisation=level)), 0, replace(HOW, steps=14))
    one.teach()
    labels = one._labels[0].reshape(-1, SETTINGS.environments)
    assert np.abs(labels[0]).max() < 0.05


def test_only_the_path_has_a_tracker():
    with pytest.raises(InputError, match="only 'path'"):
        _ = PolicyView(PolicyDesign(), ddagr(), Sensors()).paths
