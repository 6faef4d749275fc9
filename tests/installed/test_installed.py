"""What a user of the installed wheel gets; run by `ddagr test` outside the checkout, with core dependencies only."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import ddagr_gym
from ddagr_gym.commands import CHECKOUT_TOOLS
from ddagr_gym.config import configs_dir

ENVIRONMENT = Path(sys.prefix).resolve()
DDAGR = Path(sys.prefix) / "bin" / "ddagr"

DRIVE = """
import hashlib
import numpy as np
from ddagr_gym.presets import get_robot, get_soil
from ddagr_gym.simulator import simulate

commands = np.repeat([(0.7, 0.7), (0.9, 0.3), (0.0, 0.0), (-0.5, 0.5)], 50, axis=0)
for effects in ((), ("towed_drag=60,rope=0.5",), ("motor_lag=0.1,second_pole=0.5",), ("lateral_bulldozing=2",)):
    columns = simulate(get_robot("ddagr"), get_soil("thesis_a1"), commands, effects=effects, seed=1)
    data = b"".join(np.ascontiguousarray(values, dtype=float).tobytes() for values in columns.values())
    print(effects, hashlib.sha256(data).hexdigest())
"""


def run(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(DDAGR), *words], capture_output=True, text=True, stdin=subprocess.DEVNULL)


def test_package_comes_from_the_wheel():
    assert Path(ddagr_gym.__file__).resolve().is_relative_to(ENVIRONMENT)
    assert importlib.metadata.version("ddagr-gym") == ddagr_gym.__version__


def test_configurations_are_in_the_package():
    assert configs_dir() == Path(ddagr_gym.__file__).resolve().parent / "configs"
    assert (configs_dir() / "robots").is_dir()


def test_no_optional_package_is_there():
    names = {distribution.metadata["Name"].lower() for distribution in importlib.metadata.distributions()}
    assert not names & {"torch", "matplotlib", "pyarrow", "pygame-ce", "stable-baselines3"}


def test_console_script():
    done = run("--version")
    assert (done.returncode, done.stdout.strip()) == (0, f"ddagr-gym {ddagr_gym.__version__}")


def test_every_command_shows_its_help():
    from ddagr_gym.commands import NAMES

    for name in NAMES:
        done = run(name, "--help")
        assert done.returncode == 0, done.stderr.splitlines()[-1:]
        assert "Examples:" in done.stdout


def test_soils_are_listed():
    done = run("soils")
    assert done.returncode == 0, done.stderr.splitlines()[-1:]
    assert "thesis_a1" in done.stdout


def test_the_process_that_compiles_gives_the_bits_of_those_that_load():
    """A kernel on its own and its copy inside a larger one differ in the last bits: only one of them may ever run.

    Nothing was compiled in this environment before.
    """
    words = [sys.executable, "-c", DRIVE]
    first, second = (subprocess.run(words, capture_output=True, text=True, check=True).stdout for _ in range(2))
    assert first.count("\n") == 4
    assert first == second


def test_an_episode_runs():
    environment = gymnasium.make("DDAGR-Turn-v0")
    observation, _ = environment.reset(seed=1)
    assert observation in environment.observation_space
    for _ in range(5):
        observation, reward, *_ = environment.step(np.array([0.5, 0.8], dtype=np.float32))
        assert observation in environment.observation_space
        assert np.isfinite(reward)
    environment.close()


def test_data_and_types_are_in_the_package():
    package = Path(ddagr_gym.__file__).resolve().parent
    names = ("py.typed", "data/null_bank_ddagr.json", "data/replay_demo.parquet", "configs/evaluation/thesis_runs.yaml")
    assert [name for name in names if not (package / name).is_file()] == []


def test_the_python_functions_work():
    drive = ddagr_gym.simulate("arcs", effects="slope=0.05", rate=50.0, pose_rate=5.0)
    assert ddagr_gym.check(drive).findings
    estimated = ddagr_gym.estimate(drive)
    assert abs(estimated.errors["radius_error"]) < 0.2
    assert "<table" in estimated._repr_html_()


def test_learned_estimators_run_without_torch():
    from ddagr_gym.estimation import estimator_names

    assert estimator_names() == ("alone", "correction", "features", "pose", "pose_wide")
    environment = gymnasium.make("DDAGR-Turn-EKF-v0", filter="learned")
    environment.reset(seed=1)
    for command in (*[0.0] * 5, *[0.6] * 40):  # it stands first: that shows the filter beside it how the ground slopes
        observation, *_ = environment.step(np.full(2, command, dtype=np.float32))
    assert observation[12] > 0.1  # the estimated speed: it drives
    environment.close()


def test_trained_policies_drive_without_torch():
    from ddagr_gym.policies.controller import policy_controller
    from ddagr_gym.policies.shipped import policies_dir, policy_names

    assert policies_dir() == Path(ddagr_gym.__file__).resolve().parent / "data" / "policies"
    assert "ppo_ekf" in policy_names()
    environment = gymnasium.make("DDAGR-Turn-EKF-v0")
    observation, _ = environment.reset(seed=1)
    controller = policy_controller("ppo_ekf")
    controller.reset()
    for _ in range(40):
        observation, *_ = environment.step(controller(observation))
    assert observation[3] > 0.1  # the encoders: it drives
    environment.close()


def test_training_needs_a_checkout():
    done = run("train", "ppo")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "clone" in done.stderr


@pytest.mark.parametrize("make", ["make", "make_vec"])
def test_the_id_with_its_module_needs_no_import(make):
    program = f"import gymnasium; gymnasium.{make}('ddagr_gym:DDAGR-Turn-v0').close()"
    done = subprocess.run([sys.executable, "-P", "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr.splitlines()[-1:]


@pytest.mark.parametrize("name", CHECKOUT_TOOLS)
def test_tools_of_the_checkout_say_where_they_are(name):
    done = run(name)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "checkout" in done.stderr
    assert importlib.util.find_spec("tools") is None
