"""The learned estimator: its inputs, its network as a file, one robot and a batch."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.estimation import (
    DeadReckoning,
    InertialModel,
    LearnedBatch,
    LearnedFilter,
    LearnedModel,
    learned_filter,
    run_learned_filter,
)
from ddagr_gym.estimation.inertial_layout import VIBRATION_LEARNT
from ddagr_gym.estimation.learned_filter import estimator_names, find_network
from ddagr_gym.estimation.learned_inputs import (
    INPUTS,
    MEMORY_SIZE,
    SENSOR_INPUTS,
    Filtered,
    block_inputs,
    rest_deviations,
)
from ddagr_gym.estimation.learned_inputs import _rest as add_rest
from ddagr_gym.estimation.learned_network import (
    FORMAT,
    OUTPUTS,
    NetworkDescription,
    RecurrentLayer,
    VelocityNetwork,
    load_network,
    save_network,
    velocity_base,
)
from ddagr_gym.files import shipped_folder
from ddagr_gym.parameters import Sensors
from ddagr_gym.presets import ddagr

BLOCK = 10


def make_network(inputs=INPUTS, base="filter", units=6, seed=0, size=0.3, layers=1, place=False) -> VelocityNetwork:
    rng = np.random.default_rng(seed)

    def drawn(*shape):
        return (size * rng.standard_normal(shape)).astype(np.float32)

    count = len(inputs)
    calibration = (1.5, 0.5, 2.0, 1.0) if place else (1.5, 0.5)
    described = NetworkDescription(
        FORMAT, "drawn", inputs, base, BLOCK, Sensors().period, calibration, {"seed": seed}, layers, place
    )
    own = tuple(
        RecurrentLayer(
            drawn(3 * units, count if first else units), drawn(3 * units, units), drawn(3 * units), drawn(3 * units)
        )
        for first in [True] + (layers - 1) * [False]
    )
    outputs = described.outputs
    return VelocityNetwork(described, own, drawn(outputs, units), drawn(outputs), np.zeros(count), np.ones(count))


def make_model(**changes) -> LearnedModel:
    return LearnedModel(InertialModel.of(ddagr(), Sensors()), make_network(**changes))


def drive(blocks=20, seed=1, noise=1.0, standing=5):
    """Commands (B, 2) and readings (B, K, 5) of a robot that stands for some blocks and then drives.

    Its sensors have so many times the noise of their data sheets.
    """
    rng = np.random.default_rng(seed)
    commands = np.where(np.arange(blocks)[:, None] < standing, 0.0, np.array([1.0, 0.8]))
    readings = rng.standard_normal((blocks, BLOCK, 5))
    readings[:, :, :3] *= noise * make_model().rest_deviations
    readings[:, :, 3:] = commands[:, None]
    return commands, readings


def test_a_batch_agrees_with_filters_of_one_to_the_bit():
    model = make_model()
    batch, ones = LearnedBatch(model, 3), [LearnedFilter(model) for _ in range(3)]
    drives = [drive(seed=n) for n in range(3)]
    for k in range(20):
        batch.step(np.array([own[0][k] for own in drives]), np.array([own[1][k] for own in drives]))
        for one, (commands, readings) in zip(ones, drives, strict=True):
            one.run(commands[k : k + 1], readings[k])
    for n, one in enumerate(ones):
        assert np.array_equal(batch.states[n], one.state)
        assert np.array_equal(batch.covariances[n], one.covariance)
    assert not np.array_equal(batch.states[0], batch.states[1])


def test_layers_and_places_agree_in_a_batch_and_alone():
    model = make_model(layers=2, place=True)
    batch, one = LearnedBatch(model, 2), LearnedFilter(model)
    commands, readings = drive()
    for k in range(20):
        batch.step(np.tile(commands[k], (2, 1)), np.tile(readings[k], (2, 1, 1)))
        one.run(commands[k : k + 1], readings[k])
    assert np.array_equal(batch.poses, np.tile(one.pose, (2, 1)))
    assert np.array_equal(batch.place_covariances[1], one.place_covariance)
    assert (np.linalg.eigvalsh(one.place_covariance) > 0.0).all()
    assert (np.abs(one.pose[:2] - one._inertial.pose[:2]) > 1e-4).all()
    assert one.pose[2] == one._inertial.pose[2]
    one.reset()
    assert not one.pose.any()


def run(model, noise, standing=5):
    """Learned filter after a drive."""
    one = LearnedFilter(model)
    commands, readings = drive(noise=noise, standing=standing)
    for k in range(20):
        one.run(commands[k : k + 1], readings[k])
    return one


def test_the_network_is_left_out_where_the_sensors_scatter_far_beyond_their_data_sheets():
    model = make_model(layers=2, place=True)
    for noise, standing, left_out in ((1.0, 5, False), (1.5, 5, False), (3.0, 5, True), (3.0, 0, False)):
        one = run(model, noise, standing)
        own = one._inertial
        assert np.array_equal(one.pose[:2], own.pose[:2]) is left_out
        assert np.array_equal(one.state, own.state) is left_out
        assert np.array_equal(one.covariance[:2, :2], own.covariance[:2, :2]) is left_out
        assert np.array_equal(one.place_covariance, own.pose_covariance[:2, :2]) is left_out
    # nobody knows that its readings scatter without a rest
    assert not run(model, 3.0, 0)._corrections.noisy.size


def test_a_noisy_robot_learns_how_it_shakes_and_changes_nothing_for_others():
    model = replace(make_model(), inertial=InertialModel.of(ddagr(), Sensors()).with_known_vibration())
    batch, alone = LearnedBatch(model, 2), LearnedFilter(model)
    (commands, quiet), (_, noisy) = drive(blocks=60), drive(blocks=60, noise=4.0)
    for k in range(60):
        batch.step(np.tile(commands[k], (2, 1)), np.stack([quiet[k], noisy[k]]))
        alone.run(commands[k : k + 1], quiet[k])
    assert np.array_equal(batch.states[0], alone.state)
    learnt = batch.works[:, VIBRATION_LEARNT]
    assert learnt[0] == alone._inertial.vibration == 0.0
    assert learnt[1] > 0.0
    batch.reset([1])
    for k in range(20):
        batch.step(np.tile(commands[k], (2, 1)), np.tile(quiet[k], (2, 1, 1)))
    assert batch.works[1, VIBRATION_LEARNT] == 0.0


@pytest.mark.parametrize("noise", [0.5, 1.0, 1.6])
def test_with_sensors_near_their_data_sheets_nothing_changes_by_it(noise, monkeypatch):
    model = make_model(layers=2, place=True)
    found = run(model, noise)
    monkeypatch.setattr(learned_filter, "NOISY", np.inf)
    never = run(model, noise)
    assert np.array_equal(found.state, never.state)
    assert np.array_equal(found.pose, never.pose)
    assert not np.array_equal(run(model, 4.0).state, found.state)


def test_scatter_at_rest_is_told_from_enough_samples():
    memory = np.zeros((2, MEMORY_SIZE))
    commands, readings = drive(blocks=40, standing=30, noise=2.0)
    known = make_model().rest_deviations
    for k in range(40):
        pair, both = np.stack([readings[k], readings[k]]), np.tile(commands[k], (2, 1))
        both[1] += k >= 2  # the second one rests for two blocks only
        add_rest(memory, both, pair)
    np.testing.assert_allclose(rest_deviations(memory)[0], 2.0 * known, rtol=0.1)
    assert np.isnan(rest_deviations(memory)[1]).all()


def test_a_place_is_the_filters_where_the_network_corrects_none():
    one = LearnedFilter(make_model())
    commands, readings = drive()
    for k in range(20):
        one.run(commands[k : k + 1], readings[k])
    assert np.array_equal(one.pose, one._inertial.pose)
    assert np.abs(one.pose[:2]).min() > 1e-4


def test_dead_reckoning_follows_a_corrected_place():
    model = make_model(layers=2, place=True)
    reckoning, one = DeadReckoning(model), LearnedFilter(model)
    reckoning.reset(2.0, -1.0, 0.5 * np.pi)
    commands, readings = drive()
    for k in range(20):
        found = reckoning.update(commands[k], readings[k])
        one.run(commands[k : k + 1], readings[k])
    x, y, yaw = one.pose
    assert found[:3] == pytest.approx([2.0 - y, -1.0 + x, 0.5 * np.pi + yaw])
    slow = DeadReckoning(model, np.inf)
    for k in range(20):
        integrated = slow.update(commands[k], readings[k])
    assert abs(integrated.x - x) > 1e-4


def test_only_the_velocities_are_the_networks():
    model = make_model()
    learned, inertial = LearnedBatch(model, 1), LearnedBatch(make_model(size=0.0), 1)
    commands, readings = drive()
    for k in range(20):
        learned.step(commands[k : k + 1], readings[k : k + 1])
        inertial.step(commands[k : k + 1], readings[k : k + 1])
    assert np.array_equal(learned.states[:, 2:], inertial.states[:, 2:])
    assert np.abs(learned.states[:, :2] - inertial.states[:, :2]).min() > 1e-4
    covariance = learned.covariances[0]
    assert (np.linalg.eigvalsh(covariance) > 0.0).all()
    assert not covariance[:2, 2:].any()


def test_calibration_scales_deviations_alone():
    network = make_network()
    twice = replace(network, description=replace(network.description, calibration=(3.0, 0.5)))
    outputs, base = np.ones((1, OUTPUTS), dtype=np.float32), np.zeros((1, 2))
    (once, covariance), (again, wider) = network.estimate(outputs, base), twice.estimate(outputs, base)
    assert np.array_equal(once, again)
    assert wider[0] == pytest.approx(covariance[0] * np.array([[4.0, 2.0], [2.0, 1.0]]))


def test_velocities_within_a_block_lie_on_a_line():
    commands, readings = drive()
    one = LearnedFilter(make_model())
    before = one.state[:2]
    states, _ = one.run(commands[:1], readings[0])
    assert states[-1, :2] == pytest.approx(one.state[:2])
    assert states[4, :2] == pytest.approx(0.5 * (before + one.state[:2]))


def inputs_of(commands, readings):
    """Inputs after every block, beside a filter that says nothing."""
    memory, found = np.zeros((1, MEMORY_SIZE)), []
    for command, block in zip(commands, readings, strict=True):
        silent = Filtered(
            np.zeros((1, 15)), np.eye(15)[None], np.zeros((1, BLOCK, 5)), np.zeros((1, 3)), np.eye(3)[None]
        )
        given = block_inputs(memory, command[None], block[None], silent, 0.008, 0.3, np.zeros(4))
        found.append(dict(zip(INPUTS, given[0], strict=True)))
    return found


def test_biases_are_read_at_rest_and_kept_while_driving():
    commands, readings = drive()
    readings[:, :, 1] = 0.25
    readings[5:, :, 1] = 3.0
    found = inputs_of(commands, readings)
    assert found[4]["rest_specific_force_y"] == pytest.approx(0.25)
    assert found[-1]["rest_specific_force_y"] == pytest.approx(0.25)
    assert found[-1]["rest_share"] == pytest.approx(5 * BLOCK / 125)
    assert found[-1]["specific_force_y_second"] == pytest.approx(3.0)


def test_a_rest_after_driving_teaches_nothing():
    commands, readings = drive()
    commands[10:], readings[10:, :, 3:] = 0.0, 0.0
    assert inputs_of(commands, readings)[-1]["rest_share"] == pytest.approx(5 * BLOCK / 125)


def test_missing_samples_are_left_out_of_means():
    commands, readings = drive()
    readings[8, ::2] = np.nan
    readings[8, 1::2, 2] = 0.4
    found = inputs_of(commands, readings)[8]
    assert found["yaw_rate_first"] == pytest.approx(0.4)
    assert all(np.isfinite(value) for value in found.values())


def test_a_diverged_filter_does_not_take_the_network_along():
    base = velocity_base("filter", np.array([0.2, 0.2]), np.array([[2.0, -3.0], [0.18, 0.02]]))
    assert base[0] == pytest.approx([0.55, -0.25])
    assert base[1] == pytest.approx([0.18, 0.02])


@pytest.mark.parametrize("changes", [{}, {"layers": 3, "place": True}])
def test_a_file_gives_the_same_network(tmp_path, changes):
    network = make_network(SENSOR_INPUTS, "rim", **changes)
    file = save_network(network, tmp_path / "network.npz")
    again = load_network(file)
    assert again.digest() == network.digest()
    assert again.description == network.description
    save_network(again, tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == file.read_bytes()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"output_weight": np.zeros((4, 6), np.float32)}, "output_weight is float32 of shape"),
        ({"deviation": np.zeros(len(INPUTS))}, "not positive"),
        ({"output_bias": np.full(OUTPUTS, np.nan, np.float32)}, "not finite"),
        ({"layers": make_network(layers=2).layers}, "is not part of"),
    ],
)
def test_a_damaged_file_is_refused(tmp_path, change, message):
    with pytest.raises(InputError, match=message):
        load_network(save_network(replace(make_network(), **change), tmp_path / "network.npz"))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": 3}, "reads up to 2"),
        ({"place": True}, "2 factors of calibration"),
        ({"place": 0}, "true or false"),
        ({"layers": 9}, "1 to 4"),
        ({"layers": 1.0}, "1 to 4"),
        ({"format": 1, "layers": 2}, "format 1"),
        ({"layers": 2}, "it has no 'input_weight_2'"),
    ],
)
def test_a_description_that_does_not_fit_is_refused(tmp_path, change, message):
    network = make_network()
    wrong = replace(network, description=replace(network.description, **change))
    with pytest.raises(InputError, match=message):
        load_network(save_network(wrong, tmp_path / "network.npz"))


def test_a_description_of_other_inputs_is_refused(tmp_path):
    network = make_network()
    wrong = replace(network.description, inputs=("temperature", *network.description.inputs[1:]))
    with pytest.raises(InputError, match="train anew"):
        load_network(save_network(replace(network, description=wrong), tmp_path / "network.npz"))


def test_what_does_not_fit_is_one_sentence(tmp_path):
    (tmp_path / "text.npz").write_text("no archive")
    with pytest.raises(InputError, match="not an estimator's network"):
        load_network(tmp_path / "text.npz")
    with pytest.raises(InputError, match="correction"):
        find_network("corection")
    with pytest.raises(InputError, match="5 samples under one command"):
        LearnedBatch(make_model()).step(np.zeros((1, 2)), np.zeros((1, 5, 5)))
    sensors = replace(Sensors(), imu=replace(Sensors().imu, sample_rate=100.0))
    with pytest.raises(InputError, match="the network was trained for"):
        LearnedModel(InertialModel.of(ddagr(), sensors), make_network())


def test_a_recording_is_filtered_block_by_block():
    commands, readings = drive()
    samples = readings.reshape(-1, 5)[:-3]
    names = ("specific_force_x", "specific_force_y", "yaw_rate", "encoder_right", "encoder_left")
    columns = {name: samples[:, i] for i, name in enumerate(names)} | {"t": 0.008 * np.arange(1, len(samples) + 1)}
    columns |= {name: np.repeat(commands[:, i], BLOCK)[:-3] for i, name in enumerate(("command_right", "command_left"))}
    model = make_model()
    states, velocities, covariances = run_learned_filter(model, columns)
    assert (len(states), velocities.shape, covariances.shape) == (190, (19, 2), (19, 2, 2))
    one = LearnedFilter(model)
    for k in range(19):
        one.run(commands[k : k + 1], readings[k])
    assert np.array_equal(velocities[-1], one.state[:2])
    unknown = np.where(np.arange(len(samples)) == 40, np.nan, 0.3)
    refused = (
        (
            columns | {"t": 0.02 * np.arange(1, len(samples) + 1)},
            "every 0.02 s and the network was trained for 0.008 s",
        ),
        ({name: values[:4] for name, values in columns.items()}, "there are 4 samples and a block of the network has"),
        (columns | {"command_left": unknown}, "1 of 197 rows have no command, row 41 the first"),
        ({name: values for name, values in columns.items() if name != "t"}, "need a time column"),
    )
    for given, said in refused:
        with pytest.raises(InputError, match=said):
            run_learned_filter(model, given)


def test_published_estimators_are_small_and_whole():
    assert estimator_names() == ("alone", "correction", "features", "pose", "pose_wide")
    for name in estimator_names():
        folder = Path(shipped_folder("estimators")) / name
        assert (folder / "network.npz").stat().st_size < 800_000
        network = find_network(name)
        assert network.description.name == name
        assert "filter_v_x" not in network.description.inputs or name != "alone"
        assert (folder / "README.md").is_file()
