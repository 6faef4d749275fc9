"""The page on other libraries: each of its scripts runs where its library is installed."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tools.documentation.pages import ROOT, blocks

PAGE = ROOT / "docs" / "how-to" / "other_libraries.md"


def needs(script: str, *modules: str, extra: str, marks: tuple[pytest.MarkDecorator, ...] = ()):
    absent = [name for name in modules if importlib.util.find_spec(name) is None]
    sentence = f"needs {', '.join(absent)}: pip install -c constraints.txt 'ddagr-gym[{extra}]'"
    return pytest.param(script, marks=(*marks, pytest.mark.skipif(bool(absent), reason=sentence)), id=Path(script).stem)


SCRIPTS = (
    needs("ppo_in_one_file.py", "torch", extra="rl"),
    needs("torchrl_rollouts.py", "torchrl", extra="torchrl"),
    needs("rllib_ppo.py", "ray", "tree", "torch", extra="cluster,rl", marks=(pytest.mark.ray, pytest.mark.slow)),
    needs("minari_drives.py", "minari", "jax", "h5py", extra="minari"),
)


@pytest.mark.parametrize("script", SCRIPTS)
def test_script_runs(script, tmp_path):
    (text,) = (block.text for block in blocks(PAGE.read_text()) if block.title == script)
    (tmp_path / script).write_text(text)
    environment = os.environ | {"PYTHONPATH": str(ROOT), "MINARI_DATASETS_PATH": str(tmp_path / "data")}
    done = subprocess.run([sys.executable, script], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout


def test_every_script_of_the_page_is_run():
    assert {block.title for block in blocks(PAGE.read_text()) if block.title} == {param.values[0] for param in SCRIPTS}
