"""``ddagr estimate`` end to end: a simulated recording, and what it refuses."""

from __future__ import annotations

import json

import pytest

from ddagr_gym.cli import main


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    pytest.importorskip("pyarrow")
    path = tmp_path_factory.mktemp("runs") / "run.parquet"
    command = ["simulate", "--manoeuvre", "arcs", "--soil", "thesis_a1", "--rate", "50", "--output", str(path)]
    assert main(command) == 0
    return path


def test_figures_table_and_summary(recording, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    from pyarrow import parquet

    folder = tmp_path / "out"
    assert main(["estimate", str(recording), "--output", str(folder)]) == 0
    printed = capsys.readouterr().out
    summary = json.loads((folder / "summary.json").read_text())
    assert abs(summary["errors"]["radius_error"]) < 0.08
    assert f"{summary['errors']['radius_error']:.4g}" in printed
    table = parquet.read_table(folder / "estimates.parquet")
    assert table.num_rows == summary["rows"] == 1800
    for name in ("overview", "innovations", "path", "bank_speeds", "a1", "a2", "b", "covariance_trace", "yaw_rate"):
        assert (folder / f"{name}.png").stat().st_size > 8_000
    # a second run may replace it only when told so
    assert main(["estimate", str(recording), "--output", str(folder)]) == 2
    assert "--overwrite" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "give either a recording or --thesis"),
        (["nothing.parquet"], "nothing.parquet"),
        (["--thesis", "6.2", "--robot", "husky"], "the thesis's runs have their own"),
        (["--thesis", "6.2", "--soil", "thesis_a2"], "unknown soil"),
    ],
)
def test_bad_requests_are_one_sentence_and_leave_nothing(options, message, tmp_path, capsys):
    folder = tmp_path / "out"
    assert main(["estimate", *options, "--output", str(folder)]) == 2
    printed = capsys.readouterr().err
    assert message in printed
    assert printed.count("\n") == 1
    assert not folder.exists()
