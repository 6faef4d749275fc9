"""The queries of the page on episodes run in DuckDB and Polars, and find what our own reader finds."""

from __future__ import annotations

import subprocess
import sys
from statistics import median

import pytest

pytest.importorskip("pyarrow", reason="needs the extra io")

from ddagr_gym.evaluation.dataset import EpisodeDataset
from tests.evaluation.test_dataset import row
from tools.documentation.pages import ROOT, blocks

BLOCKS = blocks((ROOT / "docs" / "how-to" / "episodes_dataset.md").read_text())
NAMES = ("B1", "/home/me/my policy.zip")


@pytest.fixture
def driven(tmp_path):
    store = EpisodeDataset(tmp_path / "evaluation" / "episodes")
    for name in NAMES:
        store.append([row(n, name, radius_error=0.01 * n * (-1) ** n, success=n != 3) for n in range(5)])
        store.append([row(5, name, radius_error=None, success=False)])
    store.write_manifest()
    return tmp_path, store.read()


def expected(rows, name):
    mine = [item for item in rows if item["controller"] == name]
    errors = [abs(item["radius_error"]) for item in mine if item["radius_error"] is not None]
    return name, "V", len(mine), median(errors), pytest.approx(sum(item["success"] for item in mine) / len(mine))


def test_duckdb(driven, monkeypatch):
    duckdb = pytest.importorskip("duckdb", reason="needs duckdb: pip install 'ddagr-gym[dev]'")
    folder, rows = driven
    monkeypatch.chdir(folder)
    (query,) = (block.text for block in BLOCKS if block.language == "sql")
    assert duckdb.sql(query).fetchall() == [expected(rows, name) for name in sorted(NAMES)]


def test_polars(driven):
    pytest.importorskip("polars", reason="needs polars: pip install 'ddagr-gym[dev]'")
    folder, rows = driven
    (code,) = (block.text for block in BLOCKS if block.language == "python")
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    for name in NAMES:
        assert name.rsplit("/")[-1][:9] in done.stdout
        assert f"{expected(rows, name)[3]:g}" in done.stdout
