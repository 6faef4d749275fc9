"""Policies as files of plain numbers: one npz with weights, normalisation and a JSON description, and no pickle.

A file from elsewhere is not trusted: its size, its members, their types, shapes and values, and its description are
checked before anything is used.
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.config import parse_config
from ddagr_gym.errors import InputError
from ddagr_gym.number_files import read_arrays, take_array, take_description, write_arrays
from ddagr_gym.policies.design import PolicyDesign

FORMAT = 1
"""Of the files; another number is refused."""
MAXIMUM_LAYERS = 8
"""Most layers of a network (ours): published ones have three."""

_KIND = "a policy"

Weights = NDArray[np.float32]


@dataclass(frozen=True)
class TrainingRecord:
    """Where a policy comes from.

    Attributes:
        algorithm: "ppo" or "sac".
        seed: of the training.
        steps: control steps that it was trained for.
        digest: SHA-256 of the training's settings.
        version: of this package at that time.
    """

    algorithm: str
    seed: int
    steps: int
    digest: str
    version: str


@dataclass(frozen=True)
class Description:
    """The JSON description inside a policy's file.

    Attributes:
        format: of the file.
        design: wiring.
        inputs: names of the inputs, in order; must be those of the design.
        outputs: how many.
        activation: of the hidden layers.
        squashed: whether the outputs pass through tanh.
        clip: of the normalised inputs.
        training: where it comes from.
    """

    format: int
    design: PolicyDesign
    inputs: tuple[str, ...]
    outputs: int
    activation: Literal["tanh", "relu"]
    squashed: bool
    clip: float
    training: TrainingRecord


@dataclass(frozen=True, eq=False)
class Policy:
    """A trained policy; call it with inputs (N, inputs) for outputs (N, 2).

    Attributes:
        design: wiring.
        weights: (units, inputs) of each layer.
        biases: (units,) of each layer.
        mean: (inputs,) subtracted from the inputs.
        deviation: (inputs,) that they are divided by.
        clip: of the normalised inputs.
        activation: of the hidden layers, "tanh" or "relu".
        squashed: whether the outputs pass through tanh.
        training: entries of :class:`TrainingRecord`.
    """

    design: PolicyDesign
    weights: tuple[Weights, ...]
    biases: tuple[Weights, ...]
    mean: NDArray[np.float64]
    deviation: NDArray[np.float64]
    clip: float = 10.0
    activation: str = "tanh"
    squashed: bool = False
    training: dict[str, Any] = field(default_factory=dict)

    def __call__(self, inputs: NDArray[np.floating]) -> NDArray[np.float32]:
        """Outputs (N, 2) in single precision, as they were trained."""
        normal = np.clip((inputs - self.mean) / self.deviation, -self.clip, self.clip).astype(np.float32)
        normal = normal[:, None]  # a product for each row: its bits do not depend on how many rows there are
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            normal = normal @ weight.T + bias
            normal = np.tanh(normal) if self.activation == "tanh" else np.maximum(normal, 0.0)
        outputs: NDArray[np.float32] = (normal @ self.weights[-1].T + self.biases[-1])[:, 0]
        return np.tanh(outputs) if self.squashed else outputs

    def description(self) -> Description:
        """The file's description: everything but its arrays."""
        return Description(
            format=FORMAT,
            design=self.design,
            inputs=self.design.inputs,
            outputs=len(self.biases[-1]),
            activation=self.activation,  # type: ignore[arg-type]
            squashed=self.squashed,
            clip=self.clip,
            training=TrainingRecord(**self.training),
        )


def save_policy(policy: Policy, path: str | os.PathLike[str]) -> Path:
    """Write a policy; the same policy gives the same bytes.

    Returns:
        The file.
    """
    arrays: dict[str, NDArray[Any]] = {"mean": policy.mean, "deviation": policy.deviation}
    for k, (weight, bias) in enumerate(zip(policy.weights, policy.biases, strict=True)):
        arrays |= {f"weight_{k}": weight, f"bias_{k}": bias}
    return write_arrays(path, arrays, asdict(policy.description()))


def load_policy(path: str | os.PathLike[str]) -> Policy:
    """Read a policy and check all of it.

    Raises:
        InputError: no such file, too large, damaged, of another format, or numbers that do not fit together.
    """
    file = Path(path).expanduser()
    arrays = read_arrays(file, _KIND)
    described = _description(file, take_description(file, arrays, _KIND))
    design = described.design
    if described.inputs != design.inputs:
        raise InputError(f"{file}: its inputs are not those of this version's {design.features!r} design: train anew.")
    if not 0.0 < described.clip <= 1e6:
        raise InputError(f"{file}: clip is {described.clip:g}: it must be positive.")
    count = len(design.inputs)
    mean, deviation = (take_array(file, arrays, name, (count,), np.float64, _KIND) for name in ("mean", "deviation"))
    if not (deviation > 0.0).all():
        raise InputError(f"{file}: deviation holds values that are not positive.")
    weights, biases = _layers(file, arrays, count, described.outputs)
    if arrays:
        raise InputError(f"{file}: {sorted(arrays)[0]!r} is not part of a policy.")
    return Policy(
        design, weights, biases, mean, deviation, described.clip, described.activation, described.squashed,
        asdict(described.training),
    )  # fmt: skip


def _description(file: Path, stored: bytes) -> Description:
    try:
        text = stored.decode()
        found = json.loads(text).get("format")
    except (ValueError, AttributeError, RecursionError):
        raise InputError(f"{file} is not a policy: its description is not JSON.") from None
    if found != FORMAT:
        raise InputError(f"{file} has format {found!r}: this version reads {FORMAT}.")
    return parse_config(text, Description, source=str(file))


def _layers(
    file: Path, arrays: dict[str, NDArray[Any]], inputs: int, outputs: int
) -> tuple[tuple[Weights, ...], tuple[Weights, ...]]:
    count = sum(name.startswith("weight_") for name in arrays)
    if not 1 <= count <= MAXIMUM_LAYERS or outputs != 2:
        raise InputError(f"{file} has {count} layers and {outputs} outputs: 1 to {MAXIMUM_LAYERS}, and 2, expected.")
    weights, biases = [], []
    for k in range(count):
        units = outputs if k == count - 1 else int(np.size(arrays.get(f"bias_{k}", ())))
        weights.append(take_array(file, arrays, f"weight_{k}", (units, inputs), np.float32, _KIND))
        biases.append(take_array(file, arrays, f"bias_{k}", (units,), np.float32, _KIND))
        inputs = units
    return tuple(weights), tuple(biases)
