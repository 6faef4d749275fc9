"""Workers end with the process that started them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

from ddagr_gym.evaluation.worker_pool import STOPPED, worker_pool

SCRIPT = """
import os, signal, sys, time
from concurrent.futures import as_completed
from ddagr_gym.evaluation.worker_pool import worker_pool

def work(folder):
    open(os.path.join(folder, str(os.getpid())), "w").close()
    time.sleep(120)

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a parent in the background ignores it
    with worker_pool(2) as pool:
        for future in as_completed([pool.submit(work, sys.argv[1]) for _ in range(4)]):
            future.result()
"""


def alive(pid: int) -> bool:
    """Whether a process runs; one that has ended and that nobody has waited for does not."""
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rsplit(")", 1)[1].split()[0] not in ("Z", "X")
    except OSError:
        return False


def wait_until(condition, seconds):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    return condition()


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="looks at processes in /proc")
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGTERM, STOPPED), (signal.SIGKILL, -signal.SIGKILL), (signal.SIGINT, None)]
)
def test_no_worker_outlives_its_parent(tmp_path, number, code):
    script, folder = tmp_path / "script.py", tmp_path / "pids"
    script.write_text(SCRIPT)
    folder.mkdir()
    parent = subprocess.Popen(
        [sys.executable, str(script), str(folder)], stderr=subprocess.DEVNULL, start_new_session=True
    )
    try:
        assert wait_until(lambda: len(list(folder.iterdir())) == 2, 60.0)
        workers = [int(path.name) for path in folder.iterdir()]
        # An interrupt of the terminal goes to the whole group.
        (os.killpg if number == signal.SIGINT else os.kill)(parent.pid, number)
        ended = parent.wait(timeout=30.0)
        assert ended == code if code is not None else ended != 0
        assert wait_until(lambda: not any(alive(pid) for pid in workers), 10.0)
    finally:
        parent.kill()


def test_results_come_as_from_any_pool():
    before = signal.getsignal(signal.SIGTERM)
    with worker_pool(1) as pool:
        assert list(pool.map(abs, [-1, 2])) == [1, 2]
    assert signal.getsignal(signal.SIGTERM) is before
