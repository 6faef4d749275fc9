"""Time of one evaluation of the contact kernel, and of the same kernel in C."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.speeds.timing import Contestant, race, ratio
from ddagr_gym.jit import kernel
from ddagr_gym.parameters import Numerics
from ddagr_gym.physics.contact_patch import WRENCH, WheelMotion, wheel_wrench
from ddagr_gym.physics.numerics import PatchNumerics, patch_numerics
from ddagr_gym.physics.wheel_forces import soil_vector, wheel_vector
from ddagr_gym.presets import get_robot, get_soil

SOURCE = Path(__file__).with_name("kernel.c")
FLAGS = ("-O3", "-march=native", "-ffast-math")
# Without omp simd gcc calls the scalar functions of libm in these loops.
VECTOR_LOOPS = "-fopenmp-simd"
BUILDS = {"C, libm": (), "C, our polynomials": ("-DPOLYNOMIALS",)}
LARGEST_DIFFERENCE = 1e-9  # of the largest wrench, between the two languages
STATES = 256


@kernel()
def evaluate(
    wheel: np.ndarray,
    soil: np.ndarray,
    states: np.ndarray,
    repeats: int,
    numerics: PatchNumerics,
    wrenches: np.ndarray,
) -> None:
    for _ in range(repeats):
        for n in range(states.shape[0]):
            motion = WheelMotion(states[n, 0], states[n, 1], states[n, 2], states[n, 3])
            wheel_wrench(wheel, soil, motion, states[n, 4], numerics, wrenches[n])


def forward_states(count: int = STATES, seed: int = 0) -> np.ndarray:
    """Wheel states (count, 5) of a robot that turns: v_x, v_y, omega, yaw rate, sinkage, all travelling forward."""
    rng = np.random.default_rng(seed)
    low, high = np.array([[0.05, -0.2, 0.3, -0.5, 0.005], [0.5, 0.2, 2.0, 0.5, 0.04]])
    return rng.uniform(low, high, (count, 5))


class Kernel:
    """The kernel on the DDAGR's tyre in Table A.1 soil.

    Args:
        numerics: quadrature.
        contact_nodes: instead of ``numerics.contact_nodes``.
        states: (N, 5).
    """

    def __init__(self, numerics: Numerics, contact_nodes: int | None = None, states: np.ndarray | None = None) -> None:
        self.wheel = wheel_vector(get_robot("ddagr").wheels[0])
        self.soil = soil_vector(get_soil("thesis_a1"))
        self.states = forward_states() if states is None else np.ascontiguousarray(states)
        self.numerics = patch_numerics(numerics, contact_nodes)
        self.wrenches = np.zeros((len(self.states), WRENCH))

    def contestant(self, name: str, repeats: int) -> Contestant:
        """The compiled Python; the amount is evaluations."""

        def run() -> float:
            evaluate(self.wheel, self.soil, self.states, repeats, self.numerics, self.wrenches)
            return float(repeats * len(self.states))

        return Contestant(name, run)

    def in_c(self, name: str, function: Callable[..., None], repeats: int) -> Contestant:
        """The same in C."""
        wrenches = np.zeros_like(self.wrenches)
        section, contact, *limits = self.numerics
        arguments = (
            _pointer(self.wheel), _pointer(self.soil), _pointer(self.states), len(self.states), repeats,
            *map(ctypes.c_double, limits), _pointer(section), section.size // 2,
            _pointer(contact), contact.shape[1], _pointer(wrenches),
        )  # fmt: skip

        def run() -> float:
            function(*arguments)
            return float(repeats * len(self.states))

        run()
        self.contestant(name, 1).run()
        difference = np.abs(wrenches - self.wrenches).max() / np.abs(self.wrenches).max()
        if not difference < LARGEST_DIFFERENCE:
            raise AssertionError(f"{name} differs from the compiled Python by {difference:.1e} of the largest wrench")
        return Contestant(name, run)


def _pointer(array: np.ndarray) -> ctypes.Array:
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))  # type: ignore[return-value]


def compiler() -> str | None:
    """A C compiler on the path, or None."""
    return next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)


def _build(program: str, flags: tuple[str, ...], library: Path) -> str:
    """Compile the kernel into a library; the reason where that fails, else nothing."""
    compiled = library.with_suffix(".o")
    for command in (
        [program, *FLAGS, VECTOR_LOOPS, *flags, "-fPIC", "-c", str(SOURCE), "-o", str(compiled)],
        # linked without -ffast-math: with it the library would switch off subnormal numbers in the whole process
        [program, "-shared", str(compiled), "-o", str(library), "-lm"],
    ):
        built = subprocess.run(command, capture_output=True, text=True)
        if built.returncode:
            return f"{' '.join(command[:5])} failed: {built.stderr.strip().splitlines()[-1]}"
    return ""


def against_c(repeats: int, evaluations: int) -> dict[str, object]:
    """Nanoseconds per evaluation of ours and of C, and the ratios of the times; a reason instead without compiler."""
    program = compiler()
    if program is None:
        return {"skipped": "no C compiler on the path: install gcc or clang."}
    ours = Kernel(Numerics())
    rounds = max(1, evaluations // STATES)
    contestants = [ours.contestant("ours", rounds)]
    with tempfile.TemporaryDirectory() as folder:
        for number, (name, flags) in enumerate(BUILDS.items()):
            library = Path(folder) / f"kernel_{number}.so"
            failure = _build(program, flags, library)
            if failure:
                return {"skipped": failure}
            contestants.append(ours.in_c(name, ctypes.CDLL(str(library)).integrate_patches, rounds))
        rates = race(contestants, repeats)
    version = subprocess.run([program, "--version"], capture_output=True, text=True).stdout.splitlines()[0]
    return {
        "compiler": version,
        "flags": [*FLAGS, VECTOR_LOOPS],
        "nodes": int(ours.numerics.section_nodes.size // 2 * ours.numerics.contact_nodes.shape[1] * 2),
        "nanoseconds": {name: round(1e9 / found.median, 1) for name, found in rates.items()},
        # times, so the other's rate over ours
        "time_ratios": [ratio(rates, name, "ours") for name in BUILDS],
    }
