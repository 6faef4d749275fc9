"""What all stages share: prepared once, cut anew for other windows, with gates for the time that these cover."""

from collections.abc import Callable
from dataclasses import FrozenInstanceError, replace

import pytest

from ddagr_gym.diagnosis.gates.thresholds import Gate, Thresholds
from ddagr_gym.diagnosis.preprocessing.session import DiagnosisSession, prepare
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.recordings.schema import Recording

BANK = Thresholds({"slope": Gate(50.0, 1.0)}, {}, 20, "a test", windows=30.0, duration=6.0)
"""Gates of null drives of 180 s."""


@pytest.fixture(scope="module")
def session(drive: Callable[..., Recording]) -> DiagnosisSession:
    setting = Setting().with_windows(4.0)
    return prepare((drive(),), get_robot("ddagr"), get_soil("thesis_a1"), BANK, setting, seed=5)


def test_gates_are_those_of_the_time_that_the_windows_cover(session: DiagnosisSession) -> None:
    assert session.gates == BANK.for_length(session.problem.covered)
    assert session.gates.of("slope").gain < BANK.of("slope").gain


def test_other_windows_are_cut_from_the_same_mended_recordings(session: DiagnosisSession) -> None:
    short = session.with_windows(2.0, 2.0)
    assert short.problem.blocked.windows.duration == pytest.approx(2.0)
    assert short.problem.blocked.windows.count > session.problem.blocked.windows.count
    assert (short.mended, short.seed, short.bank) == (session.mended, session.seed, session.bank)
    assert short.gates == BANK.for_length(short.problem.covered)
    assert session.setting.duration == 4.0


def test_nobody_changes_it(session: DiagnosisSession) -> None:
    with pytest.raises(FrozenInstanceError):
        session.seed = 1  # type: ignore[misc]


def test_stages_draw_alike_whatever_was_done_before(session: DiagnosisSession) -> None:
    first = session.rng("verdict").random()
    session.rng("checks").random(7)
    assert session.rng("verdict").random() == first
    assert session.rng("checks").random() != first
    assert replace(session, seed=6).rng("verdict").random() != first


def held(recording: Recording) -> Recording:
    """The same values by a map that says how long readings are repeated."""
    return recording.with_meta(held={"yaw_rate": 0.2})


def test_the_key_knows_data_and_choices_but_not_threads(session: DiagnosisSession) -> None:
    key = session.key()
    assert replace(session, setting=replace(session.setting, threads=4)).key() == key
    others = [
        replace(session, seed=6),
        replace(session, bank=replace(BANK, level=0.1)),
        replace(session, setting=session.setting.with_windows(2.0)),
        replace(session, mended=replace(session.mended, given=session.mended.given * 2)),
        replace(session, mended=replace(session.mended, given=tuple(held(one) for one in session.mended.given))),
        replace(session, robot=replace(session.robot, mass=session.robot.mass + 1.0)),
    ]
    assert len({key, *(other.key() for other in others)}) == 1 + len(others)
