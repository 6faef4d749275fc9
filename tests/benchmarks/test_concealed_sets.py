"""Rates of several sealed sets together."""

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks.concealed_sets import RATES, main, pooled
from benchmarks.score_concealed import share

REPOSITORY = Path(__file__).parents[2]


def scored(hits: int, count: int) -> dict[str, Any]:
    figures: dict[str, Any] = {name: share([number < hits for number in range(count)]) for name in RATES}
    return {**figures, "about": {"commits": [f"of {count}"]}}


def test_cases_count_alike_whatever_their_set() -> None:
    result = pooled([scored(9, 10), scored(15, 30), scored(0, 0)])
    assert result["top1"]["value"] == pytest.approx(24 / 40)
    assert result["top1"]["interval"] == share([number < 24 for number in range(40)])["interval"]
    assert result["targets"]["top1"] == {"least": 0.8, "most": 1.0, "met": False}
    assert result["about"]["commits"] == [["of 10"], ["of 30"], ["of 0"]]


def test_command_writes_figures_and_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    paths = [tmp_path / "a.json", tmp_path / "b.json"]
    for path, made in zip(paths, (scored(9, 10), scored(8, 10)), strict=True):
        path.write_text(json.dumps(made))
    assert main([*map(str, paths), "--output", str(tmp_path / "all.json")]) == 0
    assert json.loads((tmp_path / "all.json").read_text())["top1"]["count"] == 20
    assert (tmp_path / "all.png").read_bytes().startswith(b"\x89PNG")
    assert "top1" in capsys.readouterr().out
    paths[0].write_text(json.dumps(scored(0, 0)))
    assert main([str(paths[0]), "--output", str(tmp_path / "nothing.json")]) == 0
    assert main([str(tmp_path / "none.json")]) == 2
    assert "none.json is no file" in capsys.readouterr().err


def test_kept_result_is_that_of_the_kept_sets() -> None:
    results = REPOSITORY / "benchmarks" / "results"
    sets = [
        json.loads((results / name).read_text())
        for name in (
            "concealed_fifth.json",
            "concealed_sixth.json",
            "concealed_seventh.json",
            "concealed_eighth.json",
            "concealed_ninth.json",
            "concealed_tenth.json",
            "concealed.json",
        )
    ]
    assert json.loads((results / "concealed_sets.json").read_text()) == json.loads(json.dumps(pooled(sets)))
