"""How-to pages and tutorials: commands are taken by the command line, files by their readers, Python runs."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from ddagr_gym import cli, commands
from ddagr_gym.config import load_config
from ddagr_gym.recordings.column_map import load_column_map
from ddagr_gym.recordings.topic_map import TopicMap, load_topic_map
from tools.documentation.pages import ROOT, blocks, command_lines, differences, run_page

DOCS = ROOT / "docs"
HOW_TO = sorted((DOCS / "how-to").glob("*.md"))
PAGES = [DOCS / "index.md", *HOW_TO, *sorted((DOCS / "tutorials").glob("*.md"))]


def written(page: Path, folder: Path) -> dict[str, Path]:
    """Files that the page says how to write, written into ``folder``."""
    files = {block.title: folder / block.title for block in blocks(page.read_text()) if block.title}
    for block in blocks(page.read_text()):
        if block.title:
            files[block.title].write_text(block.text)
    return files


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_commands_are_taken(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for block in blocks(page.read_text()):
        for words in command_lines(block.text) if block.language == "sh" else []:
            command = commands.load(words[0])
            assert isinstance(cli._parse(command, words[1:]), command.arguments)


def test_maps_are_read(tmp_path):
    topics = written(DOCS / "how-to" / "bag_topics.md", tmp_path)["my_topics.yaml"]
    assert load_config(topics, TopicMap).topics["imu"].topic == "/imu_rear/data"
    assert load_topic_map(str(topics)).signs == {"yaw_rate": -1}
    columns = written(DOCS / "how-to" / "map_columns.md", tmp_path)["my_map.yaml"]
    assert load_column_map(str(columns)).channels["encoder_left"].sign == -1


def has_python(page: Path) -> bool:
    return any(block.language == "python" and not block.title for block in blocks(page.read_text()))


@pytest.mark.parametrize("page", list(filter(has_python, HOW_TO)), ids=lambda page: page.stem)
def test_python_runs(page, tmp_path):
    written(page, tmp_path)
    code = "\n".join(b.text for b in blocks(page.read_text()) if b.language == "python" and not b.title)
    environment = os.environ | {"PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"}
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_from_a_bag_to_a_diagnosis(tmp_path):
    page = DOCS / "how-to" / "from_a_bag.md"
    printed = run_page(page, tmp_path)
    assert differences(page.read_text(), printed) == []
    assert (tmp_path / "diagnosis" / "diagnosis.json").is_file()
