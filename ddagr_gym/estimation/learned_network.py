"""The recurrent network of the learned estimator as plain numbers: numpy runs it, one npz file holds it.

Gated recurrent units (K. Cho et al., 2014, in the form of ``torch.nn.GRU``), each layer on the memory of the one before
it, and one linear layer on the last memory h::

    r = sigmoid(W_ir x + b_ir + W_hr h + b_hr),  z = sigmoid(W_iz x + b_iz + W_hz h + b_hz)
    n = tanh(W_in x + b_in + r (W_hn h + b_hn)),  h <- (1 - z) n + z h,  o = W_o h + b_o

The first five outputs o are two velocities over VELOCITY_SCALE, the logs of two standard deviations over it, and atanh
of the correlation over LARGEST_CORRELATION. A network that corrects the place too has five more: the same of x and y,
over PLACE_SCALE.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.errors import InputError, unknown_name
from ddagr_gym.estimation.learned_inputs import INPUTS
from ddagr_gym.number_files import read_arrays, take_array, take_description, write_arrays

Array = NDArray[np.float64]
Weights = NDArray[np.float32]

FORMAT = 2
"""Of the files that are written."""
FORMATS = (1, FORMAT)
"""That are read; another number is refused. The first had one layer and corrected no place."""
VELOCITY_SCALE = 0.01
"""Of the outputs that are velocities [m/s]."""
PLACE_SCALE = 0.02
"""Of the outputs that are places [m]."""
LEAST_LOG, LARGEST_LOG = math.log(0.02), math.log(50.0)
"""Of a standard deviation over its scale: 0.2 mm/s to 0.5 m/s, 0.4 mm to 1 m."""
LARGEST_CORRELATION = 0.98
OUTPUTS = 5
"""Of a pair of numbers with its covariance."""
BASES = ("rim", "filter")
"""What the velocities are added to: the mean rim speed and no side slip, or the inertial filter's."""

LARGEST_SLIP_SPEED, LARGEST_SIDE_SPEED = 0.35, 0.25
"""How far the filter's v_x may be from the mean rim speed, and its v_y from zero, where it is a base [m/s] (ours): a
filter that diverges must not take the network with it."""

_KIND = "an estimator's network"
MOST_UNITS, MOST_LAYERS = 512, 4
"""Of a network that is read."""


@dataclass(frozen=True)
class NetworkDescription:
    """The JSON description inside a file.

    Attributes:
        format: of the file.
        name: of the estimator.
        inputs: names of its inputs, of ``learned_inputs.INPUTS``.
        base: of BASES.
        samples: of a block.
        sample_period: between them [s].
        calibration: factors on the standard deviations of v_x and v_y, and of x and y where it corrects them.
        training: where it comes from.
        layers: of gated recurrent units.
        place: whether it corrects the place that the inertial filter carries.
    """

    format: int
    name: str
    inputs: tuple[str, ...]
    base: str
    samples: int
    sample_period: float
    calibration: tuple[float, ...]
    training: dict[str, Any]
    layers: int = 1
    place: bool = False

    @property
    def outputs(self) -> int:
        """Of the last layer: O."""
        return 2 * OUTPUTS if self.place else OUTPUTS


class RecurrentLayer(NamedTuple):
    """Gated recurrent units.

    Attributes:
        input_weight: (3 H, I) of r, z, n in this order.
        memory_weight: (3 H, H).
        input_bias: (3 H,).
        memory_bias: (3 H,).
    """

    input_weight: Weights
    memory_weight: Weights
    input_bias: Weights
    memory_bias: Weights

    def step(self, inputs: Weights, memory: Weights) -> Weights:
        """Memory (N, H) after inputs (N, I)."""
        # a product for each row: its bits do not depend on how many rows there are
        by_input = (inputs[:, None] @ self.input_weight.T)[:, 0] + self.input_bias
        by_memory = (memory[:, None] @ self.memory_weight.T)[:, 0] + self.memory_bias
        units = memory.shape[1]
        reset, keep = (
            1.0 / (1.0 + np.exp(-(by_input[:, part] + by_memory[:, part])))
            for part in (slice(units), slice(units, 2 * units))
        )
        candidate = np.tanh(by_input[:, 2 * units :] + reset * by_memory[:, 2 * units :])
        kept: Weights = (1.0 - keep) * candidate + keep * memory
        return kept


@dataclass(frozen=True, eq=False)
class VelocityNetwork:
    """A trained network.

    Attributes:
        description: what it is.
        layers: L of them, each sees the memory of the one before.
        output_weight: (O, H).
        output_bias: (O,).
        mean: (I,) subtracted from the inputs.
        deviation: (I,) that they are divided by.
        clip: of the normalised inputs.
    """

    description: NetworkDescription
    layers: tuple[RecurrentLayer, ...]
    output_weight: Weights
    output_bias: Weights
    mean: Array
    deviation: Array
    clip: float = 8.0

    @property
    def units(self) -> int:
        """H."""
        return self.output_weight.shape[1]

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Its numbers by the names that they have in a file; layers after the first have a number."""
        found: dict[str, NDArray[Any]] = {}
        for place, layer in enumerate(self.layers):
            found |= {_numbered(name, place): value for name, value in layer._asdict().items()}
        return found | {name: getattr(self, name) for name in _OWN}

    def digest(self) -> str:
        """SHA-256 of its numbers and its description."""
        parts = [value.tobytes() for value in self.arrays().values()]
        described = repr((self.description, self.clip)).replace(", layers=1, place=False", "")  # as format 1 had it
        return hashlib.sha256(b"".join([*parts, described.encode()])).hexdigest()

    @property
    def chosen(self) -> NDArray[np.intp]:
        """Places of its inputs among all INPUTS."""
        return np.array([INPUTS.index(name) for name in self.description.inputs])

    def new_memory(self, count: int) -> Weights:
        """Of N robots that have seen nothing (N, L, H)."""
        return np.zeros((count, len(self.layers), self.units), dtype=np.float32)

    def step(self, inputs: Array, memory: Weights) -> Weights:
        """Outputs (N, O) for inputs (N, I); ``memory`` (N, L, H) of :meth:`new_memory` is changed."""
        seen = np.clip((inputs - self.mean) / self.deviation, -self.clip, self.clip).astype(np.float32)
        for place, layer in enumerate(self.layers):
            seen = memory[:, place] = layer.step(seen, memory[:, place])
        outputs: Weights = (seen[:, None] @ self.output_weight.T)[:, 0] + self.output_bias
        return outputs

    def estimate(self, outputs: Weights, base: Array) -> tuple[Array, Array]:
        """v_x, v_y (N, 2) [m/s] and covariances (N, 2, 2) of outputs (N, O) on a base (N, 2) [m/s]."""
        return _pair(outputs[:, :OUTPUTS], VELOCITY_SCALE, self.description.calibration[:2], base)

    def place(self, outputs: Weights, base: Array) -> tuple[Array, Array]:
        """x, y (N, 2) [m] and covariances (N, 2, 2) of outputs (N, O) on those of the inertial filter (N, 2) [m]."""
        return _pair(outputs[:, OUTPUTS:], PLACE_SCALE, self.description.calibration[2:], base)


def _pair(outputs: Weights, scale: float, calibration: tuple[float, ...], base: Array) -> tuple[Array, Array]:
    """Two numbers (N, 2) and their covariances (N, 2, 2) of outputs (N, OUTPUTS)."""
    raw = outputs.astype(np.float64)
    deviations = scale * np.exp(np.clip(raw[:, 2:4], LEAST_LOG, LARGEST_LOG))
    deviations *= calibration
    covariances = np.empty((len(raw), 2, 2))
    covariances[:, [0, 1], [0, 1]] = deviations**2
    shared = LARGEST_CORRELATION * np.tanh(raw[:, 4]) * deviations.prod(axis=1)
    covariances[:, 0, 1] = covariances[:, 1, 0] = shared
    return base + scale * raw[:, :2], covariances


def velocity_base(base: str, rim: Array, filtered: Array) -> Array:
    """What a network's velocities are added to (..., 2) [m/s].

    Args:
        base: of BASES.
        rim: mean rim speed (...).
        filtered: v_x, v_y (..., 2) of the inertial filter.
    """
    if base == "rim":
        return np.stack([rim, np.zeros_like(rim)], axis=-1)
    slip = np.clip(filtered[..., 0] - rim, -LARGEST_SLIP_SPEED, LARGEST_SLIP_SPEED)
    return np.stack([rim + slip, np.clip(filtered[..., 1], -LARGEST_SIDE_SPEED, LARGEST_SIDE_SPEED)], axis=-1)


def save_network(network: VelocityNetwork, path: str | os.PathLike[str]) -> Path:
    """Write a network; the same one gives the same bytes."""
    return write_arrays(path, network.arrays(), asdict(network.description) | {"clip": network.clip})


def load_network(path: str | os.PathLike[str]) -> VelocityNetwork:
    """Read a network and check all of it.

    Raises:
        InputError: no such file, too large, damaged, of another format, or numbers that do not fit together.
    """
    file = Path(path).expanduser()
    arrays = read_arrays(file, _KIND)
    described, clip = _description(file, take_description(file, arrays, _KIND))
    units = int(np.size(arrays.get("input_bias", ()))) // 3
    if not 1 <= units <= MOST_UNITS:
        raise InputError(f"{file} has {units} units: 1 to {MOST_UNITS} expected.")
    shapes = _shapes(described, units)
    found = {name: take_array(file, arrays, name, *wanted, _KIND) for name, wanted in shapes.items()}
    if arrays:
        raise InputError(f"{file}: {sorted(arrays)[0]!r} is not part of {_KIND}.")
    if not (found["deviation"] > 0.0).all():
        raise InputError(f"{file}: deviation holds values that are not positive.")
    layers = tuple(
        RecurrentLayer(*(found[_numbered(name, place)] for name in RecurrentLayer._fields))
        for place in range(described.layers)
    )
    return VelocityNetwork(described, layers, **{name: found[name] for name in _OWN}, clip=clip)


_OWN = ("output_weight", "output_bias", "mean", "deviation")


def _numbered(name: str, place: int) -> str:
    """Name in a file of an array of a layer."""
    return name if place == 0 else f"{name}_{place + 1}"


def _shapes(described: NetworkDescription, units: int) -> dict[str, tuple[tuple[int, ...], type[np.floating[Any]]]]:
    """Shape and type of every array."""
    found: dict[str, tuple[tuple[int, ...], type[np.floating[Any]]]] = {}
    seen = len(described.inputs)
    for place in range(described.layers):
        wanted = ((3 * units, seen), (3 * units, units), (3 * units,), (3 * units,))
        names = (_numbered(name, place) for name in RecurrentLayer._fields)
        found |= {name: (shape, np.float32) for name, shape in zip(names, wanted, strict=True)}
        seen = units
    inputs, outputs = len(described.inputs), described.outputs
    return found | {
        "output_weight": ((outputs, units), np.float32),
        "output_bias": ((outputs,), np.float32),
        "mean": ((inputs,), np.float64),
        "deviation": ((inputs,), np.float64),
    }


def _description(file: Path, stored: bytes) -> tuple[NetworkDescription, float]:
    try:
        content = json.loads(stored.decode())
        clip = float(content.pop("clip"))
        content["inputs"], content["calibration"] = tuple(content["inputs"]), tuple(content["calibration"])
        described = NetworkDescription(**content)
        factors = [float(value) for value in described.calibration]
        samples, period, layers = int(described.samples), float(described.sample_period), described.layers
    except (ValueError, AttributeError, KeyError, TypeError, RecursionError):
        raise InputError(f"{file} is not {_KIND}: its description is incomplete.") from None
    if described.format not in FORMATS:
        raise InputError(f"{file} has format {described.format!r}: this version reads up to {FORMAT}.")
    if described.base not in BASES:
        raise unknown_name("base", str(described.base), BASES)
    unknown = [name for name in described.inputs if name not in INPUTS]
    if unknown or not described.inputs:
        raise InputError(f"{file}: its inputs are not those of this version: train anew.")
    if type(layers) is not int or not 1 <= layers <= MOST_LAYERS or type(described.place) is not bool:
        raise InputError(f"{file}: layers {layers!r}, place {described.place!r}: 1 to {MOST_LAYERS}, true or false.")
    if len(factors) != (4 if described.place else 2):
        raise InputError(f"{file} has {len(factors)} factors of calibration: 2, or 4 with a place, expected.")
    if described.format == 1 and (layers > 1 or described.place):
        raise InputError(f"{file} has format 1, in which there is one layer and no place: train anew.")
    if not (min(*factors, clip, period) > 0.0 and max(*factors, clip, period) < 1e6):
        raise InputError(f"{file}: clip, calibration and sample period must be positive.")
    if not 2 <= samples <= 1000 or samples % 2:
        raise InputError(f"{file} has {samples} samples in a block: give an even number up to 1000.")
    return described, clip
