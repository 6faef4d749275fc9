"""What to drive next where the drivetrain is missing."""

from __future__ import annotations

from ddagr_gym.diagnosis.answer.drivetrain import PART_DRIVES, PART_TITLES, DrivetrainAnswer, PartEvidence
from ddagr_gym.diagnosis.planning.drivetrain_drive import drivetrain_drive


def answer(*parts: PartEvidence) -> DrivetrainAnswer:
    return DrivetrainAnswer(parts, (), (), 0.8)


def test_every_part_has_a_drive_that_tells_it():
    assert PART_DRIVES.keys() == PART_TITLES.keys()


def test_parts_in_doubt_come_with_the_driving_that_tells_them_the_weightiest_first():
    plan = drivetrain_drive(
        answer(
            PartEvidence("torque_limit", True, 0.141, 0.052),
            PartEvidence("load", True, 0.081, 0.064),
            PartEvidence("integral_limit", False, 0.080, 0.081),
            PartEvidence("command_delay", False, 0.073, 0.066),
            PartEvidence("power_limit", False, 0.009, 0.009),
        )
    )
    assert plan.manoeuvre == ""
    load, limit = plan.why.index(PART_TITLES["load"]), plan.why.index(PART_TITLES["integral_limit"])
    assert load < limit
    assert f"worse by 8 ± 6 %). What would tell: {PART_DRIVES['load']}." in plan.why
    assert "is not named and in doubt" in plan.why
    for sure_or_third in ("torque_limit", "command_delay", "power_limit"):
        assert PART_TITLES[sure_or_third] not in plan.why


def test_what_is_not_in_doubt_asks_for_a_calibration():
    plan = drivetrain_drive(answer(PartEvidence("inertia", True, 0.1, 0.2), PartEvidence("load", True, 0.3, None)))
    assert plan.why.startswith("No part of the drivetrain is in doubt.")
    assert "ddagr calibrate" in plan.why
