"""Moved names work, warn once, and do not hide the functions that have their names now."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys

import pytest
from packaging.version import Version

from ddagr_gym.deprecation import MOVED_MODULES, install, renamed
from ddagr_gym.version import __version__


def run(program: str) -> str:
    """Output of a program in an interpreter of its own, where nothing is imported yet."""
    done = subprocess.run([sys.executable, "-W", "always", "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def test_a_renamed_name_is_the_new_one_and_says_so():
    find = renamed("ddagr_gym.old", {"load": "ddagr_gym.presets:get_soil"}, goes="9.0.0")
    message = "ddagr_gym.old.load is ddagr_gym.presets.get_soil now; the old name goes in 9.0.0."
    with pytest.warns(DeprecationWarning, match=f"^{re.escape(message)}$"):
        assert find("load") is importlib.import_module("ddagr_gym.presets").get_soil
    with pytest.raises(AttributeError, match="no attribute 'save'"):
        find("save")


def test_an_old_path_imports_the_module_that_moved():
    said = run(
        "from ddagr_gym.replay.report import save_report\n"
        "import ddagr_gym.replay.report, ddagr_gym.replay_analysis.report as new\n"
        "assert ddagr_gym.replay.report is new and save_report is new.save_report"
    )
    assert said.count("ddagr_gym.replay.report is ddagr_gym.replay_analysis.report now; the old name goes in") == 1


def test_a_module_that_was_renamed_twice_has_its_classes_by_both_names():
    said = run(
        "from ddagr_gym.replay.arm import ArmSettings\n"
        "from ddagr_gym.replay_analysis.report import ArmReport\n"
        "from ddagr_gym.replay.windows import WindowSet\n"
        "from ddagr_gym.replay_analysis.drive_mode import DriveModeReport, ReplaySettings\n"
        "assert ArmSettings is ReplaySettings and ArmReport is DriveModeReport"
    )
    assert "ddagr_gym.replay.arm is ddagr_gym.replay_analysis.drive_mode now" in said
    assert "report.ArmReport is ddagr_gym.replay_analysis.report.DriveModeReport now" in said
    assert "ddagr_gym.replay.windows is ddagr_gym.identification.windows now" in said


def test_modules_that_went_elsewhere_are_found_there():
    said = run(
        "from ddagr_gym.replay.windows import cut_windows\n"
        "from ddagr_gym.diagnosis.verdict import load\n"
        "from ddagr_gym.diagnosis.result.verdict import Diagnosis\n"
        "import ddagr_gym.identification.windows as windows, ddagr_gym.diagnosis.result.files as files\n"
        "import ddagr_gym.diagnosis.answer.verdict as verdict\n"
        "assert cut_windows is windows.cut_windows and load is files.load and Diagnosis is verdict.Diagnosis"
    )
    assert "ddagr_gym.replay.windows is ddagr_gym.identification.windows now" in said
    assert "ddagr_gym.diagnosis.verdict is ddagr_gym.diagnosis.result.files now" in said
    assert "ddagr_gym.diagnosis.result.verdict is ddagr_gym.diagnosis.answer.verdict now" in said


def test_a_module_that_never_was_is_not_found():
    said = run(
        "try:\n    import ddagr_gym.replay.nonsense\nexcept ModuleNotFoundError as error:\n    print(error.name)"
    )
    assert "ddagr_gym.replay.nonsense" in said


def test_the_function_of_the_same_name_can_still_be_called():
    said = run(
        "import ddagr_gym.replay.intervals, ddagr_gym\n"
        "from ddagr_gym.errors import InputError\n"
        "for attempt in range(2):\n"
        "    try:\n"
        "        ddagr_gym.replay([])\n"
        "    except InputError as error:\n"
        "        print(error)\n"
        "from ddagr_gym.api.replay import replay\n"
        "assert ddagr_gym.replay is replay"
    )
    assert said.count("no recording is given") == 2


def test_nothing_is_warned_of_without_an_old_name():
    assert run("import ddagr_gym\nddagr_gym.replay\nimport ddagr_gym.replay_analysis.report") == ""


def test_old_names_are_gone_and_new_ones_are_there():
    for old, (new, goes) in MOVED_MODULES.items():
        assert importlib.util.find_spec(new) is not None
        assert Version(goes) > Version(__version__), f"remove {old}"


def test_any_module_can_move(monkeypatch):
    monkeypatch.setattr(sys, "meta_path", list(sys.meta_path))
    install({"ddagr_gym.old_frames": ("ddagr_gym.frames", "9.0.0")})
    with pytest.warns(DeprecationWarning, match=r"ddagr_gym\.old_frames is ddagr_gym\.frames now"):
        old = importlib.import_module("ddagr_gym.old_frames")
    assert old.wrap_angle is importlib.import_module("ddagr_gym.frames").wrap_angle
    del sys.modules["ddagr_gym.old_frames"]
