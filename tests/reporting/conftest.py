"""A diagnosis page whose words alone matter."""

import pytest

from ddagr_gym.reporting.diagnosis_page import PAGE, _Studio, write_report


@pytest.fixture
def words_alone(tmp_path, monkeypatch):
    """Text of the page of a diagnosis with its evidence; pictures are not drawn."""
    drawn = {"data": "", "width": 1, "height": 1}
    monkeypatch.setattr(_Studio, "picture", lambda studio, figure, name, alt, **more: {**drawn, "alt": alt, **more})

    def text_of(answer, evidence):
        write_report(tmp_path, answer, evidence)
        return (tmp_path / PAGE).read_text()

    return text_of
