"""The thesis's filter, put right: works where its own law holds, and what it does elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.estimation import (
    CHANNELS,
    THESIS_STATE,
    FilterModel,
    ForceLaw,
    SoilPrior,
    ThesisModel,
    roll_out,
    run_thesis_filter,
)
from ddagr_gym.estimation.measurement_models import specific_force
from ddagr_gym.estimation.process_model import body_forces

TRUE_PARAMETERS = (120.0, 6.0, 260.0)


@pytest.fixture(scope="module")
def own_law(robot):
    """A soil that obeys (3.15), (3.16) exactly, without resistance."""
    load = robot.mass * 9.80665 / 4
    a1, a2, b = TRUE_PARAMETERS
    prior = SoilPrior(
        traction_limit_over_load=a1 / load, traction_rate=a2, coupling=b / (a1 * a2), resistance_over_limit=1e-12
    )
    return FilterModel(robot, law=ForceLaw.thesis, prior=prior)


@pytest.fixture(scope="module")
def recording(own_law, load):
    """Left turns of two radii on that soil, with the noise of (6.2)'s instruments a tenth as large."""
    t = np.arange(0.0, 20.0, 0.008)
    commands = np.full((t.size, 2), 0.7)
    commands[(t >= 3) & (t < 9)] = [1.0, 0.4]
    commands[(t >= 9) & (t < 15)] = [1.2, 0.7]
    states = roll_out(own_law, own_law.initial()[0], commands)
    packed, force = own_law.pack(), []
    for state in states:
        work = load(state)
        body_forces(packed, work)
        force.append([specific_force(packed, work, axis) for axis in range(2)])
    readings = np.column_stack([force, states[:, [2, 3, 4]]])
    readings += np.random.default_rng(3).standard_normal(readings.shape) * [0.007, 0.007, 8e-4, 0.016, 0.016]
    named = dict(zip(CHANNELS, readings.T, strict=True))
    return named | {
        "t": t + 0.008,
        "command_right": commands[:, 0],
        "command_left": commands[:, 1],
        "states": states,
    }


def test_follows_the_truth_where_its_law_holds(robot, recording):
    run = run_thesis_filter(ThesisModel(robot, parameters=(150.0, 4.0, 350.0)), recording)
    truth = recording["states"]
    in_turns = slice(800, 1800)
    np.testing.assert_allclose(run.states[in_turns, 2], truth[in_turns, 2], atol=6e-3)
    assert np.sqrt(np.mean((run.states[in_turns, 0] - truth[in_turns, 0]) ** 2)) < 5e-3
    np.testing.assert_allclose(run.states[:, 3:5], truth[:, 3:5], atol=0.02)


def test_right_bank_faster_turns_left_and_driving_goes_forward(robot, recording):
    run = run_thesis_filter(ThesisModel(robot), recording)
    assert THESIS_STATE[2] == "yaw_rate"
    assert run.states[800, 2] > 0.05
    assert (run.states[300:, 0] > 0.1).all()


def test_covariance_stays_symmetric_and_positive(robot, recording):
    run = run_thesis_filter(ThesisModel(robot), recording)
    assert np.array_equal(run.covariances, run.covariances.swapaxes(1, 2))
    # the bank speeds have neither process noise nor initial variance in (6.2): zero, up to rounding
    assert np.linalg.eigvalsh(run.covariances).min() > -1e-9
    assert run.deviations[-1, 6] < run.deviations[0, 6]


def test_parameters_stay_positive(robot, recording):
    run = run_thesis_filter(ThesisModel(robot, parameters=(1.0, 0.05, 1.0), least_parameter=0.02), recording)
    assert run.states[:, 5:].min() >= 0.02


def test_missing_samples(robot, recording):
    sparse = dict(recording)
    for name in CHANNELS:
        sparse[name] = recording[name].copy()
        sparse[name][::2] = np.nan
    run = run_thesis_filter(ThesisModel(robot), sparse)
    assert np.isfinite(run.states).all()
    assert np.isnan(run.standardised[::2]).all()
    assert np.isfinite(run.standardised[1::2]).all()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda r, d: run_thesis_filter(ThesisModel(r), {"t": d["t"]}), "needs time and commands"),
        (lambda r, d: run_thesis_filter(ThesisModel(r), d | {"yaw_rate": [0.0]}), "one length"),
        (
            lambda r, d: run_thesis_filter(ThesisModel(r), d | {"command_left": np.where(d["t"] < 0.02, np.nan, 1.0)}),
            "rows have no command, row 1 the first: the thesis's filter needs one in every row; cut the recording",
        ),
        (lambda r, d: ThesisModel(r, process=(1.0,)), "give 8 variances"),
        (lambda r, d: ThesisModel(r, stability=0.0), "stability is 0"),
    ],
)
def test_errors_name_the_remedy(robot, recording, call, message):
    with pytest.raises(InputError, match=message):
        call(robot, recording)
