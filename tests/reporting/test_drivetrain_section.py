"""Page and text of a diagnosis whose drivetrain was asked for as a whole."""

from ddagr_gym.diagnosis.answer.drivetrain import DrivetrainAnswer, ForecastComparison, PartEvidence, Remaining
from ddagr_gym.reporting.diagnosis_page import PAGE, write_report
from ddagr_gym.reporting.diagnosis_text import outcome_text
from tests.reporting.test_diagnosis_page import diagnosis, evidence

ANSWER = DrivetrainAnswer(
    (PartEvidence("command_delay", True, 0.084, 0.017), PartEvidence("integral", False, -0.015, None)),
    (
        ForecastComparison("yard.csv, first quarter", "heading", 5.0, "rad", 3.25, 1.21, 1.27, (0.78, 1.6)),
        ForecastComparison("yard.csv, first quarter", "wheel_speed", None, "rad/s", 3.27, 1.31, 1.44, None),
    ),
    (Remaining("turning", 0.71, 0.59), Remaining("going straight", 0.29, 0.41)),
    0.84,
)


def test_the_page_has_parts_errors_and_what_is_left(tmp_path):
    write_report(tmp_path, diagnosis(drivetrain=ANSWER), evidence())
    page = (tmp_path / PAGE).read_text()
    assert "<h2>Between command and wheel</h2>" in page
    assert "<td>dead time of the commands</td><td>yes</td><td>+8.4 %</td><td>1.7 %</td>" in page
    assert "<td>integral part of the speed loop</td><td>no</td><td>-1.5 %</td><td>–</td>" in page
    assert "heading after 5 s" in page
    assert "<td>wheel speed</td>" in page
    assert "71 % turning, 29 % going straight" in page
    assert 'href="drivetrain/calibration.html"' in page


def test_without_it_the_page_has_no_such_section(tmp_path):
    write_report(tmp_path, diagnosis(), evidence())
    assert "Between command and wheel" not in (tmp_path / PAGE).read_text()


def test_the_text_has_the_same_tables():
    text = outcome_text(diagnosis(drivetrain=ANSWER))
    assert "dead time of the commands" in text
    assert "Squared error of the wheel speeds, corrected: 71 % turning, 29 % going straight." in text
