"""Tasks on every engine: results, failures, lost workers, limits, and what is stored."""

from __future__ import annotations

import errno
import json
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np
import pytest

from ddagr_gym.errors import InputError
from ddagr_gym.tasks import FailedTasksError, Limits, ResultStore, Task, TaskRunner, release, run_tasks
from ddagr_gym.tasks.runner import STOPPED
from ddagr_gym.tasks.shared import SharedPath, content_of
from tests.needs_ray import NEEDS_RAY
from tests.tasks import work

RAY = pytest.param(
    (2, "cluster"),
    id="ray",
    marks=[
        pytest.mark.ray,
        pytest.mark.slow,
        NEEDS_RAY,
    ],
)
ENGINES = [pytest.param((1, ""), id="this process"), pytest.param((2, ""), id="two processes"), RAY]
SEEDS = [Task(f"seed {k}", work.numbers, (k,)) for k in range(6)]
PROCESSES = [pytest.param((2, ""), id="two processes"), RAY]


@pytest.fixture(scope="module")
def cluster():
    """Address of a cluster of two processors on this machine, started when a test asks for it."""
    started = []

    def address():
        if not started:
            from ray.cluster_utils import Cluster

            started.append(Cluster(initialize_head=True, head_node_args={"num_cpus": 2, "include_dashboard": False}))
        return started[0].address

    yield address
    for made in started:
        made.shutdown()


@pytest.fixture
def runner(cluster):
    """Runner on an engine (workers, kind)."""

    def make(engine, **options):
        return TaskRunner(engine[0], cluster=cluster() if engine[1] else "", **options)

    return make


@pytest.mark.parametrize("engine", [*ENGINES[1:], pytest.param((3, ""), id="three processes")])
def test_same_bits_on_every_engine(runner, engine):
    with runner(engine) as made:
        found = run_tasks(SEEDS, "solving", made)
    with TaskRunner(1) as made:
        assert found == run_tasks(SEEDS, "solving", made)


@pytest.mark.parametrize("engine", ENGINES)
def test_what_tasks_share_is_sent_by_content(runner, engine, tmp_path):
    values, file = np.arange(1000.0), tmp_path / "map.yaml"
    file.write_text("columns")
    with runner(engine) as made:
        shared, path, folder = made.share(values), made.share_file(file), made.share_file(tmp_path)
        tasks = [Task(f"{n}", work.mean_of, (shared, n)) for n in range(4)] + [Task("file", work.text_of, (path,))]
        tasks += [Task(f"folder {n}", work.texts_of, (folder,)) for n in range(2)]
        expected = [float(values[n:].mean()) for n in range(4)] + ["columns"] + 2 * [{"map.yaml": "columns"}]
        assert run_tasks(tasks, "means", made) == expected


@pytest.mark.parametrize("folder", [False, True])
def test_what_a_node_got_is_written_once_and_released(tmp_path, monkeypatch, folder):
    """Another node has nothing at the driver's path."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "node"))
    fetched = []

    def fetch():
        fetched.append(1)
        return {"a.db3": b"one", "metadata.yaml": b"two"} if folder else b"one"

    handle = SharedPath("digest", "/driver/drive.csv", fetch)
    place = handle.content()
    assert (place.name, handle.content(), len(fetched)) == ("drive.csv", place, 1)
    assert content_of(place) == fetch()
    release(place)
    assert not place.exists()
    assert list(place.parent.parent.iterdir()) == []
    own = tmp_path / "own.csv"
    own.write_text("kept")
    release(own)
    assert own.exists()


@pytest.mark.parametrize("engine", ENGINES)
def test_a_task_that_raises_is_named_and_the_others_end(runner, engine, tmp_path):
    store = ResultStore(tmp_path)
    tasks = [Task(f"case {n}", work.raises, (n,), key=f"raises_{n}") for n in range(5)]
    with runner(engine) as made, pytest.raises(FailedTasksError) as caught:
        run_tasks(tasks, "cases", made, store)
    message = str(caught.value)
    assert message == "1 of 5 tasks failed: case 2: raised (ZeroDivisionError: a wheel of radius 0)"
    assert "work.py" in caught.value.__notes__[0]
    assert [store.has(f"raises_{n}") for n in range(5)] == [True, True, False, True, True]


@pytest.mark.parametrize("engine", ENGINES)
def test_bad_input_stays_a_sentence(runner, engine):
    with runner(engine) as made, pytest.raises(InputError, match=r"^drive: drive 7 has no clock: give one\.$"):
        run_tasks([Task("drive", work.refuses, (7,))], "drives", made)


@pytest.mark.parametrize("engine", PROCESSES)
def test_a_lost_worker_costs_nothing_but_time(runner, engine, tmp_path):
    with runner(engine) as made:
        tasks = [Task(f"case {n}", work.dies_once, (str(tmp_path), n)) for n in range(10)]
        assert run_tasks(tasks, "cases", made) == list(range(10))
    assert (tmp_path / "died").exists()


@pytest.mark.parametrize("engine", PROCESSES)
def test_a_task_that_always_loses_its_worker_is_named(runner, engine):
    with runner(engine, limits=Limits(attempts=2)) as made:
        ended = {item.task.name: item for item in made.run([Task(f"case {n}", work.dies, (n,)) for n in range(5)])}
    assert ended["case 1"].failure.kind == "lost"
    assert ended["case 1"].failure.message.endswith("2 times")
    assert [ended[f"case {n}"].value for n in (0, 2, 3, 4)] == [0, 2, 3, 4]


@pytest.mark.parametrize("engine", PROCESSES)
def test_a_task_over_its_time_is_stopped(runner, engine):
    began = time.monotonic()
    with runner(engine, limits=Limits(seconds=10.0)) as made:
        ended = {
            item.task.name: item for item in made.run([Task(f"{s}", work.sleeps, (s,)) for s in (600.0, 0.1, 0.2)])
        }
    assert time.monotonic() - began < 120.0
    assert (ended["600.0"].failure.kind, ended["600.0"].failure.message) == ("over its time", "limit of 10 s")
    assert (ended["0.1"].value, ended["0.2"].value) == (0.1, 0.2)


@pytest.mark.skipif(sys.platform != "linux", reason="the limit of memory needs Linux")
@pytest.mark.parametrize("engine", PROCESSES)
def test_a_task_over_its_memory_is_stopped(runner, engine):
    with runner(engine, limits=Limits(memory=2**30)) as made:
        ended = {item.task.name: item for item in made.run([Task(f"{m}", work.takes_memory, (m,)) for m in (1500, 4)])}
    assert (ended["1500"].failure.kind, ended["1500"].failure.message) == ("over its memory", "limit of 1024 MiB")
    assert ended["4"].value == 4 * 2**17


@pytest.mark.parametrize("engine", PROCESSES)
def test_a_result_that_cannot_be_sent_is_a_failure(runner, engine):
    with runner(engine) as made:
        first, second = made.run([Task("odd", work.unpicklable), Task("plain", work.raises, (1,))])
    failures = {item.task.name: item.failure for item in (first, second)}
    assert failures["plain"] is None
    assert failures["odd"].kind == "raised"


def test_a_function_without_a_name_is_refused():
    with TaskRunner(2) as made, pytest.raises((AttributeError, pickle.PicklingError)):
        next(made.run([Task("nameless", lambda: 0)]))


@pytest.mark.parametrize("engine", PROCESSES)
def test_a_process_of_its_own_for_every_task(runner, engine):
    with runner(engine, fresh=True) as made:
        processes = run_tasks([Task(f"{n}", work.process) for n in range(4)], "processes", made)
    assert len({*processes, os.getpid()}) == 5


def test_finished_tasks_are_not_run_again(tmp_path):
    store, folder = ResultStore(tmp_path / "store"), tmp_path / "driven"
    folder.mkdir()
    tasks = [Task(f"{n}", work.sleeps_and_marks, (str(folder), n, 0.0), key=f"drive_{n}") for n in range(4)]
    with TaskRunner(1) as made:
        assert [item.stored for item in made.run(tasks[:2], store)] == [False, False]
        ended = list(made.run(tasks, store))
    assert sorted((item.task.name, item.stored) for item in ended) == [
        ("0", True), ("1", True), ("2", False), ("3", False)
    ]  # fmt: skip
    assert [(folder / f"{n}.txt").read_text() for n in range(4)] == ["driven\n"] * 4


@pytest.mark.parametrize("left", ["", '{"half": ', "[" * 100_000, "\0" * 40])
def test_a_task_whose_result_is_damaged_is_done_again(left, tmp_path):
    store, tasks = ResultStore(tmp_path), [Task(f"{n}", work.raises, (0,), key=f"case_{n}") for n in range(2)]
    with TaskRunner(1) as made:
        whole = run_tasks(tasks, "cases", made, store)
        store.path("case_1").write_text(left)
        assert (store.has("case_0"), store.has("case_1"), store.has("case_2")) == (True, False, False)
        with pytest.raises(InputError, match=r"cannot be read as a result .*: delete it"):
            store.get("case_1")
        ended = list(made.run(tasks, store))
    assert sorted((item.task.name, item.stored, item.value) for item in ended) == [
        ("0", True, whole[0]), ("1", False, whole[1])
    ]  # fmt: skip
    assert store.get("case_1") == whole[1]


def test_a_stored_result_is_read_once(tmp_path, monkeypatch):
    store, tasks, reads = ResultStore(tmp_path), [Task("0", work.raises, (0,), key="case_0")], []
    with TaskRunner(1) as made:
        run_tasks(tasks, "cases", made, store)
        get = ResultStore.get
        monkeypatch.setattr(ResultStore, "get", lambda self, key: reads.append(key) or get(self, key))
        assert [item.stored for item in made.run(tasks, store)] == [True]
    assert reads == ["case_0"]


def test_a_full_disk_ends_the_run_and_loses_nothing(tmp_path, monkeypatch):
    store, put = ResultStore(tmp_path), ResultStore.put

    def full(self, key, value):
        if len(list(tmp_path.iterdir())) == 3:
            raise OSError(errno.ENOSPC, "No space left on device")
        return put(self, key, value)

    tasks = [Task(f"{n}", work.raises, (0,), key=f"case_{n}") for n in range(8)]
    monkeypatch.setattr(ResultStore, "put", full)
    with pytest.raises(OSError, match="No space"), TaskRunner(2) as made:
        run_tasks(tasks, "cases", made, store)
    monkeypatch.setattr(ResultStore, "put", put)
    with TaskRunner(2) as made:
        assert [item.stored for item in made.run(tasks, store)].count(True) == 3


def test_many_tasks_are_taken_as_workers_get_free():
    taken = []

    def tasks():
        for n in range(1000):
            taken.append(n)
            yield Task(f"{n}", work.raises, (0,))

    with TaskRunner(1) as made:
        next(made.run(tasks()))
    assert len(taken) < 10


def test_a_limit_that_makes_no_sense_is_refused():
    for options in ({"seconds": 0.0}, {"memory": 0}, {"attempts": 0}):
        with pytest.raises(InputError, match="give"):
            Limits(**options)
    with pytest.raises(InputError, match="workers is 0: give at least 1"):
        TaskRunner(0)


def test_a_key_names_a_file(tmp_path):
    with pytest.raises(ValueError, match="letters"):
        ResultStore(tmp_path).has("../elsewhere")


def test_sigterm_is_answered_as_before_after_the_block():
    before = signal.getsignal(signal.SIGTERM)
    with TaskRunner(1):
        assert signal.getsignal(signal.SIGTERM) is not before
    assert signal.getsignal(signal.SIGTERM) is before


SCRIPT = """
import json, os, signal, sys
from pathlib import Path
from ddagr_gym.tasks import ResultStore, Task, TaskRunner, run_tasks
from tests.tasks.work import sleeps_and_marks

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a parent in the background ignores it
    folder, cluster, seconds = Path(sys.argv[1]), sys.argv[2], float(sys.argv[3])
    (folder / "driven").mkdir(exist_ok=True)
    tasks = [Task(f"{n}", sleeps_and_marks, (str(folder / "driven"), n, seconds), key=f"drive_{n}") for n in range(8)]
    with TaskRunner(2, cluster=cluster) as runner:
        print(json.dumps(run_tasks(tasks, "drives", runner, ResultStore(folder / "store"))))
"""


def test_a_script_without_a_guard_ends_in_one_sentence(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "from ddagr_gym.tasks import Task, TaskRunner, run_tasks\n"
        "with TaskRunner(2) as runner:\n"
        "    run_tasks([Task(str(n), abs, (n,)) for n in range(3)], 'numbers', runner)\n"
    )
    ended = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=False)
    assert ended.returncode != 0
    assert ended.stderr.count("Traceback") == 1  # of the script itself, none of its workers
    assert 'put the work below `if __name__ == "__main__":`' in ended.stderr.splitlines()[-1]


def alive(pid: int) -> bool:
    """Whether a process runs; one that has ended and that nobody has waited for does not."""
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rsplit(")", 1)[1].split()[0] not in ("Z", "X")
    except OSError:
        return False


def children_of(pid: int) -> list[int]:
    found = subprocess.run(["ps", "-o", "pid=", "--ppid", str(pid)], capture_output=True, text=True, check=False)
    return [int(word) for word in found.stdout.split() if alive(int(word))]


def wait_until(condition, seconds):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    return condition()


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="looks at processes in /proc")
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGTERM, STOPPED), (signal.SIGKILL, -signal.SIGKILL), (signal.SIGINT, None)]
)
@pytest.mark.parametrize("engine", PROCESSES)
def test_an_interrupted_run_leaves_no_worker_and_goes_on(tmp_path, engine, number, code):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    words = [sys.executable, str(script), str(tmp_path), "local" if engine[1] else ""]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([os.getcwd(), *sys.path])}
    parent = subprocess.Popen(
        [*words, "1.0"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True, env=environment
    )
    finished = tmp_path / "store"
    try:
        assert wait_until(lambda: finished.is_dir() and len(list(finished.glob("drive_*.json"))) >= 2, 90.0)
        workers = children_of(parent.pid)
        assert workers
        # An interrupt of the terminal goes to the whole group.
        (os.killpg if number == signal.SIGINT else os.kill)(parent.pid, number)
        ended = parent.wait(timeout=30.0)
        assert ended == code if code is not None else ended != 0
        assert wait_until(lambda: not any(alive(pid) for pid in workers), 10.0)
    finally:
        parent.kill()
    kept = {path.name for path in finished.glob("drive_*.json")}
    assert 2 <= len(kept) < 8
    again = subprocess.run([*words, "0.0"], capture_output=True, text=True, check=True, env=environment)
    assert json.loads(again.stdout) == list(range(8))
    driven = {int(path.stem): path.read_text().count("driven") for path in (tmp_path / "driven").iterdir()}
    # nothing finished is done again; what was in flight may have ended unseen
    assert all(driven[int(name[6:-5])] == 1 for name in kept)
