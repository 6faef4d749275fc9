"""Short simulated drives and the problem that they make."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.answer.certificate import Certificate
from ddagr_gym.diagnosis.certification.certify import certify_models
from ddagr_gym.diagnosis.gates.thresholds import Thresholds
from ddagr_gym.diagnosis.preprocessing.mended_recordings import MendedRecordings
from ddagr_gym.diagnosis.preprocessing.session import DiagnosisSession
from ddagr_gym.diagnosis.setting import Setting, make_problem
from ddagr_gym.identification.gauss_newton import Fitted, fit
from ddagr_gym.identification.problem import Problem
from ddagr_gym.parameters import Imu, PoseReceiver, Sensors, WheelEncoder
from ddagr_gym.physics.effects import load_effects
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording
from ddagr_gym.simulator import simulate

RATE = 50.0


def commands(seconds: float) -> np.ndarray:
    """Starts, arcs to both sides, a stop and a spin, 4 s each."""
    steps = [(0.7, 0.7), (0.9, 0.4), (0.0, 0.0), (0.4, 0.9), (-0.5, 0.5), (1.0, 1.0)]
    pieces = [np.tile(step, (int(4.0 * RATE), 1)) for step in steps]
    return np.concatenate(pieces)[: int(seconds * RATE)]


@pytest.fixture(scope="session")
def drive() -> Callable[..., Recording]:
    """Function (effects, seconds, seed, yaw, poses) -> recording of the thesis's robot and soil with noise."""

    def make(
        effects: tuple[str, ...] = (), seconds: float = 24.0, seed: int = 1, yaw: float = 0.0, poses: bool = True
    ) -> Recording:
        robot = get_robot("ddagr")
        sensors = Sensors(Imu(sample_rate=RATE), WheelEncoder(), PoseReceiver(5.0 if poses else 0.0))
        columns = simulate(
            robot, get_soil("thesis_a1"), commands(seconds), sensors=sensors, effects=effects, seed=seed,
            initial_state={"yaw": yaw},
        )  # fmt: skip
        return Recording.from_columns(columns, robot)

    return make


@pytest.fixture(scope="session")
def problem_of() -> Callable[..., Problem]:
    """Function (recordings) -> problem with windows of 2 s."""

    def make(*recordings: Recording) -> Problem:
        return make_problem(get_robot("ddagr"), get_soil("thesis_a1"), recordings, Setting())

    return make


@dataclass(frozen=True, eq=False)
class Sloping:
    """Two drives on ground that slopes, fitted with and without the slope.

    Attributes:
        recordings: of 24 s.
        problem: their windows.
        nominal: fit without the slope.
        chosen: fit with it.
        certificate: of both.
    """

    recordings: tuple[Recording, ...]
    problem: Problem
    nominal: Fitted
    chosen: Fitted
    certificate: Certificate


NO_GATES = Thresholds({}, {}, 20, "a test")


def session_of(
    problem: Problem, recordings: Sequence[Recording] = (), gates: Thresholds = NO_GATES, seed: int = 0
) -> DiagnosisSession:
    """Session of a problem that is made already, with gates that hold for any length."""
    mended = MendedRecordings(tuple(recordings), tuple(recordings))
    return DiagnosisSession(get_robot("ddagr"), get_soil("thesis_a1"), mended, Setting(), problem, gates, gates, seed)


SLOPE = "slope=0.06,direction=0.8"


@pytest.fixture(scope="session")
def sloping(drive: Callable[..., Recording], problem_of: Callable[..., Problem]) -> Sloping:
    """A slope of 0.06 rad that the sizes are fitted to from another guess."""
    recordings = (drive((SLOPE,), seed=1), drive((SLOPE,), seed=2))
    problem = problem_of(*recordings)
    nominal = fit(problem, iterations=2, renewals=1)
    start = replace(nominal.point, effects=load_effects("slope=0.05,direction=0.7"))
    chosen = fit(problem, start, iterations=15, renewals=5, first=nominal)
    session = session_of(problem, recordings)
    certificate = certify_models(session, nominal, chosen, np.random.default_rng(0))
    return Sloping(recordings, problem, nominal, chosen, certificate)
