"""Page and text of a diagnosis whose drivetrain was asked for as a whole."""

from dataclasses import replace

from ddagr_gym.diagnosis.answer.drivetrain import DrivetrainAnswer, ForecastComparison, PartEvidence, Remaining
from ddagr_gym.diagnosis.answer.verdict import Estimate, Finding
from ddagr_gym.reporting.diagnosis_page import PAGE, PICTURES, write_report
from ddagr_gym.reporting.diagnosis_text import outcome_text
from tests.reporting.test_diagnosis_page import diagnosis, evidence

ANSWER = DrivetrainAnswer(
    (
        PartEvidence("command_delay", True, 0.084, 0.017),
        PartEvidence("integral", False, -0.015, None),
        PartEvidence("integral_limit", False, 0.29, 0.06),
    ),
    (
        ForecastComparison("yard.csv, first quarter", "heading", 5.0, "rad", 3.25, 1.21, 1.27, (0.78, 1.6)),
        ForecastComparison("yard.csv, first quarter", "wheel_speed", None, "rad/s", 3.27, 1.31, 1.44, None),
    ),
    (Remaining("turning", 0.71, 0.59), Remaining("going straight", 0.29, 0.41)),
    0.84,
)

DELAY = Finding("command_delay", {"command_delay": Estimate(0.24, "s", (0.22, 0.26))}, 0.084, 0.02, 4.9, 0.084)


def asked():
    return replace(diagnosis(), drivetrain=ANSWER, findings=(DELAY,), verdict=(DELAY.name,))


def test_the_page_has_parts_errors_and_what_is_left(tmp_path):
    write_report(tmp_path, asked(), evidence())
    page = (tmp_path / PAGE).read_text()
    assert "<h2>Between command and wheel</h2>" in page
    assert "<td>dead time of the commands</td><td>0.24 ± 0.02 s</td><td>+8.4 %</td><td>1.7 %</td>" in page
    assert "<td>integral part of the speed loop</td><td>not needed</td><td>-1.5 %</td><td>–</td>" in page
    assert "<td>limit of the integral part</td><td>nothing to act on</td><td>+29.0 %</td><td>6.0 %</td>" in page
    assert '<div class="tile"><b>84 %</b><span>of the squared error of the wheel speeds explained' in page
    assert '<div class="tile"><b>1.21 rad</b><span>off in heading after 5 s there, instead of 3.25 rad' in page
    assert (tmp_path / PICTURES / "drivetrain_parts.png").is_file()
    assert (tmp_path / PICTURES / "drivetrain_errors.png").is_file()
    assert "heading after 5 s" in page
    assert "<td>wheel speed</td>" in page
    assert "71 % turning, 29 % going straight" in page
    assert 'href="drivetrain/calibration.html"' in page


def test_without_it_the_page_has_no_such_section(words_alone):
    assert "Between command and wheel" not in words_alone(diagnosis(), evidence())


def test_the_text_has_the_same_tables():
    text = outcome_text(asked())
    assert "dead time of the commands" in text
    assert "0.24 ± 0.02 s" in text
    assert text.count("command_delay") == 0
    assert "Squared error of the wheel speeds, corrected: 71 % turning, 29 % going straight." in text
