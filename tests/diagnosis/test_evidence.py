"""The arrays behind the page agree with the models that they show, and survive a file."""

from dataclasses import fields, replace

import numpy as np
import pytest

from ddagr_gym.diagnosis.answer.evidence import Evidence
from ddagr_gym.diagnosis.evidence import gather_evidence
from ddagr_gym.diagnosis.gates.thresholds import Gate, Thresholds
from ddagr_gym.diagnosis.localisation.mismatch_traces import trace_mismatch
from ddagr_gym.diagnosis.search.gains import Gain
from ddagr_gym.diagnosis.search.scanned_model import ScannedModel, SearchResult
from ddagr_gym.errors import InputError
from ddagr_gym.identification.gauss_newton import fit
from ddagr_gym.identification.misfit import channel_misfit, dispersion_of
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.physics.effects.registry import parse_effect
from tests.diagnosis.conftest import session_of


@pytest.fixture(scope="module")
def gathered(drive, problem_of):
    problem = problem_of(drive(("gyro_scale=1.2",), seconds=12.0))

    def scanned(fitted, gains):
        misfit, dispersion = channel_misfit(problem, fitted), dispersion_of(problem, fitted)
        return ScannedModel(fitted, None, gains, {}, {}, dispersion, misfit)

    nominal = fit(problem, iterations=1)
    known = replace(nominal.point, effects=(parse_effect("gyro_scale=1.2"),))
    chosen = fit(problem, known, iterations=1, reuse=nominal)
    gains = (Gain(0, "gyro_scale", 50.0, (1.0,)), Gain(1, "slope", 2.0, (1.0,)))
    found = SearchResult((scanned(nominal, gains), scanned(chosen, (Gain(1, "slope", 1.5, (1.0,)),))), ())
    thresholds = Thresholds({"gyro_scale": Gate(5.0, 0.0), "slope": Gate(7.0, 0.0)}, {}, 20, "bank")
    session = session_of(problem, gates=thresholds)
    return problem, found, gather_evidence(session, found, trace_mismatch(session, found))


def test_shown_residuals_have_the_misfit_of_the_models(gathered):
    _, found, evidence = gathered
    for model, scanned in (("nominal", found.nominal), ("corrected", found.chosen)):
        squares = evidence.standardised(model) ** 2
        for k, name in enumerate(CHANNELS):
            known = squares[..., k][np.isfinite(squares[..., k])]
            assert known.mean() == pytest.approx(scanned.misfit[name], rel=1e-6)


def test_the_effect_is_what_the_corrected_model_lacks_no_more(gathered):
    _, found, evidence = gathered
    gyro = CHANNELS.index("yaw_rate")
    before = np.nanmean(evidence.lasting("nominal")[..., gyro] ** 2)
    after = np.nanmean(evidence.lasting("corrected")[..., gyro] ** 2)
    assert after < 0.5 * before
    assert evidence.findings == ("gyro_scale",)
    assert evidence.effects == ("gyro_scale", "slope")
    assert evidence.gates.tolist() == [5.0, 7.0]
    assert np.isnan(evidence.left[0])
    assert evidence.left[1] == 1.5
    assert found.nominal.names == ()


def test_measured_means_are_those_of_the_recording(gathered):
    problem, _, evidence = gathered
    windows = problem.blocked.windows
    wanted = windows.measured[2, 5:10, CHANNELS.index("encoder_right")].mean()
    assert evidence.measured[2, 1, CHANNELS.index("encoder_right")] == pytest.approx(wanted)
    assert evidence.block == pytest.approx(0.1)
    assert evidence.duration == pytest.approx(2.0)
    assert evidence.roughness("raw").shape == (windows.count, 4)


def test_evidence_survives_a_file(gathered, tmp_path):
    evidence = gathered[2]
    evidence.save(tmp_path / "evidence.npz")
    again = Evidence.load(tmp_path / "evidence.npz")
    for item in fields(Evidence):
        one, other = getattr(evidence, item.name), getattr(again, item.name)
        if isinstance(one, tuple):
            assert one == other
        else:
            assert other == pytest.approx(one, rel=1e-5, nan_ok=True)


def test_a_file_that_holds_no_evidence_is_one_sentence(tmp_path):
    path = tmp_path / "evidence.npz"
    with pytest.raises(InputError, match="cannot be read as evidence"):
        Evidence.load(path)
    path.write_text("no archive")
    with pytest.raises(InputError, match="cannot be read as evidence"):
        Evidence.load(path)
    path.write_bytes(b"")
    with pytest.raises(InputError, match="cannot be read as evidence"):
        Evidence.load(path)
    with path.open("wb") as stream:
        np.save(stream, np.zeros(3))
    with pytest.raises(InputError, match="cannot be read as evidence"):
        Evidence.load(path)
    np.savez_compressed(path, version=np.array(1), time=np.arange(300.0))
    whole, rng = path.read_bytes(), np.random.default_rng(0)
    for place in rng.choice(len(whole), 300):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ int(rng.integers(1, 256))]) + whole[place + 1 :])
        with pytest.raises(InputError):
            Evidence.load(path)
    np.savez(path, version=np.array([1, 2]), time=np.zeros(3))
    with pytest.raises(InputError, match="no evidence of version 1"):
        Evidence.load(path)
    np.savez(path, version=np.array(1), time=np.zeros(3))
    with pytest.raises(InputError, match="no evidence of version 1"):
        Evidence.load(path)


def test_arrays_that_do_not_fit_together_are_refused(gathered):
    with pytest.raises(InputError, match="evidence has time of shape"):
        replace(gathered[2], time=np.zeros(3))
