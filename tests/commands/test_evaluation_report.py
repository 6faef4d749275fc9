"""The page of ``ddagr evaluate``, ``--replay``, and the demonstration's step, on few episodes."""

import json

import pytest

from ddagr_gym.cli import main
from ddagr_gym.commands import demo_evaluation, evaluation_report
from ddagr_gym.commands.evaluation_report import assemble, write_report
from ddagr_gym.evaluation.campaign import run_campaign
from ddagr_gym.evaluation.controllers import DEFAULT
from ddagr_gym.evaluation.dataset import EPISODES
from ddagr_gym.evaluation.report_data import Arm
from ddagr_gym.evaluation.summary import summaries
from ddagr_gym.policies import shipped

pytest.importorskip("matplotlib", reason="needs the extra report")
pytest.importorskip("jinja2", reason="needs the extra report")
pytest.importorskip("pyarrow", reason="needs the extra io")


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    folder = tmp_path_factory.mktemp("driven")
    return run_campaign(["true_path", "B1", "B4"], ["V"], folder / EPISODES, processes=1, count=2)


def test_evidence_says_what_everything_was_made_of(rows):
    found = assemble(rows, summaries(rows), [])
    assert [arm.name for arm in found.arms] == ["B1", "B4", "true_path"]  # what sees the truth stands last
    assert [arm.deployable for arm in found.arms] == [True, True, False]
    assert not any(arm.learned for arm in found.arms)
    assert (found.sets[0].driven, found.sets[0].scenarios) == (2, 100)
    assert "2 of 100 of V" in found.note
    sources = dict(found.sources)
    assert set(sources) >= {"ddagr-gym", "gains of the ladder", "scenarios V"}
    assert len(sources["scenarios V"].removeprefix("sha256 ")) == 16


def test_ablations_are_held_against_their_own_training_seed(rows, monkeypatch):
    """A policy of two seeds, one close and one far off, and the first one frozen, in between."""

    def copies(controller, arm, run, error):
        mine = [row for row in rows if row["controller"] == "B1"]
        return [row | {"controller": controller, "arm": arm, "run": run, "radius_error": error} for row in mine]

    driven = copies("close", "ppo_ekf", 4, 0.01) + copies("far", "ppo_ekf", 5, 0.05)
    driven += copies("frozen", "ppo_ekf@frozen", 4, 0.02) + copies("raw", "ppo_raw", 4, 0.02)
    arms = [Arm(name, "", learned=True) for name in ("ppo_ekf", "ppo_ekf@frozen", "ppo_raw")]
    monkeypatch.setattr(evaluation_report, "_arms", lambda rows, summary: arms)
    found = assemble(driven, summaries(driven), [])
    assert found.over_headline["ppo_ekf@frozen"]["value"] == 0.0
    assert found.over_headline["ppo_raw"]["value"] == 0.5
    (text, alone), *more = found.headline_alone.items()
    assert not more
    assert text == "ppo_ekf, training seed 4 alone"
    assert alone["radius_error_median"]["value"] == 0.01
    assert alone["episodes"] == 2


def test_the_page_shows_paths_and_the_estimate(rows, tmp_path):
    page = write_report(tmp_path, rows, summaries(rows), films=False).read_text()
    for alt in ("True paths over the commanded one", "True and estimated path"):
        assert f'alt="{alt}"' in page
    assert "<video" not in page
    assert not (tmp_path / "videos").exists()


def test_one_scenario_is_driven_again_with_figure_and_video(rows, tmp_path, capsys):
    pytest.importorskip("pygame", reason="needs the extra render")
    pytest.importorskip("imageio_ffmpeg", reason="needs the extra render")
    assert main(["evaluate", "--replay", "B1:V:1", "--output", str(tmp_path)]) == 0
    assert "turn radius error" in capsys.readouterr().out
    row = json.loads((tmp_path / "B1_V_1.json").read_text())
    driven = next(item for item in rows if (item["controller"], item["number"]) == ("B1", 1))
    assert {key: driven[key] for key in row} == row
    for suffix in ("png", "mp4", "parquet"):
        assert (tmp_path / f"B1_V_1.{suffix}").stat().st_size > 10_000


def test_a_scenario_that_is_not_there_is_one_sentence(tmp_path, capsys):
    assert main(["evaluate", "--replay", "B1:V:100", "--output", str(tmp_path / "out")]) == 2
    assert "scenarios 0 to 99" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_the_demonstration_ends_with_a_page(monkeypatch, tmp_path):
    pytest.importorskip("imageio_ffmpeg", reason="needs the extra render")
    monkeypatch.setattr(shipped, "selected_policies", lambda: ())
    section = demo_evaluation.evaluation_step(tmp_path, scenarios=2, workers=1)
    assert all(name in section.text for name in (*demo_evaluation.LADDER, DEFAULT))
    for link in ("evaluation/report.html", "evaluation/radius_error.png", "evaluation/summary.json"):
        assert link in section.html
        assert (tmp_path / link).is_file()
    assert list((tmp_path / "evaluation" / "videos").glob("*.mp4"))
