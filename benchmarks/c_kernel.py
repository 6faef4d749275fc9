"""The contact kernel in C, compiled at run time, to hold ours against."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np
from numpy.typing import NDArray

from ddagr_gym.physics.contact_geometry import contact_rule, section_rule
from ddagr_gym.physics.contact_patch import wheel_wrench
from ddagr_gym.physics.wheel_forces import soil_vector, wheel_vector
from ddagr_gym.presets import get_robot, get_soil

Array = NDArray[np.float64]

FLAGS = ("-O3", "-march=native", "-ffast-math", "-fopenmp-simd", "-shared", "-fPIC")


def build(folder: Path) -> ctypes.CDLL | None:
    """The compiled C kernel, or None where there is no C compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        return None
    library = folder / "kernel.so"
    source = Path(__file__).with_name("kernel.c")
    subprocess.run([compiler, *FLAGS, str(source), "-o", str(library), "-lm"], check=True, capture_output=True)
    return ctypes.CDLL(str(library))


def random_states(count: int = 256) -> Array:
    """(count, 5) states v_x, v_y, omega, yaw rate, sinkage of turning wheels."""
    rng = np.random.default_rng(0)
    low, high = np.array([0.05, -0.2, 0.3, -0.5, 0.005]), np.array([0.5, 0.2, 2.0, 0.5, 0.04])
    return low + (high - low) * rng.uniform(size=(count, 5))


@numba.njit(nogil=True)  # type: ignore[untyped-decorator]
def _ours(wheel: Array, soil: Array, states: Array, section: Array, contact: Array, out: Array) -> None:
    for n in range(states.shape[0]):
        s = states[n]
        wheel_wrench(wheel, soil, s[0], s[1], s[2], s[3], s[4], 1e-3, 1e-3, section, contact, out[n])


def kernel_candidates(section_nodes: int, contact_nodes: int) -> tuple[dict[str, Callable[[], object]], int, float]:
    """Ours and C's on the same states: candidates, nodes a call treats, and the largest relative difference."""
    states = random_states()
    wheel, soil = wheel_vector(get_robot("ddagr").wheels[0]), soil_vector(get_soil("thesis_a1"))
    section, contact = section_rule(section_nodes), contact_rule(contact_nodes)
    mine, theirs = np.zeros((len(states), 5)), np.zeros((len(states), 5))

    def ours() -> object:
        _ours(wheel, soil, states, section, contact, mine)
        return mine

    candidates: dict[str, Callable[[], object]] = {"ours": ours}
    library = build(Path(tempfile.mkdtemp()))
    if library is not None:
        pointer = ctypes.POINTER(ctypes.c_double)
        w, s, st, se, co, out = (a.ctypes.data_as(pointer) for a in (wheel, soil, states, section, contact, theirs))

        def in_c() -> object:
            library.integrate_patches(
                w, s, st, len(states), 1, ctypes.c_double(1e-3), se, section_nodes, co, contact_nodes, out
            )
            return theirs

        candidates["C"] = in_c
        ours()
        in_c()
    difference = float(np.max(np.abs(mine - theirs).max(axis=0) / np.abs(mine).max(axis=0))) if library else 0.0
    return candidates, len(states) * section_nodes * 2 * contact_nodes, difference
