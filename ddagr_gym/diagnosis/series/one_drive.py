"""One drive of many against the calibration."""

from __future__ import annotations

from ddagr_gym.diagnosis.answer.drive_series import DriveAnswer
from ddagr_gym.diagnosis.change.ordinary import OrdinaryRobot
from ddagr_gym.diagnosis.change.run import what_changed
from ddagr_gym.diagnosis.series.size_points import size_points
from ddagr_gym.recordings.schema import Recording


def answer_for(
    recording: Recording, ordinary: OrdinaryRobot, ground: str, calibrated: str = "", *, seed: int = 0, threads: int = 1
) -> DriveAnswer:
    """What changed in one drive, and the sizes that are followed over time.

    Args:
        recording: of the drive.
        ordinary: calibrated robot.
        ground: of the calibration; "" where it is not known.
        calibrated: name under which the drive is one of the ordinary ones, which it is then compared without; "" where
            it is none.
        seed: of everything random.
        threads: of the simulator.

    Raises:
        InputError: a recording that cannot be compared.
    """
    known = ordinary.without(calibrated) if calibrated else ordinary
    # a ground that only this drive was on is one of which the others know the kind
    on = ground if ground in known.soils or not calibrated else ""
    outcome = what_changed([recording], known, on, seed=seed, threads=threads)
    points = size_points(outcome.problem, outcome.named.models[0], known.comparison(on))
    seconds = float(recording.t[-1] - recording.t[0])
    return DriveAnswer(outcome.diagnosis, points, seconds, recording.meta.start_time, bool(calibrated))
