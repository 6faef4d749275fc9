"""Supervised training of the learned estimator's network, along whole turns to v_x, v_y with their covariance."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.stats import norm

from agents.velocity_drives import Drives
from ddagr_gym.control.timing import CONTROL_INTERVAL
from ddagr_gym.errors import InputError
from ddagr_gym.estimation.learned_inputs import INPUTS, SENSOR_INPUTS
from ddagr_gym.estimation.learned_network import (
    FORMAT,
    LARGEST_CORRELATION,
    LARGEST_LOG,
    LEAST_LOG,
    OUTPUTS,
    VELOCITY_SCALE,
    NetworkDescription,
    VelocityNetwork,
    velocity_base,
)
from ddagr_gym.files import atomic_path, make_folder
from ddagr_gym.parameters import Sensors
from ddagr_gym.progress import Progress
from ddagr_gym.version import __version__

Array = NDArray[np.float64]
Tensor = torch.Tensor

DEVIATIONS = float(norm.ppf(0.95))
"""Standard deviations either side that hold 90 %."""
_LEAST_DEVIATION = 1e-4  # of an input, in its unit: one that hardly changes is not blown up
_GATE = 5.0  # standard deviations beyond which an error counts linearly (P. Huber, 1964)


@dataclass(frozen=True)
class Variant:
    """What a network sees and what its velocities are added to.

    Attributes:
        description: one line.
        inputs: names.
        base: of ``learned_network.BASES``.
    """

    description: str
    inputs: tuple[str, ...]
    base: str


VARIANTS = {
    "correction": Variant("corrects the inertial filter, whose estimate and innovations it sees", INPUTS, "filter"),
    "alone": Variant("sees sensors and commands alone, no force law", SENSOR_INPUTS, "rim"),
    "features": Variant("sees the inertial filter, does not correct it", INPUTS, "rim"),
}
"""The published estimators by name."""


@dataclass(frozen=True)
class VelocitySettings:
    """Of a training.

    Attributes:
        turns: that are learnt from.
        validation: turns after them for course and calibration.
        root_seed: of the turns.
        seed: of the network and the order of turns.
        units: of its memory.
        epochs: passes over the turns.
        batch: turns in one step.
        learning_rate: at the start; it falls to a fiftieth on a cosine.
        rest_weight: of an instant at rest in the loss; 1 while driving.
        clip: of normalised inputs.
    """

    turns: int = 2300
    validation: int = 200
    root_seed: int = 20_261_240
    seed: int = 0
    units: int = 48
    epochs: int = 8
    batch: int = 25
    learning_rate: float = 3e-3
    rest_weight: float = 0.05
    clip: float = 8.0

    def __post_init__(self) -> None:
        for name in ("turns", "validation", "units", "epochs", "batch"):
            if getattr(self, name) < 1:
                raise InputError(f"{name} is {getattr(self, name)}: give at least 1.")


class VelocityModel(torch.nn.Module):
    """The network as torch trains it; ``VelocityNetwork`` is what numpy runs."""

    def __init__(self, inputs: int, units: int) -> None:
        super().__init__()
        self.memory = torch.nn.GRU(inputs, units, batch_first=True)
        self.output = torch.nn.Linear(units, OUTPUTS)
        torch.nn.init.zeros_(self.output.weight)
        torch.nn.init.zeros_(self.output.bias)

    def forward(self, inputs: Tensor) -> Tensor:
        """Outputs (D, B, 5) for normalised inputs (D, B, I)."""
        found: Tensor = self.output(self.memory(inputs)[0])
        return found


def gaussian_loss(outputs: Tensor, wanted: Tensor, weights: Tensor) -> Tensor:
    """Weighted mean of the negative log-likelihood of ``wanted`` (D, B, 2), velocities over VELOCITY_SCALE.

    Beyond _GATE standard deviations errors count linearly: turns on which the filter diverges would decide all.
    """
    logs = outputs[..., 2:4].clamp(LEAST_LOG, LARGEST_LOG)
    correlation = LARGEST_CORRELATION * torch.tanh(outputs[..., 4])
    scaled = (wanted - outputs[..., :2]) * torch.exp(-logs)
    free = 1.0 - correlation**2
    squares = (scaled**2).sum(dim=-1) - 2.0 * correlation * scaled[..., 0] * scaled[..., 1]
    distances = torch.sqrt(squares / free + 1e-12)
    bounded = torch.where(distances < _GATE, distances**2, 2.0 * _GATE * distances - _GATE**2)
    loss = logs.sum(dim=-1) + 0.5 * torch.log(free) + 0.5 * bounded
    return (weights * loss).sum() / weights.sum()


def fixed_loss(outputs: Tensor, wanted: Tensor, weights: Tensor) -> Tensor:
    """Weighted mean of Huber's loss of the velocities at a fixed deviation, VELOCITY_SCALE.

    Beside the likelihood, which alone widens the deviations before it learns the velocities (M. Seitzer et al., 2022).
    """
    errors = torch.nn.functional.huber_loss(outputs[..., :2], wanted, reduction="none").sum(dim=-1)
    return (weights * errors).sum() / weights.sum()


def mirror(names: tuple[str, ...]) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """Place and sign by which every input of a turn becomes that of the turn to the other side."""
    places, signs = [], []
    for name in names:
        other = name.replace("right", "?").replace("left", "right").replace("?", "left")
        places.append(names.index(other))
        odd = ("force_y", "yaw_rate", "sine", "centripetal", "filter_v_y", "gyro_bias", "bias_y", "gravity_y")
        signs.append(-1.0 if any(part in name for part in odd) and "deviation" not in name else 1.0)
    return np.array(places), np.array(signs, dtype=np.float32)


class VelocityTraining:
    """One training that can be interrupted; every finished epoch is kept.

    Args:
        name: of VARIANTS.
        settings: numbers.
        drives: that are learnt from.
        validation: drives that it is judged and calibrated on.
        folder: of its own.
    """

    def __init__(self, name: str, settings: VelocitySettings, drives: Drives, validation: Drives, folder: Path) -> None:
        self.name, self.variant, self.settings, self.folder = name, VARIANTS[name], settings, make_folder(folder)
        self._places = np.array([INPUTS.index(item) for item in self.variant.inputs])
        self._mean, self._deviation = self._statistics(drives)
        self._drives, self._validation = self._tensors(drives), self._tensors(validation)
        torch.set_num_threads(1)
        torch.manual_seed(settings.seed)
        self.model = VelocityModel(len(self._places), settings.units)
        self._optimiser = torch.optim.Adam(self.model.parameters(), lr=settings.learning_rate)
        self._mirror = mirror(self.variant.inputs)
        self.course: list[dict[str, float]] = []
        self.cpu_seconds = 0.0

    def _statistics(self, drives: Drives) -> tuple[Array, Array]:
        """Median and deviation of the inputs while driving, of turns to both sides alike.

        By quantiles: a filter that diverges must not decide them.
        """
        seen = drives.inputs[drives.driving > 0.0][:, self._places].astype(np.float64)
        places, signs = mirror(self.variant.inputs)
        both = np.concatenate([seen, seen[:, places] * signs])
        low, middle, high = np.quantile(both, [0.05, 0.5, 0.95], axis=0)
        return middle, np.maximum((high - low) / (2.0 * DEVIATIONS), _LEAST_DEVIATION)

    def _tensors(self, drives: Drives) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Inputs, wanted velocities over their scale, weights, and whether it drives."""
        inputs = torch.from_numpy(drives.inputs[..., self._places])
        base = velocity_base(self.variant.base, drives.rims, drives.filtered)
        wanted = torch.from_numpy((drives.truth - base) / np.float32(VELOCITY_SCALE))
        rest = self.settings.rest_weight * (drives.present - drives.driving)
        return inputs, wanted, torch.from_numpy(drives.driving + rest), torch.from_numpy(drives.driving)

    def _normal(self, inputs: Tensor) -> Tensor:
        mean, deviation = (torch.from_numpy(a.astype(np.float32)) for a in (self._mean, self._deviation))
        return ((inputs - mean) / deviation).clamp(-self.settings.clip, self.settings.clip)

    def run(self) -> VelocityNetwork:
        """Train to the end, from the last kept epoch on, and calibrate."""
        self._resume()
        with Progress(self.settings.epochs, f"training {self.name}") as progress:
            progress.advance(len(self.course))
            while len(self.course) < self.settings.epochs:
                self._keep_epoch()
                progress.advance()
        return self.network(self._calibration())

    def _keep_epoch(self) -> None:
        """One more pass, judged and kept."""
        begun = time.process_time()
        loss = self._epoch(len(self.course))
        self.cpu_seconds += time.process_time() - begun
        self.course.append({"loss": loss, **self.judged()})
        self._keep()

    def _epoch(self, number: int) -> float:
        """One pass; its order and mirrored turns depend on the seed and its number alone."""
        settings, total = self.settings, 0.0
        rng = np.random.default_rng([settings.seed, number])
        order = rng.permutation(len(self._drives[0]))
        batches = [order[first : first + settings.batch] for first in range(0, len(order), settings.batch)]
        for k, chosen in enumerate(batches):
            share = (number + k / len(batches)) / settings.epochs
            rate = settings.learning_rate * (0.02 + 0.98 * 0.5 * (1.0 + math.cos(math.pi * share)))
            for group in self._optimiser.param_groups:
                group["lr"] = rate * min(1.0, (number * len(batches) + k + 1) / 20.0)
            inputs, wanted, weights, _ = (part[torch.from_numpy(chosen)] for part in self._drives)
            inputs, wanted = self._mirrored(inputs, wanted, rng.random(len(chosen)) < 0.5)
            outputs = self.model(self._normal(inputs))
            loss = gaussian_loss(outputs, wanted, weights) + fixed_loss(outputs, wanted, weights)
            self._optimiser.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            torch.nn.utils.clip_grad_norm_(self.model.parameters(), 1.0)
            self._optimiser.step()
            total += loss.item() / len(batches)
        return total

    def _mirrored(self, inputs: Tensor, wanted: Tensor, chosen: NDArray[np.bool_]) -> tuple[Tensor, Tensor]:
        places, signs = self._mirror
        swapped = inputs[chosen][..., torch.from_numpy(places)] * torch.from_numpy(signs)
        inputs[chosen] = swapped
        wanted[chosen, :, 1] *= -1.0
        return inputs, wanted

    def _predicted(self) -> tuple[Array, Array]:
        """Errors [m/s] and deviations [m/s] (M, 2) at the validation's driving instants."""
        inputs, wanted, _, driving = self._validation
        with torch.no_grad():
            outputs = self.model(self._normal(inputs))
        errors = (outputs[..., :2] - wanted)[driving > 0.0].double().numpy() * VELOCITY_SCALE
        logs = outputs[..., 2:4].clamp(LEAST_LOG, LARGEST_LOG)[driving > 0.0].double().numpy()
        return errors, VELOCITY_SCALE * np.exp(logs)

    def judged(self) -> dict[str, float]:
        """Root mean square and median errors [mm/s] and coverage of 90 % [-] on the validation turns."""
        errors, deviations = self._predicted()
        inside = np.abs(errors) <= DEVIATIONS * deviations
        found = {}
        for i, name in enumerate(("v_x", "v_y")):
            found[f"{name}_rmse_mm_s"] = 1e3 * float(np.sqrt(np.mean(errors[:, i] ** 2)))
            found[f"{name}_median_mm_s"] = 1e3 * float(np.median(np.abs(errors[:, i])))
            found[f"{name}_covered"] = float(inside[:, i].mean())
        return found

    def _calibration(self) -> tuple[float, float]:
        """Factors on the deviations with which 90 % of the validation's errors are inside."""
        errors, deviations = self._predicted()
        v_x, v_y = np.quantile(np.abs(errors) / deviations, 0.90, axis=0) / DEVIATIONS
        return float(v_x), float(v_y)

    def network(self, calibration: tuple[float, float] = (1.0, 1.0)) -> VelocityNetwork:
        """As numpy runs it."""
        described = NetworkDescription(
            FORMAT, self.name, self.variant.inputs, self.variant.base, CONTROL_INTERVAL, Sensors().period, calibration,
            asdict(self.settings) | {"version": __version__},
        )  # fmt: skip
        gru, output = self.model.memory, self.model.output
        weights = (gru.weight_ih_l0, gru.weight_hh_l0, gru.bias_ih_l0, gru.bias_hh_l0, output.weight, output.bias)
        arrays = (weight.detach().numpy().copy() for weight in weights)
        return VelocityNetwork(described, *arrays, self._mean, self._deviation, self.settings.clip)

    def _keep(self) -> None:
        state = {"model": self.model.state_dict(), "optimiser": self._optimiser.state_dict()}
        with atomic_path(self.folder / "checkpoint.pt") as temporary:
            torch.save(state | {"record": json.dumps(self._record())}, temporary)

    def _record(self) -> dict[str, Any]:
        return {
            "name": self.name, "settings": asdict(self.settings), "course": self.course,
            "cpu_seconds": self.cpu_seconds,
        }  # fmt: skip

    def _resume(self) -> None:
        file = self.folder / "checkpoint.pt"
        if not file.is_file():
            return
        state: Mapping[str, Any] = torch.load(file, weights_only=True)
        record = json.loads(state["record"])
        if record["settings"] != asdict(self.settings) or record["name"] != self.name:
            raise InputError(f"{file} is of a training with other settings: give another folder.")
        self.model.load_state_dict(state["model"])
        self._optimiser.load_state_dict(state["optimiser"])
        self.course, self.cpu_seconds = record["course"], record["cpu_seconds"]
