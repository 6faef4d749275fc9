"""Training of the learned estimator: drawn turns, torch against numpy, going on after an interruption."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="needs the extra rl")

from agents.train_velocity import PUBLISHED, learnt_and_judged, main  # noqa: E402
from agents.velocity_card import card, publish_estimator  # noqa: E402
from agents.velocity_drives import NOMINAL, WIDE, Drives, Plan, _drive, as_drives, draw_turn, make_drives  # noqa: E402
from agents.velocity_losses import gaussian_loss, mirror  # noqa: E402
from agents.velocity_training import VARIANTS, VelocitySettings, VelocityTraining  # noqa: E402
from ddagr_gym.errors import InputError  # noqa: E402
from ddagr_gym.estimation import LearnedBatch, LearnedModel  # noqa: E402
from ddagr_gym.estimation.inertial_filter import InertialModel  # noqa: E402
from ddagr_gym.estimation.learned_filter import find_network  # noqa: E402
from ddagr_gym.estimation.learned_inputs import INPUTS  # noqa: E402
from ddagr_gym.estimation.learned_network import VELOCITY_SCALE, load_network  # noqa: E402
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


def test_a_network_learns_the_place_that_the_filter_misses(tmp_path):
    drives, judged = made_up(), made_up(8, seed=1)
    for own in (drives, judged):
        own.inputs[..., INPUTS.index("pose_x")] = own.places[..., 0] - 0.05
    settings = VelocitySettings(turns=24, validation=8, units=8, layers=2, epochs=40, batch=6, learning_rate=0.02)
    network = (own := VelocityTraining("pose", settings, drives, judged, tmp_path)).run()
    assert own.course[0]["x_rmse_mm"] > 25.0
    assert own.course[-1]["x_rmse_mm"] < 20.0  # 50 mm without learning
    assert network.description.place
    assert len(network.description.calibration) == 4


def test_near_turns_are_of_the_task_as_it_is():
    settings, episode = draw_turn(np.random.default_rng(3), NOMINAL)
    assert not settings.effects
    assert (episode.turn.radius, episode.turn.speed) == (0.80, 0.20)


def test_workers_drive_the_same_turns(tmp_path, monkeypatch):
    monkeypatch.setattr("agents.velocity_drives.PART", 1)
    alone, shared = make_drives(2, 11, tmp_path / "one"), make_drives(2, 11, tmp_path / "two", workers=2)
    for item in fields(Drives):
        assert np.array_equal(getattr(alone, item.name), getattr(shared, item.name))


def test_near_turns_are_learnt_from_and_judge_nothing(tmp_path):
    settings = VelocitySettings(turns=2, near=1, validation=1, root_seed=11)
    learnt, judged = learnt_and_judged(settings, tmp_path, 1)
    assert (len(learnt), len(judged)) == (3, 1)
    wide = make_drives(3, 11, tmp_path / "drives_11")
    assert np.array_equal(judged.inputs[0], wide.inputs[2])
    near = make_drives(1, 12, tmp_path / "drives_12", NOMINAL)
    assert np.array_equal(learnt.inputs[2], near.inputs[0])


def test_wide_turns_have_robots_and_grounds_that_others_have_not():
    further = {"Payload", "SoilPatch", "SoilSplit", "Multipass", "SlipSinkage", "LateralBulldozing"}
    seen, weak = {True: set(), False: set()}, {True: 0, False: 0}
    for number in range(150):
        for plan in (WIDE, Plan()):
            settings, episode = draw_turn(np.random.default_rng([5, number]), plan)
            seen[plan is WIDE] |= {type(effect).__name__ for effect in settings.effects}
            weak[plan is WIDE] += episode.robot.drivetrain != ddagr().drivetrain
    assert further <= seen[True]
    assert not further & seen[False]
    assert weak[True] > 5
    assert weak[False] == 0


def test_what_wide_turns_have_besides_is_drawn_last():
    plain = replace(WIDE, weak=0.0, one_sided=0.0, patched=0.0, split=0.0, worked=0.0)
    for number in range(20):
        wide, plan = (draw_turn(np.random.default_rng([6, number]), own) for own in (WIDE, plain))
        assert wide[1].soils == plan[1].soils
        assert wide[1].sensors == plan[1].sensors
        assert wide[0].effects[: len(plan[0].effects)] == plan[0].effects


def test_wide_turns_are_learnt_from_and_judge_too(tmp_path):
    settings = VelocitySettings(turns=1, wide=1, validation=1, root_seed=11)
    learnt, judged = learnt_and_judged(settings, tmp_path, 1)
    wide = make_drives(2, 13, tmp_path / "drives_13", WIDE)
    assert (len(learnt), len(judged)) == (2, 2)
    assert np.array_equal(learnt.inputs[1], wide.inputs[0])
    assert np.array_equal(judged.inputs[1], wide.inputs[1])


def test_a_training_goes_on_from_a_published_network(tmp_path):
    settings = VelocitySettings(turns=24, validation=8, units=128, layers=2, epochs=1, batch=6, begun="pose")
    own = VelocityTraining("pose_wide", settings, made_up(), made_up(8, seed=1), tmp_path)
    before, published = own.network().arrays(), find_network("pose").arrays()
    assert all(np.array_equal(before[name], published[name]) for name in published)
    after = own.run().arrays()
    assert not np.array_equal(after["output_weight"], published["output_weight"])
    assert np.array_equal(after["mean"], published["mean"])
    with pytest.raises(InputError, match="2 layers of 8 units goes on from pose, which has 2 of 128"):
        VelocityTraining("pose_wide", replace(settings, units=8), made_up(), made_up(8, seed=1), tmp_path)


def test_a_training_does_not_go_on_where_another_network_was_published_in_between(tmp_path, monkeypatch):
    settings = VelocitySettings(turns=24, validation=8, units=128, layers=2, epochs=2, batch=6, begun="pose")
    VelocityTraining("pose_wide", settings, made_up(), made_up(8, seed=1), tmp_path)._keep_epoch()
    pose = find_network("pose")
    other = replace(pose, output_bias=pose.output_bias + 1.0)
    monkeypatch.setattr("agents.velocity_training.find_network", lambda name: other)
    with pytest.raises(InputError, match="went on from another pose than is here: give another folder"):
        VelocityTraining("pose_wide", settings, made_up(), made_up(8, seed=1), tmp_path).run()


def test_turns_that_were_driven_before_plans_had_more_parts_are_kept(tmp_path):
    make_drives(1, 11, tmp_path, NOMINAL)
    stored = json.loads((tmp_path / "drives.json").read_text())
    for name in ("weak", "one_sided", "patched", "split", "worked"):
        del stored["plan"][name]
    (tmp_path / "drives.json").write_text(json.dumps(stored))
    assert len(make_drives(1, 11, tmp_path, NOMINAL)) == 1
    with pytest.raises(InputError, match="another seed or plan"):
        make_drives(1, 11, tmp_path, replace(NOMINAL, weak=0.1))


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--estimators", "place"], "place"),
        (["--workers", "0"], "workers is 0"),
        (["--layers", "5"], "4 at most"),
        (["--near", "-1"], "near is -1"),
        (["--wide", "-1"], "wide is -1"),
    ],
)
def test_bad_words_are_one_sentence(tmp_path, capsys, words, says):
    with pytest.raises(SystemExit, match="2"):
        main(["--output", str(tmp_path), *words])
    assert says in capsys.readouterr().err


@pytest.mark.parametrize("name", VARIANTS)
def test_a_published_card_is_that_of_its_record(name):
    folder = PUBLISHED / name
    record = json.loads((folder / "training.json").read_text())
    assert (folder / "README.md").read_text() == card(record, VARIANTS[name])
    assert find_network(name).description.calibration == tuple(record["calibration"])


def test_what_is_published_is_of_the_training(tmp_path):
    drives = made_up()
    drives.truth[..., 0] = 0.002 * np.random.default_rng(5).standard_normal(drives.truth.shape[:2])
    drives.places[..., 0] = 0.1
    settings = VelocitySettings(turns=24, validation=24, units=8, layers=2, epochs=3, batch=6)
    own = VelocityTraining("pose", settings, drives, drives, tmp_path / "run")
    network = own.run()
    publish_estimator(own, network, Plan(), tmp_path / "pose")
    kept = load_network(tmp_path / "pose" / "network.npz")
    assert kept.description == network.description
    assert all(np.array_equal(value, kept.arrays()[name]) for name, value in network.arrays().items())
    assert "training.png" in (tmp_path / "pose" / "README.md").read_text()
    assert "a CPU core" in (tmp_path / "pose" / "README.md").read_text()
    assert (tmp_path / "pose" / "training.png").stat().st_size > 10_000


def test_mirroring_twice_changes_nothing():
    places, signs = mirror(INPUTS)
    assert np.array_equal(places[places], np.arange(len(INPUTS)))
    assert np.array_equal(signs * signs[places], np.ones(len(INPUTS)))
    assert signs[INPUTS.index("filter_gravity_y")] == -1.0
    assert signs[INPUTS.index("filter_deviation_gravity_y")] == 1.0
    assert [signs[INPUTS.index(f"pose_{name}")] for name in ("x", "y", "turned", "deviation_turned")] == [1, -1, -1, 1]


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
    columns |= turned(columns, 0.7)
    drives = as_drives([columns])
    network = training(tmp_path, "correction").network()
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
    present = int(drives.present.sum())
    carried = drives.inputs[0, :present][:, [INPUTS.index("pose_x"), INPUTS.index("pose_y")]]
    assert np.abs(carried[-1]).max() > 0.5
    assert drives.places[0, :present] == pytest.approx(carried, abs=0.1)  # as far as the filter is off
    assert VELOCITY_SCALE == 0.01


def turned(columns, angle):
    """True pose of a drive in a world that is turned and moved."""
    x, y, cosine, sine = columns["true_x"], columns["true_y"], np.cos(angle), np.sin(angle)
    return {
        "true_x": 3.0 + cosine * x - sine * y,
        "true_y": sine * x + cosine * y,
        "true_yaw": columns["true_yaw"] + angle,
    }


def test_the_mirror_of_a_turn_is_what_its_mirrored_readings_give():
    """On level ground every sideways reading and the sides of wheels and commands are exchanged."""
    columns = _drive([77_002, 2], NOMINAL)
    other = dict(columns)
    for right, left in (("command_right", "command_left"), ("encoder_right", "encoder_left")):
        other[right], other[left] = columns[left], columns[right]
    for name in ("specific_force_y", "yaw_rate"):
        other[name] = -columns[name]
    places, signs = mirror(INPUTS)
    own, mirrored = as_drives([columns]).inputs, as_drives([other]).inputs
    assert mirrored == pytest.approx(own[..., places] * signs, abs=0.02)


def test_no_frozen_scenario_is_drawn_for_training():
    rng_soils = {repr(draw_turn(np.random.default_rng([20_261_240, n]))[1].soils) for n in range(20)}
    frozen = {repr(item.episode.soils) for name in scenario_names() if name in ("S1", "V", "T") for item in
              load_scenarios(name)}  # fmt: skip
    assert not rng_soils & frozen


def test_the_record_is_plain(tmp_path):
    own = training(tmp_path)
    own.run()
    assert json.loads(json.dumps(own._record()))["name"] == "alone"
