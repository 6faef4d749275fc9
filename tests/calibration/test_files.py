"""What a calibration's files say of its grounds."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from ddagr_gym.calibration import files


@pytest.mark.parametrize(
    ("grounds", "named", "said"),
    [
        (("yard",), "", "the calibration knows one ground: add --ground yard if the drive was on it."),
        (("yard",), "yard", ""),
        (("yard", "sand"), "", ""),
    ],
)
def test_the_only_ground_of_a_calibration_is_named_where_none_was(tmp_path, monkeypatch, grounds, named, said):
    monkeypatch.setattr(files, "load", lambda folder: SimpleNamespace(grounds=grounds))
    assert files.ground_to_add(tmp_path, named) == said


def test_nothing_is_said_of_what_is_no_calibration(tmp_path):
    assert files.ground_to_add(tmp_path, "") == ""
