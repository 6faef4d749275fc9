"""The policies that are committed: complete, small, of today's settings, and as good as their cards say."""

from __future__ import annotations

import json
import re

import pytest

pytest.importorskip("stable_baselines3", reason="the extra rl is not installed")

from agents.main import load_settings
from agents.publish import rank
from agents.run import validation_episodes
from agents.train_all import PUBLISHED
from agents.validation import drive_all
from ddagr_gym.envs.options import make_settings
from ddagr_gym.number_files import MAXIMUM_BYTES
from ddagr_gym.policies.archive import load_policy
from ddagr_gym.policies.controller import policy_controller
from ddagr_gym.policies.shipped import policies_dir, selected_policies

SEEDS_AT_LEAST = {"ppo_ekf": 10, "ppo_raw": 5, "ppo_history": 5}
"""Of the protocol (theory: control, section 5), and of what the arms are said to have."""


ABSOLUTE_PATH = re.compile(r"(?<![\w.*/)])/[a-z]\w*/")
"""A folder from the root of some machine; not of an address, a ratio or a path inside the repository."""


def record_of(name):
    return json.loads((policies_dir() / name / "training.json").read_text())


def test_every_arm_is_there():
    assert set(selected_policies()) == set(PUBLISHED)


@pytest.mark.parametrize("name", PUBLISHED)
def test_an_arm_is_complete_and_of_the_present_settings(name):
    folder, record, settings = policies_dir() / name, record_of(name), load_settings(name)
    assert settings.seeds >= SEEDS_AT_LEAST.get(name, 1)
    assert record["digest"] == settings.digest()
    assert load_settings(str(folder / "settings.yaml")) == settings
    trainings = {training["seed"]: training for training in record["trainings"]}
    assert set(trainings) == set(range(settings.seeds))
    assert record["selected_seed"] == min(trainings, key=lambda seed: rank(trainings[seed]))
    for seed, training in trainings.items():
        file = folder / "seeds" / f"seed_{seed}.npz"
        policy = load_policy(file)
        assert file.stat().st_size < MAXIMUM_BYTES
        assert policy.design == settings.design
        assert policy.training["seed"] == seed
        assert policy.training["digest"] == training["digest"] == record["digest"]
    shipped = folder / "seeds" / f"seed_{record['selected_seed']}.npz"
    assert (folder / "policy.npz").read_bytes() == shipped.read_bytes()
    assert (folder / "training.png").stat().st_size < MAXIMUM_BYTES


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_card_names_the_seed_and_no_place_on_a_machine(name):
    record = record_of(name)
    card = (policies_dir() / name / "README.md").read_text()
    assert f"| {record['selected_seed']} (shipped) |" in card
    for text in (card, (policies_dir() / name / "training.json").read_text()):
        assert not ABSOLUTE_PATH.search(text)
    shipped = next(item for item in record["trainings"] if item["seed"] == record["selected_seed"])
    assert ("Not for use" in card) == (shipped["validation"]["success_rate"] < 0.95)


def test_the_headline_turns_as_its_card_says():
    shipped = record_of("ppo_ekf")
    policy = policy_controller("ppo_ekf").policy
    found = drive_all(policy, policy.design, make_settings(ekf_features=True), validation_episodes()).summary()
    said = next(t["validation"] for t in shipped["trainings"] if t["seed"] == shipped["selected_seed"])
    # trained and validated with 7 nodes on each side of a contact's peak, driven with today's 4
    assert found == pytest.approx(said, rel=1e-3, abs=1e-3)
