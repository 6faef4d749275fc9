"""Workers of a Ray cluster."""

from __future__ import annotations

import hashlib
import logging
import os
import pickle
import signal
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import ray

from ddagr_gym.errors import InputError
from ddagr_gym.tasks.attempt import attempt
from ddagr_gym.tasks.shared import Handle, SharedPath, content_of, pickled, remembered
from ddagr_gym.tasks.task import Failure, Limits, Outcome, Task

LOCAL = "local"
"""Address of a cluster that is started on this machine, and ended with the command."""

ASK_AGAIN = 5.0
"""Time between looks at how many processors a cluster has [s] (ours): each is a question to its head."""

PATIENCE = 5.0
"""Longest wait for a connection to a cluster [s] (ours): Ray itself waits minutes for one that is not there."""


@dataclass(frozen=True)
class SharedObject(Handle):
    """A pickled value in Ray's object store, which sends it once to each node."""

    digest: str
    reference: Any

    def content(self) -> Any:
        """The value, loaded once a worker."""
        return remembered(self.digest, lambda: pickle.loads(ray.get(self.reference)))


class RayCluster:
    """Tasks on a cluster, one on each of its processors.

    Args:
        address: of the cluster, or "local".
        workers: processors of a local cluster; one with an address has its own.
        limits: of a task.
        fresh: whether every task has a process of its own.

    Raises:
        InputError: no cluster answers at the address.
    """

    def __init__(self, address: str, workers: int, limits: Limits, fresh: bool = False) -> None:
        self._limits = limits
        connect(address, workers)
        options = {"num_cpus": 1, "max_retries": 0, "max_calls": 1 if fresh else 0}
        self._remote = ray.remote(**options)(_attempt)
        self._running: dict[Any, tuple[int, float]] = {}
        self._code = code_hash()
        self._slots, self._ask = 1, 0.0

    @property
    def slots(self) -> int:
        """Processors of the cluster, asked for again every :data:`ASK_AGAIN` seconds: nodes come and go."""
        if time.monotonic() >= self._ask:
            self._slots = max(int(ray.cluster_resources().get("CPU", 1)), 1)
            self._ask = time.monotonic() + ASK_AGAIN
        return self._slots

    def begin(self, number: int, task: Task) -> None:
        """Send a task."""
        sent = (task.function, task.arguments, self._limits, self._code)
        self._running[self._remote.remote(*sent)] = (number, time.monotonic())

    def ended(self, seconds: float) -> list[tuple[int, Outcome]]:
        """What has ended."""
        ready, others = ray.wait(list(self._running), timeout=seconds)
        if ready and others:
            ready += ray.wait(others, num_returns=len(others), timeout=0)[0]
        found = []
        for reference in ready:
            number, began = self._running.pop(reference)
            found.append((number, self._outcome(reference, time.monotonic() - began)))
        return found

    def _outcome(self, reference: Any, seconds: float) -> Outcome:
        limit = self._limits.seconds
        try:
            outcome: Outcome = ray.get(reference)
            return outcome
        except ray.exceptions.RayTaskError as error:
            # what cannot be sent back
            return Outcome(failure=Failure("raised", str(error.cause)))
        except ray.exceptions.RayError as error:
            if limit is not None and seconds >= limit:
                return Outcome(failure=Failure("over its time", f"limit of {limit:g} s"))
            return Outcome(failure=Failure("lost", f"{type(error).__name__}"))

    def share(self, value: Any) -> SharedObject:
        """Handle of a value in the object store."""
        digest, data = pickled(value)
        return SharedObject(digest, ray.put(data))

    def share_file(self, path: Path) -> SharedPath:
        """Handle of a file or folder whose content is in the object store."""
        content = content_of(path)
        return SharedPath(pickled(content)[0], str(path), partial(ray.get, ray.put(content)))

    def close(self) -> None:
        """Leave the cluster."""
        ray.shutdown()

    def stop(self) -> None:
        """End the tasks, and leave the cluster."""
        for reference in self._running:
            ray.cancel(reference, force=True)
        ray.shutdown()


def connect(address: str, workers: int) -> None:
    """Join a cluster, or start one of so many processors here.

    Args:
        address: of the cluster, or "local".
        workers: processors of a local cluster.

    Raises:
        InputError: no cluster answers at the address.
    """
    if address != LOCAL:
        check_listens(address)
    quiet: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.FATAL}
    try:
        if address == LOCAL:
            # nothing about its use goes to its makers
            os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
            ray.init(address=LOCAL, num_cpus=workers, include_dashboard=False, **quiet)
        else:
            ray.init(address=address, **quiet)
    except (ConnectionError, ValueError, RuntimeError) as error:
        raise _no_cluster(address, error) from None


def check_listens(address: str) -> None:
    """Refuse an address at which nothing listens; one without host and port, as "auto", is left to Ray.

    Args:
        address: of a cluster, host:port or ray://host:port.

    Raises:
        InputError: nothing listens there, or the port is missing or none.
    """
    try:
        parts = urlsplit(address if "://" in address else f"//{address}")
        host, port = parts.hostname, parts.port
    except ValueError:
        raise _without_port(address) from None
    if port is None and parts.scheme:
        raise _without_port(address)
    if not host or port is None:
        return
    try:
        socket.create_connection((host, port), PATIENCE).close()
    except OSError as error:
        raise _no_cluster(address, error) from None


def _no_cluster(address: str, error: Exception) -> InputError:
    return InputError(
        f"no Ray cluster answers at {address!r} ({error}): start one with ray start, or give --cluster local."
    )


def _without_port(address: str) -> InputError:
    return InputError(f"the cluster {address!r} has no port: give host and port, such as ray://head:10001.")


def _attempt(function: Callable[..., Any], arguments: tuple[Any, ...], limits: Limits, code: str) -> Outcome:
    """One task on a node, which must have the driver's code; a worker that exceeds its time is ended."""
    try:
        check_code(code)
    except InputError as error:
        return Outcome(failure=Failure("raised", str(error), bad_input=True))
    # The default action of the signal: Python's would wait for a compiled function to return.
    signal.setitimer(signal.ITIMER_REAL, limits.seconds or 0.0)
    try:
        return attempt(function, arguments, limits.memory)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def check_code(code: str) -> None:
    """Refuse a driver whose package is not that of this node.

    Args:
        code: the driver's :func:`code_hash`.

    Raises:
        InputError: it is another one.
    """
    if code_hash() != code:
        raise InputError(
            f"the node {os.uname().nodename} has another ddagr_gym: install the same version on every node."
        )


@cache
def code_hash() -> str:
    """SHA-256 over the modules of this package."""
    package = Path(__file__).resolve().parents[1]
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()
