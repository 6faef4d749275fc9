"""The digest of the code changes with what is computed, and not with what is said about it."""

import ast
from pathlib import Path

import pytest

from ddagr_gym.diagnosis.gates import source_digest as module
from ddagr_gym.diagnosis.gates.source_digest import code_digest

SOURCE = '''"""Falling bodies."""

GRAVITY = 9.81
"""[m/s^2], Zurich."""


def fall(seconds: float) -> float:
    """Depth after a time [m]."""
    return 0.5 * GRAVITY * seconds**2  # from rest
'''


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("Falling bodies.", "Bodies that fall."),
        ("Depth after a time [m].", "How far it fell [m].\n\n    Args:\n        seconds: since the start.\n    "),
        ("[m/s^2], Zurich.", "At the sea [m/s^2]."),
        ("  # from rest", ""),
        ("    return", "\n    return"),
    ],
)
def test_rewording_keeps_the_digest(old: str, new: str) -> None:
    assert old in SOURCE
    assert code_digest(SOURCE.replace(old, new)) == code_digest(SOURCE)


@pytest.mark.parametrize(("old", "new"), [("9.81", "9.82"), ("0.5 *", "0.6 *"), ("**2", "**3"), ("float)", "int)")])
def test_another_constant_or_formula_changes_it(old: str, new: str) -> None:
    assert old in SOURCE
    assert code_digest(SOURCE.replace(old, new)) != code_digest(SOURCE)


def test_a_text_that_is_used_counts() -> None:
    assert code_digest('NAME = "slope"') != code_digest('NAME = "payload"')


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own for what is remembered."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache"


def package_with(folder: Path, **modules: str) -> Path:
    """A package with a diagnosis and the files that the digest wants."""
    for name in module._FILES:
        (folder / name).write_text("")
    for name, text in {"diagnosis/scan.py": "LEVEL = 1", "diagnosis/wording.py": "A = 1", **modules}.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    return folder


@pytest.mark.parametrize(
    ("changed", "counts"),
    [
        ({"diagnosis/scan.py": "LEVEL = 2"}, True),
        ({"diagnosis/scan.py": "LEVEL = 1  # another comment"}, False),
        ({"diagnosis/wording.py": "A = 2"}, False),
        ({"diagnosis/further.py": "LEVEL = 1"}, True),
    ],
)
def test_prose_modules_do_not_count(
    changed: dict[str, str], counts: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    digests = []
    for number, modules in enumerate(({}, changed)):
        (tmp_path / str(number)).mkdir()
        monkeypatch.setattr(module, "_PACKAGE", package_with(tmp_path / str(number), **modules))
        digests.append(module._own_digest.__wrapped__())
    assert (digests[0] != digests[1]) == counts


def test_sources_are_parsed_once_for_each_of_their_states(
    tmp_path: Path, own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    parsed: list[bytes] = []
    monkeypatch.setattr(module, "_PACKAGE", package_with(tmp_path))
    monkeypatch.setattr(module, "code_digest", lambda source: parsed.append(source) or code_digest(source))
    digest = module._own_digest.__wrapped__()
    assert len(parsed) == 1 + len(module._FILES)
    assert module._own_digest.__wrapped__() == digest
    assert len(parsed) == 1 + len(module._FILES)
    (tmp_path / "diagnosis" / "scan.py").write_text("LEVEL = 2")
    assert module._own_digest.__wrapped__() != digest
    # as many bytes at the same time of day: the content counts
    (tmp_path / "diagnosis" / "scan.py").write_text("LEVEL = 1")
    assert module._own_digest.__wrapped__() == digest
    (remembered,) = (own_cache / "ddagr-gym").iterdir()
    for damage in ("", "no digest", "\x00"):
        remembered.write_text(damage)
        assert module._own_digest.__wrapped__() == digest


def test_without_a_cache_folder_the_digest_is_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_PACKAGE", package_with(tmp_path))
    digest = module._own_digest.__wrapped__()
    (tmp_path / "a_file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "a_file"))
    assert module._own_digest.__wrapped__() == digest


def test_prose_modules_are_there() -> None:
    assert all((module._PACKAGE / name).is_file() for name in module._PROSE)


def test_everything_that_a_diagnosis_computes_with_counts() -> None:
    """Whatever its packages import of this one, but for files, settings, messages and where results are kept."""
    names = {"errors", "extras", "files", "config", "presets", "validated", "version", "tasks"}
    counted = {*module._FOLDERS, *(name.removesuffix(".py") for name in module._FILES), *names}
    imported = {
        name.split(".")[1]
        for folder in module._FOLDERS
        for path in (module._PACKAGE / folder).rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ImportFrom) and (name := node.module or "").startswith("ddagr_gym.")
    }
    assert imported <= counted
