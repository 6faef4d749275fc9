"""What ``ddagr train`` says without its checkout and to wrong words."""

import pytest

from ddagr_gym.cli import main
from ddagr_gym.commands import train


def test_without_the_checkout_it_says_what_to_do(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(train, "__file__", str(tmp_path / "ddagr_gym" / "commands" / "train.py"))
    assert main(["train", "ppo"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "clone the repository" in said


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (["ppo", "--seed", "-1"], "--seed"),
        (["ppo", "--config", "ppo_ekg"], "ppo_ekf"),
        (["sac", "--config", "ppo_ekf"], "ddagr train ppo"),
        (["ppo", "--set", "ppo.clip=-1"], "clip"),
        (["dqn"], "dqn"),
    ],
)
def test_wrong_words_get_one_sentence(words, part, tmp_path, capsys):
    pytest.importorskip("stable_baselines3", reason="the extra rl is not installed")
    assert main(["train", *words, *(["--output", str(tmp_path)] if words[0] != "dqn" else [])]) == 2
    said = capsys.readouterr().err
    assert part in said
    assert "Traceback" not in said
    assert not list(tmp_path.iterdir())
