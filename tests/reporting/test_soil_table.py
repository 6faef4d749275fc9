"""The table of what a soil does under a wheel."""

from ddagr_gym.diagnosis.answer.soil_at_work import NET_PULL, SINKAGE, SoilAtWork, SoilQuantity, WorkingPoint
from ddagr_gym.reporting.soil_table import soil_section

SINKS = SoilQuantity(SINKAGE, "m", 0.0059, (0.004, 0.0081), 0.0111, (0.009, 0.0135), -0.468, (-0.7, -0.002))
PULLS = SoilQuantity(NET_PULL, "N", 67.2, (50.0, 80.0), -1.0, (-3.0, 2.0), None, None)
SOIL = SoilAtWork("in the patch", "outside it", WorkingPoint(0.148, 0.248, 0.2618, 410.0), (SINKS, PULLS), 0.954, False)


def test_rows_are_in_units_of_the_field_with_differences_in_percent():
    section = soil_section(SOIL)
    assert section["header"] == ("", "difference", "in the patch", "outside it")
    assert section["rows"] == [
        ("Sinkage", "−47 % (−70 to 0)", "5.9 mm (4.0 to 8.1)", "11.1 mm (9.0 to 13.5)"),
        ("Net pull", "–", "67 N (50 to 80)", "−1 N (−3 to 2)"),
    ]


def test_the_note_says_where_the_wheel_works_and_what_is_not_known():
    note = soil_section(SOIL)["note"]
    assert "a slip of 0.25, a slip angle of 15 degrees, 0.15 m/s and a load of 410 N" in note
    assert "cannot be told apart here (correlation 0.95)" in note
