"""Share of the time that is spent in the contact kernel, found from outside.

The time of a sample is a + c t(n) + d t(m): t(n) is the measured time of the kernel on the force's rule of n contact
nodes, t(m) on the derivative's of m, c and d how often a sample evaluates each. More nodes make the kernel dearer and
change next to nothing else, so c and d are the slopes of the sample's time over the kernel's, and a is the rest.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.speeds.accuracy import Drive, bank_commands
from benchmarks.speeds.kernel_time import Kernel
from benchmarks.speeds.timing import race
from ddagr_gym.parameters import Numerics

FORCE_NODES = (4, 8, 16)
DERIVATIVE_NODES = (2, 4, 8)


def share(actions: np.ndarray, samples: int, repeats: int, evaluations: int) -> dict[str, float]:
    """Evaluations per sample of both rules, and the kernel's share of a sample's time at default numerics."""
    default = Numerics()
    commands = bank_commands(actions, samples)
    nodes = sorted({*FORCE_NODES, *DERIVATIVE_NODES})
    numerics = {f"force {n}": replace(default, contact_nodes=n) for n in FORCE_NODES}
    numerics |= {f"derivative {n}": replace(default, jacobian_contact_nodes=n) for n in DERIVATIVE_NODES}
    contestants = [Kernel(default, n).contestant(f"kernel {n}", max(1, evaluations // 256)) for n in nodes]
    contestants += [Drive(options, commands).contestant(name) for name, options in numerics.items()]
    rates = race(contestants, repeats)
    kernel = {n: 1e6 / rates[f"kernel {n}"].median for n in nodes}
    slopes = {}
    for rule, used in (("force", FORCE_NODES), ("derivative", DERIVATIVE_NODES)):
        sample = [1e6 / rates[f"{rule} {n}"].median for n in used]
        slopes[rule] = max(float(np.polyfit([kernel[n] for n in used], sample, 1)[0]), 0.0)
    total = 1e6 / rates[f"force {default.contact_nodes}"].median
    inside = slopes["force"] * kernel[default.contact_nodes]
    inside += slopes["derivative"] * kernel[default.jacobian_contact_nodes]
    return {
        "microseconds_per_sample": round(total, 2),
        "force_evaluations_per_sample": round(slopes["force"], 2),
        "derivative_evaluations_per_sample": round(slopes["derivative"], 2),
        "share_in_kernel": round(inside / total, 3),
    }
