"""An address of a cluster at which nothing listens is refused at once."""

from __future__ import annotations

import socket
import sys
import time
from importlib import import_module
from types import ModuleType

import pytest

from ddagr_gym.errors import InputError

ENGINE = "ddagr_gym.tasks.engine_ray"


@pytest.fixture
def engine(monkeypatch):
    """Module of the engine, whose Ray is one that must not be asked."""
    ray = ModuleType("ray")
    ray.init = lambda **_: pytest.fail("Ray was asked")
    monkeypatch.setitem(sys.modules, "ray", ray)
    before = sys.modules.pop(ENGINE, None)
    yield import_module(ENGINE)
    del sys.modules[ENGINE]
    if before is not None:
        sys.modules[ENGINE] = before


def closed_port() -> int:
    """A port of this machine at which nothing listens."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return int(taken.getsockname()[1])


@pytest.mark.parametrize("form", ["ray://127.0.0.1:{}", "127.0.0.1:{}"])
def test_a_closed_port_is_refused_in_one_sentence(engine, form):
    address, began = form.format(closed_port()), time.monotonic()
    with pytest.raises(InputError, match=rf"^no Ray cluster answers at '{address}' \([^(]*refused\): start"):
        engine.connect(address, 1)
    assert time.monotonic() - began < 5.0


@pytest.mark.parametrize("form", ["ray://127.0.0.1:{}", "127.0.0.1:{}", "[::1]:{}"])
def test_what_listens_is_left_to_ray(engine, form):
    kind, host = (socket.AF_INET6, "::1") if "[" in form else (socket.AF_INET, "127.0.0.1")
    with socket.socket(kind) as server:
        try:
            server.bind((host, 0))
        except OSError:
            pytest.skip(f"this machine has no {host}")
        server.listen()
        engine.check_listens(form.format(server.getsockname()[1]))


def test_an_address_that_ray_looks_up_is_left_to_it(engine):
    engine.check_listens("auto")


@pytest.mark.parametrize("address", ["ray://head", "ray://head:ten", "head:70000", "ray://[head:1"])
def test_a_missing_port_is_named(engine, address):
    with pytest.raises(InputError) as told:
        engine.connect(address, 1)
    assert str(told.value).startswith(f"the cluster '{address}' has no port: give host and port")
