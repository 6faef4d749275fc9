"""pyproject.toml, constraints.txt, ./ddagr and the table of extras agree with each other."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from ddagr_gym import __version__, commands, extras
from ddagr_gym.errors import InputError
from ddagr_gym.extras import EXTRA_OF_MODULE, how_to_install, missing_extra, need

# Libraries whose import name is not their distribution's name.
MODULE_OF = {
    "dm-tree": "tree",
    "foxglove-sdk": "foxglove",
    "imageio-ffmpeg": "imageio_ffmpeg",
    "pygame-ce": "pygame",
    "rerun-sdk": "rerun",
    "sb3-contrib": "sb3_contrib",
    "scikit-learn": "sklearn",
    "stable-baselines3": "stable_baselines3",
}


@pytest.fixture(scope="module")
def project(repository: Path) -> dict:
    return tomllib.loads((repository / "pyproject.toml").read_text())["project"]


@pytest.fixture(scope="module")
def pins(repository: Path) -> list[Requirement]:
    lines = (repository / "constraints.txt").read_text().splitlines()
    return [Requirement(line) for line in lines if line and not line.startswith("#")]


def extras_without(project: dict, *left_out: str) -> dict[str, list[str]]:
    return {name: items for name, items in project["optional-dependencies"].items() if name not in left_out}


@pytest.fixture(scope="module")
def wanted(project: dict) -> list[Requirement]:
    extras = [item for items in extras_without(project, "all").values() for item in items]
    return [Requirement(item) for item in [*project["dependencies"], *extras]]


def test_every_direct_dependency_has_a_pin_that_fits(wanted, pins):
    pinned = {canonicalize_name(pin.name): pin for pin in pins}
    for requirement in wanted:
        (version,) = pinned[canonicalize_name(requirement.name)].specifier
        assert version.operator == "=="
        assert requirement.specifier.contains(version.version), requirement


def test_no_pin_is_left_over(wanted, pins):
    names = {canonicalize_name(item.name) for item in wanted}
    assert {canonicalize_name(pin.name) for pin in pins} == names


def test_linux_gets_the_torch_without_cuda(pins):
    linux = [pin for pin in pins if pin.name == "torch" and pin.marker.evaluate({"sys_platform": "linux"})]
    assert [str(pin.specifier) for pin in linux] == ["==2.13.0+cpu"]


def test_extra_all_is_all(project):
    (everything,) = project["optional-dependencies"]["all"]
    assert Requirement(everything).extras == set(extras_without(project, "all"))


def test_table_of_extras_is_that_of_the_project(project):
    expected = {}
    for extra, items in extras_without(project, "all", "dev", "docs").items():
        for item in items:
            name = Requirement(item).name
            expected[MODULE_OF.get(name, name)] = extra
    assert expected == EXTRA_OF_MODULE


def test_missing_package_sentence():
    error = missing_extra(ModuleNotFoundError("No module named 'pyarrow.parquet'", name="pyarrow.parquet"))
    assert "'pyarrow'" in str(error)
    assert ".[io]" in str(error)
    assert missing_extra(ModuleNotFoundError(name="ddagr_gym.x")) is None
    assert missing_extra(ModuleNotFoundError()) is None


def test_what_long_work_needs_at_its_end_is_asked_for_before(monkeypatch: pytest.MonkeyPatch) -> None:
    need("numpy", "scipy")
    monkeypatch.setattr(extras, "find_spec", lambda name: None if name == "sklearn" else object())
    with pytest.raises(InputError, match=r"'sklearn', which is not installed.*\.\[diagnosis\]"):
        need("ruptures", "sklearn")


def test_a_missing_package_is_installed_into_the_running_interpreter(monkeypatch, repository, tmp_path):
    place = f"in {repository}"
    monkeypatch.setattr(extras.sys, "executable", "/a b/python")
    assert how_to_install("cluster") == f"'/a b/python' -m pip install -c constraints.txt -e '.[cluster]' {place}"
    assert "--extra-index-url https://download.pytorch.org/whl/cpu -e '.[rl]'" in how_to_install("rl")
    monkeypatch.setattr(extras, "find_spec", lambda name: None)
    assert how_to_install("io").startswith("python3 -m pip --python '/a b/python' install -c constraints.txt")
    monkeypatch.setattr(extras, "_CHECKOUT", tmp_path)
    assert how_to_install("io") == "python3 -m pip --python '/a b/python' install 'ddagr-gym[io]'"


def test_script_asks_for_extras_that_exist(project, repository):
    script = (repository / "ddagr").read_text()
    body = script[script.index("extras_of() {") : script.index("program_of() {")]
    asked = dict(re.findall(r"^ +([\w|=* -]+)\) echo \"?([\w ]+)\"? ;;", body, re.MULTILINE))
    assert {"test", "--cluster | --cluster=*"} <= set(asked)
    assert {word for words in asked.values() for word in words.split()} <= set(extras_without(project, "all"))


def test_registered_commands_have_a_module(repository):
    for name in commands.NAMES:
        assert commands.load(name).summary
    assert len(set(commands.NAMES)) == len(commands.NAMES)


def test_citation_names_this_version_and_license(repository, project):
    citation = yaml.safe_load((repository / "CITATION.cff").read_text())
    assert (citation["version"], citation["license"]) == (__version__, project["license"])
    assert [author["name"] for author in citation["authors"]] == [item["name"] for item in project["authors"]]


def test_the_hooks_before_a_commit_call_programs_of_the_environment(repository, project):
    (hooks,) = yaml.safe_load((repository / ".pre-commit-config.yaml").read_text())["repos"]
    tools = {Requirement(item).name for item in project["optional-dependencies"]["dev"]}
    assert hooks["repo"] == "local"
    for hook in hooks["hooks"]:
        folder, _, program = hook["entry"].split()[0].rpartition("/")
        assert (folder, hook["language"]) == (".venv/bin", "system")
        assert program in tools


def test_benchmarks_write_their_pictures_whole(repository):
    """To a temporary file that is renamed: an interruption leaves the picture of before."""
    modules = (repository / "benchmarks").rglob("*.py")
    assert [module.name for module in modules if "savefig(path" in module.read_text()] == []
