"""The native batch: bit-equal to single environments in every autoreset mode."""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import ddagr_gym  # noqa: F401  registers the ids
from ddagr_gym.envs.registration import TURN_ID
from ddagr_gym.errors import InputError

COUNT = 3


def assert_same(a, b, path=""):
    if isinstance(a, dict):
        assert set(a) == set(b), path
        for key in a:
            assert_same(a[key], b[key], f"{path}/{key}")
    elif isinstance(a, np.ndarray) and a.dtype == object:
        for x, y in zip(a, b, strict=True):
            assert (x is None) == (y is None), path
            if x is not None:
                np.testing.assert_array_equal(x, y, err_msg=path)
    else:
        assert np.asarray(a).dtype == np.asarray(b).dtype, path
        np.testing.assert_array_equal(a, b, err_msg=path)


def make_native(count=COUNT, **arguments):
    return gymnasium.make_vec(TURN_ID, num_envs=count, **arguments)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
@pytest.mark.parametrize("level", ["small", "full"])
def test_batch_equals_single_environments(mode, level):
    arguments = {"max_episode_steps": 25, "info_level": level}
    single = SyncVectorEnv([lambda: gymnasium.make(TURN_ID, **arguments)] * COUNT, autoreset_mode=mode)
    native = make_native(**arguments, autoreset_mode=mode)
    assert native.metadata["autoreset_mode"] is mode
    assert_same(single.reset(seed=5)[0], native.reset(seed=5)[0])
    rng = np.random.default_rng(0)
    endings = 0
    for _ in range(60):
        actions = rng.uniform(-1, 1, (COUNT, 2)).astype(np.float32)
        expected, got = single.step(actions), native.step(actions)
        for i, (a, b) in enumerate(zip(expected, got, strict=True)):
            assert_same(a, b, str(i))
        endings += int((got[2] | got[3]).sum())
    assert endings >= 2 * COUNT


def test_disabled_autoreset_needs_a_mask():
    native = make_native(autoreset_mode="Disabled", max_episode_steps=3)
    native.reset(seed=0)
    actions = np.zeros((COUNT, 2), np.float32)
    for _ in range(3):
        *_, truncated, _ = native.step(actions)
    assert truncated.all()
    with pytest.raises(gymnasium.error.ResetNeeded):
        native.step(actions)
    native.reset(options={"reset_mask": np.ones(COUNT, bool)})
    native.step(actions)


def test_mask_resets_only_the_chosen():
    native = make_native(autoreset_mode="Disabled", info_level="full")
    native.reset(seed=0)
    for _ in range(10):
        *_, info = native.step(np.full((COUNT, 2), 0.5, np.float32))
    _, after = native.reset(options={"reset_mask": np.array([False, True, False])})
    assert after["true_x"][1] == -0.5
    assert after["true_x"][0] == info["true_x"][0]
    np.testing.assert_array_equal(after["_true_x"], [False, True, False])


def test_a_seed_with_a_mask_reseeds_only_the_chosen():
    one, two = make_native(), make_native()
    for native in (one, two):
        native.reset(seed=0)
    one.reset(seed=70, options={"reset_mask": np.array([False, True, False])})
    assert one.np_random_seed == (0, 71, 2)
    actions = np.zeros((COUNT, 2), np.float32)
    ours, theirs = one.step(actions)[0], two.step(actions)[0]
    np.testing.assert_array_equal(ours[[0, 2]], theirs[[0, 2]])
    assert (ours[1] != theirs[1]).any()


def test_no_time_limit_is_minus_one_as_of_a_single_environment():
    native = make_native(max_episode_steps=-1)
    native.reset(seed=0)
    for _ in range(330):
        *_, truncated, _ = native.step(np.zeros((COUNT, 2), np.float32))
        assert not truncated.any()
    native.unwrapped.spread_time_limits()


def test_threads_do_not_change_results():
    one, two = make_native(8), make_native(8, threads=2)
    assert_same(one.reset(seed=3)[0], two.reset(seed=3)[0])
    rng = np.random.default_rng(1)
    for _ in range(20):
        actions = rng.uniform(-1, 1, (8, 2)).astype(np.float32)
        for a, b in zip(one.step(actions), two.step(actions), strict=True):
            assert_same(a, b)
    two.close()


def test_results_do_not_depend_on_the_batch():
    few, many = make_native(2), make_native(9)
    assert_same(few.reset(seed=3)[0], many.reset(seed=3)[0][:2])
    for _ in range(10):
        actions = np.full((9, 2), 0.4, np.float32)
        assert_same(few.step(actions[:2])[0], many.step(actions)[0][:2])


def test_seed_list_is_taken():
    native = make_native()
    listed, _ = native.reset(seed=[5, 6, 7])
    counted, _ = native.reset(seed=5)
    np.testing.assert_array_equal(listed, counted)
    assert native.np_random_seed == (5, 6, 7)
    with pytest.raises(InputError, match="2 seeds"):
        native.reset(seed=[1, 2])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"autoreset_mode": "NextSteps"}, "NextStep"),
        ({"max_episode_steps": 0}, "max_episode_steps"),
        ({"threads": 0}, "threads"),
        ({"render_mode": "human"}, "render_mode is 'human': give None."),
        ({"max_episode_steps": "all"}, "max_episode_steps is 'all'"),
        ({"radious": 0.8}, "radius"),
    ],
)
def test_bad_arguments_are_one_sentence(arguments, words):
    with pytest.raises(InputError, match=words):
        make_native(**arguments)


def test_bad_actions_are_one_sentence():
    native = make_native()
    native.reset(seed=0)
    with pytest.raises(InputError, match="shape"):
        native.step(np.zeros((COUNT, 3), np.float32))
    with pytest.raises(InputError, match="not finite"):
        native.step(np.full((COUNT, 2), np.nan, np.float32))


def test_gymnasium_vector_wrappers_work():
    wrapped = gymnasium.wrappers.vector.RecordEpisodeStatistics(make_native(max_episode_steps=4))
    wrapped = gymnasium.wrappers.vector.NormalizeObservation(wrapped)
    wrapped.reset(seed=0)
    seen = []
    for _ in range(12):
        *_, info = wrapped.step(np.zeros((COUNT, 2), np.float32))
        seen += info["episode"]["l"][info["_episode"]].tolist() if "episode" in info else []
    assert seen
    assert set(seen) == {4}
