"""The bound against Kalman's covariance, what it is made of, and the files of the benchmark."""

import json

import numpy as np
import pytest

from benchmarks.row_turn_plants import scenario
from benchmarks.velocity_bound import __main__ as program
from benchmarks.velocity_bound.figure import draw
from benchmarks.velocity_bound.filters import ESTIMATORS, FILTERS, estimated_motion
from benchmarks.velocity_bound.information import accumulated_information, motion_bounds
from benchmarks.velocity_bound.smoother import smooth
from benchmarks.velocity_bound.soil_unknowns import field_modes, normals_of, soil_of, varied_field
from benchmarks.velocity_bound.study import BOUNDS, PLANTS
from benchmarks.velocity_bound.summary import root_ratio, summarise_plant, table
from benchmarks.velocity_bound.turn_model import MOTION, TurnModel
from ddagr_gym.estimation.dead_reckoning import integrate_track
from ddagr_gym.physics.soil_draws import get_distribution, soil_field
from ddagr_gym.physics.wheel_forces import soil_vector

STEPS = 30


@pytest.fixture
def linear():
    """A linear system of 3 states: transition, process noise, measurement, its deviations; the prior is N(0, 1)."""
    rng = np.random.default_rng(3)
    f = np.eye(3) + 0.1 * rng.standard_normal((3, 3))
    return f, np.diag([0.02, 0.05, 0.03]), rng.standard_normal((2, 3)), np.array([0.7, 0.4])


def by_unknowns(f, noise, h):
    """Derivatives of states (T, 3, P) and readings (T, 2, P) by the initial state and the noise of every step."""
    root = np.linalg.cholesky(noise) if noise.any() else np.zeros((3, 3))
    state, states = np.hstack([np.eye(3), np.zeros((3, 3 * STEPS))]), []
    for k in range(STEPS):
        state = f @ state
        state[:, 3 + 3 * k : 6 + 3 * k] += root
        states.append(state.copy())
    return np.array(states), h @ np.array(states)


def kalman(f, noise, h, deviations):
    """Filtered covariances (T, 3, 3)."""
    p, found = np.eye(3), []
    for _ in range(STEPS):
        p = f @ p @ f.T + noise
        gain = p @ h.T @ np.linalg.inv(h @ p @ h.T + np.diag(deviations**2))
        p = (np.eye(3) - gain @ h) @ p
        found.append(p)
    return np.array(found)


def tichavsky(f, noise, h, deviations):
    """The recursion (21) of Tichavsky, Muravchik and Nehorai for a linear system, inverted: (T, 3, 3)."""
    j, found, weight = np.eye(3), [], np.linalg.inv(noise)
    for _ in range(STEPS):
        d_11, d_12 = f.T @ weight @ f, -f.T @ weight
        d_22 = weight + h.T @ np.diag(deviations**-2) @ h
        j = d_22 - d_12.T @ np.linalg.inv(j + d_11) @ d_12
        found.append(np.linalg.inv(j))
    return np.array(found)


def filtered(states, readings, deviations):
    motion = np.concatenate([states, np.zeros_like(states)], axis=1)
    information = accumulated_information(readings, deviations)
    return motion_bounds(information, motion, np.zeros((len(states), 3)), 0.1).filtered[:, :3, :3]


def test_it_is_kalmans_covariance_without_process_noise(linear):
    f, _, h, deviations = linear
    found = filtered(*by_unknowns(f, np.zeros((3, 3)), h), deviations)
    np.testing.assert_allclose(found, kalman(f, np.zeros((3, 3)), h, deviations), atol=1e-10)


def test_with_process_noise_as_unknowns_it_is_kalmans_covariance_and_the_recursion(linear):
    f, noise, h, deviations = linear
    found = filtered(*by_unknowns(f, noise, h), deviations)
    np.testing.assert_allclose(found, kalman(f, noise, h, deviations), atol=1e-10)
    np.testing.assert_allclose(found, tichavsky(f, noise, h, deviations), atol=1e-10)


def test_blocks_and_missing_channels_say_as_much_as_their_samples(linear):
    f, noise, h, deviations = linear
    _, readings = by_unknowns(f, noise, h)
    each = accumulated_information(readings, deviations)
    np.testing.assert_allclose(accumulated_information(readings, deviations, 5), each[4::5])
    alone = accumulated_information(readings[:, :1], deviations[:1])
    np.testing.assert_allclose(accumulated_information(readings, np.array([deviations[0], np.inf])), alone)


def test_smoothed_is_less_than_filtered_and_equals_it_at_the_end(linear):
    f, noise, h, deviations = linear
    states, readings = by_unknowns(f, noise, h)
    motion = np.concatenate([states, np.zeros_like(states)], axis=1)
    found = motion_bounds(accumulated_information(readings, deviations), motion, np.zeros((STEPS, 3)), 0.1)
    np.testing.assert_allclose(found.smoothed[-1], found.filtered[-1])
    assert (np.linalg.eigvalsh((found.filtered - found.smoothed)[:, :3, :3]) > -1e-10).all()


def test_pose_of_integrated_best_velocities_scatters_as_said():
    rng, count, interval, size = np.random.default_rng(1), 40, 0.1, 4
    speeds = np.column_stack([np.full(count, 0.2), np.full(count, 0.01), np.full(count, 0.25)])
    track = integrate_track(*speeds.T, interval, speeds[0])
    shapes = 1e-3 * rng.standard_normal((count, 3, size))
    slopes = rng.standard_normal((count, 2, size))
    information = accumulated_information(slopes, np.ones(2))
    motion = np.concatenate([shapes, np.zeros_like(shapes)], axis=1)
    said = motion_bounds(information, motion, track, interval).reckoned[-1]
    ends = []
    for _ in range(3000):
        truth = rng.standard_normal(size)
        told = np.cumsum(np.einsum("tcp,tc->tp", slopes, slopes @ truth + rng.standard_normal((count, 2))), axis=0)
        best = np.linalg.solve(information, told[..., None])[..., 0]
        wrong = np.einsum("tmp,tp->tm", shapes, best - truth)
        ends.append((integrate_track(*(speeds + wrong).T, interval, speeds[0] + wrong[0]) - track)[-1])
    np.testing.assert_allclose(np.std(ends, axis=0), np.sqrt(np.diag(said)), rtol=0.12)


def test_soil_and_its_standard_normal_numbers_belong_together():
    distribution = get_distribution("thesis_a1_range")
    for seed in range(5):
        soil = distribution.sample(np.random.default_rng(seed))
        normals = normals_of(distribution, soil)
        np.testing.assert_allclose(soil_vector(soil_of(distribution, normals)), soil_vector(soil), rtol=1e-9)
    drawn = [normals_of(distribution, distribution.sample(np.random.default_rng(s))) for s in range(400)]
    assert np.abs(np.mean(drawn, axis=0)).max() < 0.2
    np.testing.assert_allclose(np.cov(np.transpose(drawn)), np.eye(9), atol=0.25)


def test_modes_hold_the_variation_along_the_way():
    soil = get_distribution("thesis_a1_range").sample(np.random.default_rng(0))
    places = np.column_stack([np.linspace(-0.5, 1.5, 60), np.linspace(-1.0, 1.0, 60)])
    coordinates = []
    for seed in range(60):
        field = soil_field(soil, np.random.default_rng(seed), 0.05, 0.5, (-1.0, 1.8, -2.4, 2.4))
        modes = field_modes(field, soil_vector(soil), places, 0.05, 0.5)
        coordinates.append(np.concatenate([modes.strength, modes.stiffness]))
    assert 0.99 <= modes.kept < 1.0
    assert np.mean(np.square(coordinates)) == pytest.approx(1.0, abs=0.1)
    assert np.std(coordinates, axis=0).max() < 1.5
    zero = np.zeros(len(modes.strength))
    np.testing.assert_allclose(varied_field(field, modes, zero, zero, 0.05), field.values)
    bare = varied_field(field, modes, -modes.strength, -modes.stiffness, 0.05)
    at = np.abs(np.subtract.outer(np.linspace(-1.0, 1.8, bare.shape[0]), [0.5])).argmin()
    row = np.abs(np.subtract.outer(np.linspace(-2.4, 2.4, bare.shape[1]), [0.0])).argmin()  # the path leads past it
    assert bare[at, row, 0] == pytest.approx(soil.cohesion, rel=0.02)
    assert field.values[..., 0].std() > 0.03 * soil.cohesion


@pytest.fixture(scope="module")
def short_turn():
    """The start of a turn by constant commands, and its model."""
    settings, episode, _ = scenario("weaker", 1)
    commands = np.tile([0.9, 0.6], (250, 1))
    track = np.column_stack([np.linspace(-0.5, -0.2, 250), np.zeros((250, 2))])
    return settings, episode, TurnModel(settings, episode, commands, track)


def test_unknowns_are_all_that_the_task_draws(short_turn):
    settings, episode, model = short_turn
    assert set(model.groups) == {"biases", "robot", "soil", "variation", "slope", "change"}
    assert len(model.truth) == len(model.names) == len(model.groups)
    at = model.names.index("gyro_bias")
    assert model.truth[at] * settings.randomisation.gyro_bias == pytest.approx(episode.sensors.imu.gyro_bias)
    for _, known, _ in BOUNDS.values():
        assert set(known) <= set(model.groups)


def test_model_at_the_truth_drives_as_the_task_does(short_turn):
    settings, episode, model = short_turn
    from ddagr_gym.envs.turn_batch import TurnBatch

    batch = TurnBatch(settings, 1)
    rngs = [np.random.default_rng(0)]
    batch.reset([0], rngs, {"episode": episode})
    observations, rewards = batch.new_observations(), np.zeros(1)
    limit = settings.robot.maximum_wheel_speed
    for _ in range(25):
        batch.step(np.array([[0.9, 0.6]]) / limit, rngs, rewards, observations)
    motion, _ = model.simulate(model.truth[None])
    assert motion.shape == (1, 250, len(MOTION))
    np.testing.assert_allclose(motion[0, -1, 3:], batch.record[0, -1, :3], atol=2e-3)


def test_biases_move_the_readings_and_nothing_else(short_turn):
    settings, _, model = short_turn
    changed = model.truth.copy()
    changed[[model.names.index("gyro_bias"), model.names.index("accelerometer_bias_y")]] += 1.0
    motion, readings = model.simulate(np.array([model.truth, changed]))
    np.testing.assert_array_equal(motion[0], motion[1])
    moved = readings[1] - readings[0]
    spread = settings.randomisation
    expected = [0.0, spread.accelerometer_bias, spread.gyro_bias, 0.0, 0.0]
    np.testing.assert_allclose(moved, np.tile(expected, (250, 1)), atol=1e-12)


def test_smoother_finds_the_posterior_mean_of_a_linear_model(linear):
    f, noise, h, deviations = linear
    states, slopes = by_unknowns(f, noise, h)
    rng = np.random.default_rng(0)

    class Linear:
        truth = rng.standard_normal(slopes.shape[2])

        def simulate(self, unknowns):
            return np.einsum("tmp,np->ntm", states, unknowns), np.einsum("tcp,np->ntc", slopes, unknowns)

        def derivatives(self, unknowns):
            return states, slopes

    model = Linear()
    readings = model.simulate(model.truth[None])[1][0] + deviations * rng.standard_normal((STEPS, 2))
    known = np.zeros(len(model.truth), dtype=bool)
    known[0] = True
    found = smooth(model, known, deviations, slopes, readings)
    assert found.unknowns[0] == model.truth[0]
    free = slopes[..., 1:] / deviations[:, None]
    rest = (readings - slopes[..., 0] * model.truth[0]) / deviations
    information = np.eye(free.shape[2]) + np.einsum("tcp,tcq->pq", free, free)
    expected = np.linalg.solve(information, np.einsum("tcp,tc->p", free, rest))
    np.testing.assert_allclose(found.unknowns[1:], expected, atol=1e-9)
    assert found.cost[-1] < found.cost[0]


def test_every_estimator_starts_at_the_known_place():
    _, episode, _ = scenario("level", 1)
    names = ("specific_force_x", "specific_force_y", "yaw_rate", "encoder_right", "encoder_left")
    columns = {name: np.zeros(250) for name in ("command_right", "command_left", *names)}
    columns["t"] = 0.008 * np.arange(1.0, 251.0)
    start = [-episode.turn.run_in, episode.lateral_offset, episode.heading_offset]
    for name in set(ESTIMATORS) - {"inertial_told_soil", "inertial_told_all"}:  # these need true forces
        motion = estimated_motion(name, columns, episode)
        np.testing.assert_allclose(motion[-1, 3:], start, atol=2e-3, err_msg=name)


def test_ratio_by_hand_and_of_a_filter_that_broke_down():
    rng = np.random.default_rng(0)
    found = root_ratio(np.array([4.0, 16.0]), np.array([1.0, 4.0]), rng)
    assert found == {"value": 2.0, "interval": [2.0, 2.0]}
    assert root_ratio(np.array([np.inf, 1.0]), None, rng)["value"] is None


def synthetic(number, broken):
    """A turn in which every filter is three times worse than the bound, and one breaks down where asked."""
    length, series = 20, {"bound_task": [[1e-6, 1e-6]] * 30, "bound_slope": [[1e-6, 4e-6]] * 30}
    bound = {"velocity": [1e-6, 4e-6], "exit": [1e-4, 1e-4, 1e-6], "reckoned": [4e-4, 4e-4, 1e-6]}
    own = {"velocity": [9e-6, 36e-6], "exit": [9e-4, 9e-4, 9e-6]}
    filters = dict.fromkeys(ESTIMATORS, own)
    series |= dict.fromkeys(ESTIMATORS, [[9e-6, 36e-6]] * 30)
    if broken:
        filters["thesis"] = {"velocity": [None, None], "exit": [None] * 3}
        series["thesis"] = [[1e-6, 1e-6]] * 5 + [[None, None]] * 25
    turning = np.linspace(0.0, np.pi, 30).tolist()
    return {"bounds": {"task": bound, "slope": bound}, "filters": filters, "series": series, "turning": turning,
            "unknowns": 60, "kept": 0.99, "exit": length + number}  # fmt: skip


def test_summary_names_ratios_and_what_broke_down(tmp_path):
    found = summarise_plant([synthetic(n, n == 1) for n in range(3)])
    assert found["filters"]["inertial"]["over_bound"]["v_y_mm_s"]["value"] == pytest.approx(3.0)
    assert found["bounds"]["task"]["reckoned_across_mm"]["value"] == pytest.approx(20.0)
    assert found["filters"]["thesis"]["v_x_mm_s"]["value"] is None
    assert len(found["series"]["t"]) == len(found["series"]["thesis"]["v_x"])
    result = {"plants": {"level": found}}
    assert "broke down" in table(result)
    json.dumps(result, allow_nan=False)
    draw(result, tmp_path / "bound.png")
    assert (tmp_path / "bound.png").stat().st_size > 20_000


def test_bad_arguments_are_one_sentence(capsys):
    for words in (["--plants", "levle"], ["--scenarios", "1"], ["--checked", "9"], ["--checked", "-1"]):
        with pytest.raises(SystemExit) as ended:
            program.main(words)
        assert ended.value.code == 2
    assert "give at least 0" in capsys.readouterr().err


def test_kept_result_says_how_far_the_filters_are_and_that_the_bound_is_reached():
    result = json.loads(program.RESULT.read_text())
    assert set(result["plants"]) == set(PLANTS)
    for found in result["plants"].values():
        for name in FILTERS:
            assert found["filters"][name]["over_bound"]["v_x_mm_s"]["value"] > 1.0
        for name in ("v_x", "v_y"):
            low, high = found["smoother"]["drawn"][name]["interval"]
            assert low < 1.2
            assert high > 0.8
        assert found["bounds"]["soil"]["v_y_mm_s"]["value"] < found["bounds"]["task"]["v_y_mm_s"]["value"]


@pytest.mark.slow
def test_turns_are_kept_and_not_driven_again(tmp_path, capsys):
    words = ["--plants", "level", "--scenarios", "2", "--checked", "0"]
    words += ["--work", str(tmp_path), "--output", str(tmp_path / "found.json")]
    assert program.main(words) == 0
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.glob("level_*.json")}
    assert len(kept) == 2
    assert program.main(words) == 0
    assert kept == {path: path.stat().st_mtime_ns for path in kept}
    assert "inertial filter" in capsys.readouterr().out
