"""What is published of an arm, and that all trainings run from one command and go on where they stopped."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="the extra rl is not installed")
pytest.importorskip("matplotlib", reason="the extra report is not installed")

from agents import run as run_module
from agents import train_all as train_all_module
from agents.main import load_settings
from agents.publish import AIMS, publish, rank
from agents.settings import PpoSettings, TrainingSettings
from ddagr_gym.config import dump_config
from ddagr_gym.envs.options import make_settings
from ddagr_gym.policies.archive import load_policy
from ddagr_gym.policies.design import PolicyDesign

TINY = TrainingSettings(
    description="tiny",
    seeds=2,
    steps=64,
    environments=4,
    validation_interval=32,
    design=PolicyDesign(features="raw", frames=2),
    ppo=PpoSettings(rollout=8, batch=16, epochs=1, hidden=(4, 4)),
)


def result(seed, median, p95, success):
    validation = {"radius_error_median": median, "radius_error_p95": p95, "success_rate": success, "mean_return": 1.0}
    validation["heading_radius_error_median"] = median
    return {"seed": seed, "steps": 64, "cpu_seconds": 1.0, "digest": "ab", "validation": validation,
            "course": [{"steps": 0, "cpu_seconds": 0.0, **validation}]}  # fmt: skip


def test_rank_is_one_at_the_aims_and_takes_the_worst():
    assert rank(result(0, *AIMS.values())) == pytest.approx(1.0)
    assert rank(result(0, 0.01, 0.12, 1.0)) == pytest.approx(2.0)
    assert rank(result(0, 0.01, 0.03, 0.90)) == pytest.approx(5.0)
    assert rank(result(0, 0.01, None, 1.0)) == np.inf


def test_all_trainings_are_run_published_and_not_run_again(tmp_path, monkeypatch):
    config = tmp_path / "tiny.yaml"
    config.write_text(dump_config(TINY))
    drawn = [(0, make_settings().draw(np.random.default_rng(0)))]
    monkeypatch.setattr(train_all_module, "PUBLISHED", (str(config),))
    monkeypatch.setattr(run_module, "validation_episodes", lambda: drawn)
    train_all_module.train_all(tmp_path / "runs", publish_to=tmp_path / "policies", write=True)
    folder = tmp_path / "policies" / "tiny"
    assert {file.name for file in folder.iterdir()} == {
        "policy.npz", "seeds", "settings.yaml", "training.json", "training.png", "README.md"
    }  # fmt: skip
    assert sum(file.stat().st_size for file in folder.rglob("*.*")) < 1_000_000
    assert [load_policy(folder / "seeds" / f"seed_{k}.npz").training["seed"] for k in (0, 1)] == [0, 1]
    record = json.loads((folder / "training.json").read_text())
    assert [item["seed"] for item in record["trainings"]] == [0, 1]
    best = min(record["trainings"], key=rank)
    assert record["selected_seed"] == best["seed"] == load_policy(folder / "policy.npz").training["seed"]
    assert load_settings(str(folder / "settings.yaml")) == TINY
    assert record["digest"] == TINY.digest() == best["digest"]
    card = (folder / "README.md").read_text()
    assert card.count("(shipped)") == 1
    assert "2 instants, 4 control steps apart" in card
    before = (folder / "training.json").read_bytes()
    monkeypatch.setattr(run_module, "make_environment", lambda *_: pytest.fail("trained again"))
    train_all_module.train_all(tmp_path / "runs", publish_to=tmp_path / "policies", write=True)
    assert (folder / "training.json").read_bytes() == before


def test_a_policy_that_fails_every_turn_can_be_published(tmp_path):
    settings = replace(TINY, design=PolicyDesign(action="absolute"))
    seed_folder = tmp_path / "runs" / "bad" / "seed_0"
    seed_folder.mkdir(parents=True)
    (seed_folder / "policy.npz").write_bytes(b"weights")
    publish("bad", settings, [result(0, None, None, 0.0)], tmp_path / "runs", tmp_path / "bad")
    card = (tmp_path / "bad" / "README.md").read_text()
    assert "no radius" in card
    assert "fails 100 % of the validation turns" in card


def test_only_what_fails_often_is_warned_of(tmp_path):
    seed_folder = tmp_path / "runs" / "arm" / "seed_0"
    seed_folder.mkdir(parents=True)
    (seed_folder / "policy.npz").write_bytes(b"weights")
    publish("arm", TINY, [result(0, 0.02, 122.0, 0.97)], tmp_path / "runs", tmp_path / "arm")
    card = (tmp_path / "arm" / "README.md").read_text()
    assert "Not for use" not in card
    assert "| 0 (shipped) | 2.00 % | more than 200 % | 97.00 % |" in card
