"""``./ddagr``: when it sets up, with what, and what it leaves behind. pip is played by a script, all else is real."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

# Behaves as FAKE_PIP says and writes down how it was called; an editable install puts a package into the environment.
FAKE_PYTHON = r"""#!/bin/sh
if [ "$1 $2" != "-m pip" ]; then
    exec "$REAL_PYTHON" "$@"
fi
shift 2
if [ "$1" = --python ]; then
    environment=${2%/bin/python}
    shift 2
fi
[ "$1" = --version ] && exit
log=$3
say() { echo "2026-01-01T00:00:00,000 $*" >>"$log"; }
shift 3
echo "install $*" >>"$PIP_CALLS"
say "  Installing collected packages: hatchling"
case $FAKE_PIP in
    no-network)
        say "WARNING: Retrying: NewConnectionError: Temporary failure in name resolution"
        say "ERROR: No matching distribution found for numpy"
        exit 1 ;;
    no-torch)
        case "$*" in
            *download.pytorch.org* | *-e*) ;;
            *) say "ERROR: No matching distribution found for torch"; exit 1 ;;
        esac ;;
    hangs)
        say "Installing collected packages: numpy"
        trap 'say "ERROR: Operation cancelled by user"; exit 1' INT
        : >"$PIP_CALLS.hanging"
        while :; do sleep 0.1; done ;;
    slow) sleep 1 ;;
esac
say "Installing collected packages: ddagr-gym"
case "$*" in *"-e ."*)
    set -- "$environment"/lib/python*/site-packages
    mkdir -p "$1/ddagr_gym"
    cat >"$1/ddagr_gym/__main__.py" <<'END' ;;
import os, sys
print(os.getcwd(), sys.argv[1:], *["without bytecode"] * sys.dont_write_bytecode, os.environ.get("OMP_NUM_THREADS"))
END
esac
"""


class Checkout:
    """A checkout with only what the script reads, started with a pip that the test controls."""

    def __init__(self, repository: Path, folder: Path) -> None:
        self.root = folder / "a check out"
        self.root.mkdir()
        shutil.copy(repository / "ddagr", self.root)
        (self.root / "pyproject.toml").write_text("# project\n")
        tools = self.root / "tools"
        tools.mkdir()
        (tools / "__main__.py").write_text("import sys\nprint('tool', sys.argv[1:])\n")
        (self.root / "constraints.txt").write_text("# constraints\n")
        self.bin = folder / "bin"
        self.bin.mkdir()
        python = self.bin / "python3"
        python.write_text(FAKE_PYTHON)
        python.chmod(0o755)
        self.calls_file = folder / "pip-calls"
        self.cwd = folder

    def environment(self, pip: str = "works", **variables: str) -> dict[str, str]:
        real = os.path.realpath(sys.executable)
        path = f"{self.bin}:/usr/bin:/bin"
        return {"PATH": path, "REAL_PYTHON": real, "PIP_CALLS": str(self.calls_file), "FAKE_PIP": pip, **variables}

    def run(self, *words: str, pip: str = "works", **variables: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [str(self.root / "ddagr"), *words],
            cwd=self.cwd,
            env=self.environment(pip, **variables),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
        )

    def calls(self) -> list[str]:
        """What pip was called with since the last question."""
        lines = self.calls_file.read_text().splitlines() if self.calls_file.exists() else []
        self.calls_file.unlink(missing_ok=True)
        return lines


@pytest.fixture
def checkout(repository, tmp_path) -> Checkout:
    return Checkout(repository, tmp_path)


def extras(calls: list[str]) -> set[str]:
    (call,) = (call for call in calls if "-e" in call.split())
    return set(call.partition("[")[2].rstrip("]").split(",")) - {""}


def test_first_start_sets_up_and_passes_everything_on(checkout):
    done = checkout.run("soils", "a b", "--x=é")
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{checkout.cwd} ['soils', 'a b', '--x=é'] 1\n"
    (call,) = checkout.calls()
    assert call.split()[:2] == ["install", "--no-compile"]
    assert "-c constraints.txt -e ." in call


def test_second_start_is_fast_and_calls_no_pip(checkout):
    checkout.run("demo")
    checkout.calls()
    seconds = []
    for _ in range(5):
        start = time.monotonic()
        done = checkout.run("demo", pip="no-network")
        seconds.append(time.monotonic() - start)
        assert (done.returncode, done.stderr) == (0, "")
    # The fastest of five: another process may hold the processor for a moment.
    assert min(seconds) < 0.3
    assert checkout.calls() == []


def test_threads_are_the_users_when_set(checkout):
    assert checkout.run(OMP_NUM_THREADS="3").stdout.endswith(" 3\n")


def test_what_python_compiles_is_kept(checkout):
    done = checkout.run(PYTHONDONTWRITEBYTECODE="1")
    assert (done.returncode, "without bytecode" in done.stdout) == (0, False), done.stderr


def test_tools_come_from_the_checkout_whatever_the_path_says(checkout):
    done = checkout.run("test", "--only", "types", PYTHONPATH="/nowhere")
    assert (done.returncode, done.stdout) == (0, "tool ['test', '--only', 'types']\n"), done.stderr


def test_extras_follow_the_command_and_add_up(checkout):
    checkout.run("--help")
    assert extras(checkout.calls()) == set()
    checkout.run("simulate")
    assert extras(checkout.calls()) == {"io", "report", "render"}
    checkout.run("test")
    assert {"io", "report", "render", "rl", "dev"} <= extras(checkout.calls())
    for command in ("soils", "simulate", "train", "test"):
        assert checkout.run(command).returncode == 0
    assert checkout.calls() == []


@pytest.mark.parametrize(
    ("words", "more"),
    [
        (["--cluster", "local"], {"cluster"}),
        (["--cluster=ray://a b:10001", "--rrd", "x"], {"cluster", "rerun"}),
        (["--rrd=a b.rrd"], {"rerun"}),
        (["--output", "cluster", "--clusters", "a --cluster b"], set()),
    ],
)
def test_extras_follow_the_options_too(checkout, words, more):
    done = checkout.run("diagnose", *words)
    assert done.stdout == f"{checkout.cwd} {['diagnose', *words]} 1\n", done.stderr
    assert extras(checkout.calls()) == {"io", "report", "diagnosis", "foxglove"} | more


@pytest.mark.parametrize("file", ["pyproject.toml", "constraints.txt"])
def test_a_changed_project_file_is_installed_anew(checkout, file):
    checkout.run("simulate")
    checkout.calls()
    (checkout.root / file).write_text("# changed\n")
    checkout.run("soils")
    assert extras(checkout.calls()) == {"io", "report", "render"}


def test_torch_comes_from_the_index_without_cuda(checkout):
    assert checkout.run("train", pip="no-torch").returncode == 0
    first, second, third = checkout.calls()
    assert first.endswith("-c constraints.txt torch")
    assert second.endswith("--extra-index-url https://download.pytorch.org/whl/cpu torch")
    assert "-e ." in third


def test_no_network_is_one_clear_sentence(checkout):
    done = checkout.run("soils", pip="no-network")
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.splitlines()[-1].startswith("ddagr: the package index could not be reached")
    assert checkout.run("soils").returncode == 0


def test_a_failed_addition_leaves_what_works(checkout):
    checkout.run("simulate")
    marker = checkout.root / ".venv" / "kept"
    marker.touch()
    done = checkout.run("train", pip="no-network")
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith("ddagr: torch without CUDA could not be had")
    assert checkout.run("simulate", pip="no-network").returncode == 0
    assert checkout.run("train").returncode == 0
    assert marker.exists()


def end_while_pip_works(checkout: Checkout, command: str, number: int) -> tuple[int, str]:
    """Start ``command``, send the signal to the whole group once pip is at work; exit code and standard error."""
    process = subprocess.Popen(
        [str(checkout.root / "ddagr"), command],
        cwd=checkout.cwd,
        env=checkout.environment("hangs"),
        stdin=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # A test run in the background passes an ignored SIGINT on to its children.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    deadline = time.monotonic() + 30
    while not Path(f"{checkout.calls_file}.hanging").exists():
        assert time.monotonic() < deadline
        time.sleep(0.02)
    os.killpg(process.pid, number)
    errors = process.communicate(timeout=30)[1]
    return process.returncode, errors


def test_an_interrupt_ends_the_set_up_at_once(checkout):
    code, errors = end_while_pip_works(checkout, "train", signal.SIGINT)
    # The shell says 130, or ends by the signal itself, which its caller reads as 130.
    assert code in (130, -signal.SIGINT)
    assert errors.splitlines()[-1].startswith("ddagr: set-up interrupted")
    (call,) = checkout.calls()
    assert call.endswith(" torch")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_an_interrupted_installation_is_redone(checkout, number):
    checkout.run("soils")
    (checkout.root / ".venv" / "half").touch()
    assert end_while_pip_works(checkout, "simulate", number)[0] != 0
    done = checkout.run("soils")
    assert done.returncode == 0, done.stderr
    assert "interrupted" in done.stderr
    assert not (checkout.root / ".venv" / "half").exists()


def test_concurrent_first_starts_set_up_once(checkout):
    command = [str(checkout.root / "ddagr"), "simulate"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    starts = [subprocess.Popen(command, cwd=checkout.cwd, env=checkout.environment("slow"), **pipes) for _ in range(4)]
    outputs = [start.communicate(timeout=60) for start in starts]
    assert [start.returncode for start in starts] == [0] * 4, outputs
    assert len(checkout.calls()) == 1
    assert sum("waiting" in errors for _, errors in outputs) == 3


def test_a_moved_checkout_is_set_up_anew(checkout):
    checkout.run("soils")
    checkout.calls()
    checkout.root = checkout.root.rename(checkout.root.with_name("moved"))
    assert checkout.run("soils").returncode == 0
    assert len(checkout.calls()) == 1


def test_a_vanished_interpreter_is_replaced(checkout):
    checkout.run("soils")
    python = checkout.root / ".venv" / "bin" / "python"
    python.unlink()
    python.symlink_to("/nowhere/python3")
    assert checkout.run("soils").returncode == 0


def test_an_environment_of_the_users_own_is_used(checkout):
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(checkout.root / ".venv")], check=True)
    (checkout.root / ".venv" / "own").touch()
    assert checkout.run("soils").returncode == 0
    assert (checkout.root / ".venv" / "own").exists()


def test_something_else_called_venv_is_left_alone(checkout):
    (checkout.root / ".venv").mkdir()
    (checkout.root / ".venv" / "notes").touch()
    done = checkout.run("soils")
    assert done.returncode == 1
    assert "was not made by this script" in done.stderr
    assert (checkout.root / ".venv" / "notes").exists()


def test_it_works_through_a_link(checkout):
    (checkout.cwd / "link").symlink_to(checkout.root / "ddagr")
    (checkout.cwd / "other").symlink_to("link")
    done = subprocess.run(
        [str(checkout.cwd / "other"), "soils"],
        env=checkout.environment(),
        cwd=checkout.cwd,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert (checkout.root / ".venv").is_dir()


def test_foreign_packages_and_the_callers_folder_stay_out(checkout):
    (checkout.cwd / "ddagr_gym.py").write_text("raise SystemExit('shadowed')")
    done = checkout.run("soils", PYTHONPATH=str(checkout.cwd))
    assert done.returncode == 0, done.stderr


def test_no_python_is_one_clear_sentence(checkout):
    tools = checkout.cwd / "tools"
    tools.mkdir()
    for name in ("sh", "cat", "cksum", "dirname", "readlink"):
        (tools / name).symlink_to(shutil.which(name))
    done = subprocess.run(
        [str(checkout.root / "ddagr")], env={"PATH": str(tools)}, cwd=checkout.cwd, capture_output=True, text=True
    )
    assert done.returncode == 1
    assert done.stderr.startswith("ddagr: Python 3.11 or newer was not found")
    assert done.stderr.count("\n") == 1
    assert not (checkout.root / ".venv").exists()


def test_script_is_plain_posix(repository):
    for script in ("ddagr", ".ci/run"):
        assert (repository / script).read_text().startswith("#!/bin/sh\n")
        assert os.access(repository / script, os.X_OK)
        subprocess.run(["/bin/sh", "-n", str(repository / script)], check=True)
