"""``ddagr evaluate`` end to end on few episodes."""

import json
import sys
from importlib.util import find_spec

import pytest

from ddagr_gym.cli import main
from ddagr_gym.commands import evaluate
from ddagr_gym.errors import InputError
from ddagr_gym.evaluation import controllers
from ddagr_gym.evaluation.claims import load_claims
from ddagr_gym.evaluation.controllers import BOUNDS
from ddagr_gym.policies import shipped


def run_evaluation(folder, *extra):
    return main(["evaluate", "--scenarios", "V", "--workers", "1", "--output", str(folder), *extra])


def content(folder):
    """Bytes of all files, by path."""
    return {path: path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_tables_summary_and_figure(tmp_path, capsys):
    pytest.importorskip("pyarrow")
    pytest.importorskip("matplotlib")
    folder = tmp_path / "out"
    assert run_evaluation(folder, "--controllers", "B1,true_path", "--episodes", "2") == 0
    printed = capsys.readouterr().out
    assert "true_path (upper bound)" in printed
    summary = json.loads((folder / "summary.json").read_text())
    assert set(summary) == {"B1", "true_path"}
    assert summary["B1"]["V"]["episodes"] == 2
    assert set(summary["B1"]["V"]["radius_error_median"]) == {"value", "interval"}
    from pyarrow import parquet

    table = parquet.read_table(folder / "episodes.parquet")
    assert table.num_rows == 4
    assert {"feasible", "radius_error", "estimator_radius", "arm"} <= set(table.column_names)
    driven = parquet.read_table(folder / "episodes")
    assert driven.num_rows == 2 * (1 + len(BOUNDS))
    assert (folder / "radius_error.png").stat().st_size > 10_000
    assert not (folder / "claims.json").exists()  # two episodes decide no claim


def test_a_second_run_drives_nothing_and_agrees(tmp_path, monkeypatch):
    # the page is looked at above
    monkeypatch.setattr("ddagr_gym.commands.evaluation_report.write_report", lambda folder, *_: folder / "report.html")
    folder = tmp_path / "out"
    arguments = ("--controllers", "B1", "--episodes", "2")
    assert run_evaluation(folder, *arguments) == 0
    first, rows = (folder / "summary.json").read_text(), content(folder / "episodes")
    assert run_evaluation(folder, *arguments) == 0
    assert (folder / "summary.json").read_text() == first
    assert content(folder / "episodes") == rows


def test_claims_are_written_and_those_on_what_was_driven_are_printed(tmp_path, capsys):
    claims = load_claims()
    value = {"value": 0.96, "interval": [0.9, 0.99]}
    evaluate._check_claims(tmp_path, {"B4": {"S2": {"success_rate": value}}})
    printed = capsys.readouterr().out
    assert "force balance success beyond the range" in printed
    assert "not driven" not in printed
    written = json.loads((tmp_path / "claims.json").read_text())
    assert len(written) == sum(len(claim.sets) for claim in claims.claims)
    assert [item["verdict"] for item in written if item["arm"] == "B4" and item["set_name"] == "S2"] == ["held"]


def test_a_star_stands_for_trained_policies(monkeypatch):
    names = ("ppo_ekf", "ppo_raw", "ppo_ekf_seed_0", "ppo_ekf_seed_1")
    monkeypatch.setattr(shipped, "policy_names", lambda: names)
    assert evaluate.without_stars(["B1", "ppo_ekf_seed_*", "ppo_ekf_seed_1"]) == ["B1", *names[2:]]
    assert evaluate.without_stars(["ppo_ra*@feed_forward"]) == ["ppo_raw@feed_forward"]
    with pytest.raises(InputError, match=r"no trained policy fits 'sac\*': there are ppo_ekf, ppo_raw"):
        evaluate.without_stars(["sac*"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--controllers", "B9"], "B4"),
        (["--controllers", ","], "--controllers is empty"),
        (["--scenarios", "S11"], "S1"),
        (["--workers", "0"], "--workers 0"),
        (["--episodes", "0"], "at least 1"),
    ],
)
def test_bad_input_is_one_sentence(tmp_path, capsys, arguments, message):
    assert main(["evaluate", "--output", str(tmp_path / "out"), *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error
    assert not (tmp_path / "out").exists()


def test_a_folder_of_something_else_is_left_alone(tmp_path, capsys):
    (tmp_path / "report.html").write_text("mine")
    assert main(["evaluate", "--controllers", "B1", "--scenarios", "V", "--output", str(tmp_path)]) == 2
    assert "holds report.html, which no evaluation wrote: choose another folder" in capsys.readouterr().err
    assert [path.read_text() for path in tmp_path.iterdir()] == ["mine"]


def test_without_ray_nothing_is_made_ready(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("ddagr_gym.extras.find_spec", lambda name: None if name == "ray" else find_spec(name))
    monkeypatch.setattr("ddagr_gym.evaluation.campaign.wanted_episodes", None)
    assert run_evaluation(tmp_path / "out", "--cluster", "local") == 2
    assert ".[cluster]" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_without_casadi_nothing_is_driven(tmp_path, capsys, monkeypatch):
    controllers._predictive.cache_clear()
    monkeypatch.setitem(sys.modules, "casadi", None)
    assert run_evaluation(tmp_path / "out", "--controllers", "B1,B5", "--episodes", "1") == 2
    assert ".[mpc]" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_help_knows_the_default_controller_and_every_drawing(capsys):
    assert main(["evaluate", "--help"]) == 0
    said = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert controllers.DEFAULT in said
    for name in ("S8b and Tb", "S8c and Tc", "S8d and Td"):
        assert name in said
