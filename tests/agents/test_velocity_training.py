"""Training of the learned estimator: drawn turns, torch against numpy, going on after an interruption."""

import json

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs the extra rl")

from agents.velocity_drives import Drives, Plan, _drive, as_drives, draw_turn, make_drives  # noqa: E402
from agents.velocity_training import (  # noqa: E402
    VARIANTS,
    VelocitySettings,
    VelocityTraining,
    gaussian_loss,
    mirror,
)
from ddagr_gym.errors import InputError  # noqa: E402
from ddagr_gym.estimation import LearnedBatch, LearnedModel  # noqa: E402
from ddagr_gym.estimation.inertial_filter import InertialModel  # noqa: E402
from ddagr_gym.estimation.learned_inputs import INPUTS  # noqa: E402
from ddagr_gym.estimation.learned_network import VELOCITY_SCALE  # noqa: E402
from ddagr_gym.evaluation.scenarios import load_scenarios, scenario_names  # noqa: E402
from ddagr_gym.parameters import Sensors  # noqa: E402
from ddagr_gym.presets import ddagr  # noqa: E402


def made_up(count=24, blocks=30, seed=0) -> Drives:
    """Drives whose side slip is a tenth of the yaw rate input, and whose forward speed is the rim's."""
    rng = np.random.default_rng(seed)
    inputs = rng.standard_normal((count, blocks, len(INPUTS))).astype(np.float32)
    truth = np.zeros((count, blocks, 2), dtype=np.float32)
    truth[..., 1] = 0.03 * inputs[..., INPUTS.index("yaw_rate_second")]
    zeros, ones = np.zeros((count, blocks), dtype=np.float32), np.ones((count, blocks), dtype=np.float32)
    places = np.cumsum(0.08 * truth, axis=1)
    return Drives(inputs, truth, zeros, np.zeros_like(truth), places, ones, ones)


def training(folder, name="alone", epochs=3, **changes) -> VelocityTraining:
    settings = VelocitySettings(turns=24, validation=8, units=8, epochs=epochs, batch=6, **changes)
    return VelocityTraining(name, settings, made_up(), made_up(8, seed=1), folder)


@pytest.mark.parametrize("name", VARIANTS)
def test_numpy_gives_what_torch_gives(tmp_path, name):
    own = training(tmp_path, name)
    torch.nn.init.normal_(own.model.output.weight)
    network = own.network()
    inputs = made_up(5, seed=3).inputs[..., network.chosen]
    with torch.no_grad():
        wanted = own.model(own._normal(torch.from_numpy(inputs))).numpy()
    memory = network.new_memory(5)
    found = np.stack([network.step(inputs[:, k].astype(float), memory) for k in range(inputs.shape[1])], axis=1)
    assert np.abs(wanted).max() > 1.0
    assert found == pytest.approx(wanted, abs=2e-5)


def test_it_learns_and_is_calibrated(tmp_path):
    own = training(tmp_path, epochs=40, learning_rate=0.02)
    network = own.run()
    assert own.course[-1]["loss"] < own.course[0]["loss"] - 0.5
    assert own.course[-1]["v_y_rmse_mm_s"] < 20.0  # 30 mm/s without learning
    errors, deviations = own._predicted()
    inside = np.abs(errors) <= 1.645 * deviations * network.description.calibration
    assert inside[:, 1].mean() == pytest.approx(0.90, abs=0.01)  # the forward speed is the rim's, without any error


def test_an_interrupted_training_goes_on_to_the_same_numbers(tmp_path):
    whole = training(tmp_path / "whole").run()
    first = training(tmp_path / "parts")
    first._keep_epoch()
    again = training(tmp_path / "parts")
    assert again.run().digest() == whole.digest()
    with pytest.raises(InputError, match="other settings"):
        training(tmp_path / "parts", seed=5).run()


def test_the_loss_is_the_gaussian_likelihood():
    rng = np.random.default_rng(0)
    outputs = torch.from_numpy(0.3 * rng.standard_normal((1, 1, 5)))
    wanted = torch.from_numpy(rng.standard_normal((1, 1, 2)))
    mean, logs = outputs[0, 0, :2].numpy(), outputs[0, 0, 2:4].numpy()
    correlation = 0.98 * np.tanh(outputs[0, 0, 4].item())
    spread = np.exp(logs)
    shared = correlation * spread.prod()
    covariance = np.array([[spread[0] ** 2, shared], [shared, spread[1] ** 2]])
    error = wanted[0, 0].numpy() - mean
    likelihood = 0.5 * np.log(np.linalg.det(covariance)) + 0.5 * error @ np.linalg.solve(covariance, error)
    assert gaussian_loss(outputs, wanted, torch.ones(1, 1)).item() == pytest.approx(likelihood)


def test_mirroring_twice_changes_nothing():
    places, signs = mirror(INPUTS)
    assert np.array_equal(places[places], np.arange(len(INPUTS)))
    assert np.array_equal(signs * signs[places], np.ones(len(INPUTS)))
    assert signs[INPUTS.index("filter_gravity_y")] == -1.0
    assert signs[INPUTS.index("filter_deviation_gravity_y")] == 1.0


def test_drawn_turns_are_made_again_and_kept(tmp_path):
    first = make_drives(2, 11, tmp_path / "one")
    again = make_drives(2, 11, tmp_path / "two")
    assert np.array_equal(first.inputs, again.inputs)
    assert (first.driving.sum(axis=1) > 50).all()
    file = next((tmp_path / "one").glob("turns*.npz"))
    stamp = file.stat().st_mtime_ns
    make_drives(2, 11, tmp_path / "one")
    assert file.stat().st_mtime_ns == stamp
    with pytest.raises(InputError, match="another seed or plan"):
        make_drives(2, 12, tmp_path / "one")


def test_training_sees_what_the_estimator_sees_when_it_runs(tmp_path):
    columns = _drive([11, 0], Plan())
    drives = as_drives([columns])
    network = training(tmp_path, "correction").network()
    torch.manual_seed(0)
    batch = LearnedBatch(LearnedModel(InertialModel.of(ddagr(), Sensors()).with_known_vibration(), network), 1)
    names = ("specific_force_x", "specific_force_y", "yaw_rate", "encoder_right", "encoder_left")
    readings = np.column_stack([columns[name] for name in names])
    commands = np.column_stack([columns["command_right"], columns["command_left"]])
    memory, places = network.new_memory(1), network.chosen
    for k in range(100):
        block = slice(10 * k, 10 * k + 10)
        batch.step(commands[10 * k : 10 * k + 1], readings[None, block])
        network.step(drives.inputs[:, k, places].astype(float), memory)
    assert batch.units == pytest.approx(memory, abs=1e-4)
    assert VELOCITY_SCALE == 0.01


def test_no_frozen_scenario_is_drawn_for_training():
    rng_soils = {repr(draw_turn(np.random.default_rng([20_261_240, n]))[1].soils) for n in range(20)}
    frozen = {repr(item.episode.soils) for name in scenario_names() if name in ("S1", "V", "T") for item in
              load_scenarios(name)}  # fmt: skip
    assert not rng_soils & frozen


def test_the_record_is_plain(tmp_path):
    own = training(tmp_path)
    own.run()
    assert json.loads(json.dumps(own._record()))["name"] == "alone"
