"""What to drive next where parts of the drivetrain are missing: the drives that tell those that are in doubt."""

from __future__ import annotations

from ddagr_gym.diagnosis.answer.drivetrain import (
    LEAST_GROWTH,
    PART_DRIVES,
    PART_TITLES,
    DrivetrainAnswer,
    PartEvidence,
)
from ddagr_gym.diagnosis.answer.next_drive_plan import NextDrivePlan

SURE = 2.0
"""Standard errors from which a part is in no doubt (ours): one in 40 by chance."""

MOST = 2
"""Parts that are asked about: what matters most."""

CALIBRATE = "Several ordinary drives, fitted together by `ddagr calibrate`, make all parts better known."


def drivetrain_drive(answer: DrivetrainAnswer) -> NextDrivePlan:
    """Drives for the parts whose forecasts leave it open whether they are there; no manoeuvre of the bank is meant.

    Args:
        answer: the parts that were tried.
    """
    doubtful = sorted((part for part in answer.parts if _in_doubt(part)), key=lambda part: -part.growth)[:MOST]
    if not doubtful:
        return NextDrivePlan.none(f"No part of the drivetrain is in doubt. {CALIBRATE}")
    return NextDrivePlan.none(" ".join([*map(_sentence, doubtful), CALIBRATE]))


def _in_doubt(part: PartEvidence) -> bool:
    return part.name in PART_DRIVES and LEAST_GROWTH < part.growth < SURE * (part.error or 0.0)


def _sentence(part: PartEvidence) -> str:
    title, error = PART_TITLES[part.name], part.error or 0.0
    standing = "is named" if part.kept else "is not named"
    worse = f"forecasts without it are worse by {100.0 * part.growth:.0f} \u00b1 {100.0 * error:.0f} %"
    return f"The {title} {standing} and in doubt ({worse}). What would tell: {PART_DRIVES[part.name]}."
