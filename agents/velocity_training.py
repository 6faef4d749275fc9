"""Supervised training of the learned estimator's network, along whole turns to velocities and place with covariance."""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.stats import norm

from agents.velocity_drives import Drives
from agents.velocity_losses import mirror, total_loss
from ddagr_gym.control.timing import CONTROL_INTERVAL
from ddagr_gym.errors import InputError, at_least
from ddagr_gym.estimation.learned_filter import find_network
from ddagr_gym.estimation.learned_inputs import FILTER_INPUTS, INPUTS, SENSOR_INPUTS
from ddagr_gym.estimation.learned_network import (
    FORMAT,
    LARGEST_LOG,
    LEAST_LOG,
    MOST_LAYERS,
    MOST_UNITS,
    OUTPUTS,
    PLACE_SCALE,
    VELOCITY_SCALE,
    NetworkDescription,
    RecurrentLayer,
    VelocityNetwork,
    velocity_base,
)
from ddagr_gym.files import atomic_path, make_folder
from ddagr_gym.parameters import Sensors
from ddagr_gym.progress import Progress
from ddagr_gym.version import __version__

Array = NDArray[np.float64]
Tensor = torch.Tensor

ESTIMATED = (("v_x", "mm_s"), ("v_y", "mm_s"), ("x", "mm"), ("y", "mm"))
"""What networks estimate, with units of their errors in a record."""
DEVIATIONS = float(norm.ppf(0.95))
"""Standard deviations either side that hold 90 %."""
_WEIGHTS = ("weight_ih", "weight_hh", "bias_ih", "bias_hh")
"""What torch calls the numbers of a recurrent layer."""
_LEAST_DEVIATION = 1e-4  # of an input, in its unit: one that hardly changes is not blown up
_MOST_ROWS = 1_000_000  # from which the inputs' deviations are taken


@dataclass(frozen=True)
class VelocitySettings:
    """Of a training.

    Attributes:
        turns: that are learnt from, drawn by the plan.
        near: further ones of the task as it is, drawn with the next root seed.
        wide: further ones of robots, grounds and sensors that differ more, drawn with the root seed after that.
        validation: turns after those of the plan, and where there are wide ones as many after those, for course and
            calibration.
        root_seed: of the turns.
        seed: of the network and the order of turns.
        units: of its memory.
        layers: of units.
        epochs: passes over the turns.
        batch: turns in one step.
        learning_rate: at the start; it falls to a fiftieth on a cosine.
        rest_weight: of an instant at rest in the loss; 1 while driving.
        clip: of normalised inputs.
        begun: published estimator whose network goes on to learn; a new network where it is empty.
    """

    turns: int = 2300
    near: int = 0
    wide: int = 0
    validation: int = 200
    root_seed: int = 20_261_240
    seed: int = 0
    units: int = 48
    layers: int = 1
    epochs: int = 8
    batch: int = 25
    learning_rate: float = 3e-3
    rest_weight: float = 0.05
    clip: float = 8.0
    begun: str = ""

    def __post_init__(self) -> None:
        counted = ("turns", "validation", "units", "layers", "epochs", "batch")
        at_least(near=(self.near, 0), wide=(self.wide, 0), **{name: (getattr(self, name), 1) for name in counted})
        for name, most in (("units", MOST_UNITS), ("layers", MOST_LAYERS)):
            if getattr(self, name) > most:
                raise InputError(f"{name} is {getattr(self, name)}: give {most} at most.")


@dataclass(frozen=True)
class Variant:
    """What a network sees and what its velocities are added to.

    Attributes:
        description: one line.
        inputs: names.
        base: of ``learned_network.BASES``.
        place: whether it corrects the place that the inertial filter carries.
        settings: of its training.
    """

    description: str
    inputs: tuple[str, ...]
    base: str
    place: bool = False
    settings: VelocitySettings = field(default_factory=VelocitySettings)


_BESIDE = SENSOR_INPUTS + FILTER_INPUTS
_LONG = VelocitySettings(
    turns=7760, near=7780, root_seed=77_001, units=128, layers=2, epochs=80, batch=128, learning_rate=3e-3
)
_LONGER = VelocitySettings(
    turns=1500, near=2500, wide=4000, root_seed=78_001, units=128, layers=2, epochs=10, batch=128, learning_rate=1e-3,
    begun="pose",
)  # fmt: skip
VARIANTS = {
    "correction": Variant("corrects the inertial filter, whose estimate and innovations it sees", _BESIDE, "filter"),
    "alone": Variant("sees sensors and commands alone, no force law", SENSOR_INPUTS, "rim"),
    "features": Variant("sees the inertial filter, does not correct it", _BESIDE, "rim"),
    "pose": Variant("corrects velocities and place of the inertial filter", INPUTS, "filter", True, _LONG),
    "pose_wide": Variant(
        "corrects as pose, from which it learnt on with worse sensors and motors", INPUTS, "filter", True, _LONGER
    ),
}
"""The published estimators by name."""


class VelocityModel(torch.nn.Module):
    """The network as torch trains it; ``VelocityNetwork`` is what numpy runs."""

    def __init__(self, inputs: int, units: int, layers: int = 1, outputs: int = OUTPUTS) -> None:
        super().__init__()
        self.memory = torch.nn.GRU(inputs, units, layers, batch_first=True)
        self.output = torch.nn.Linear(units, outputs)
        torch.nn.init.zeros_(self.output.weight)
        torch.nn.init.zeros_(self.output.bias)

    def forward(self, inputs: Tensor) -> Tensor:
        """Outputs (D, B, O) for normalised inputs (D, B, I)."""
        found: Tensor = self.output(self.memory(inputs)[0])
        return found


def exact_device(name: str) -> torch.device:
    """Device of torch on which the same training gives the same numbers, in single precision throughout."""
    if name != "cpu":
        os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:2")  # what torch asks of recurrent layers
        torch.use_deterministic_algorithms(True)
        torch.backends.cuda.matmul.allow_tf32 = torch.backends.cudnn.allow_tf32 = False
    return torch.device(name)


class VelocityTraining:
    """One training that can be interrupted; every finished epoch is kept.

    Args:
        name: of VARIANTS.
        settings: numbers.
        drives: that are learnt from.
        validation: drives that it is judged and calibrated on.
        folder: of its own.
        device: of torch. Other devices give other bits.
    """

    def __init__(
        self, name: str, settings: VelocitySettings, drives: Drives, validation: Drives, folder: Path,
        device: str = "cpu",
    ) -> None:  # fmt: skip
        self.name, self.variant, self.settings, self.folder = name, VARIANTS[name], settings, make_folder(folder)
        self._places = np.array([INPUTS.index(item) for item in self.variant.inputs])
        begun = find_network(settings.begun) if settings.begun else None
        self._begun = "" if begun is None else begun.digest()
        self._mean, self._deviation = self._statistics(drives) if begun is None else (begun.mean, begun.deviation)
        self.device, self._device = device, exact_device(device)
        self._drives, self._validation = self._tensors(drives), self._tensors(validation)
        torch.set_num_threads(1)
        torch.manual_seed(settings.seed)
        outputs = 2 * OUTPUTS if self.variant.place else OUTPUTS
        self.model = VelocityModel(len(self._places), settings.units, settings.layers, outputs).to(self._device)
        if begun is not None:
            self._go_on_from(begun)
        self._optimiser = torch.optim.Adam(self.model.parameters(), lr=settings.learning_rate)
        self._mirror = mirror(self.variant.inputs)
        self.course: list[dict[str, float]] = []
        self.seconds = 0.0

    def _go_on_from(self, network: VelocityNetwork) -> None:
        """Begin with the weights of a network that sees and estimates the same.

        Raises:
            InputError: it has other inputs, units or layers.
        """
        settings, own = self.settings, network.description
        if (network.units, own.layers, own.inputs) != (settings.units, settings.layers, self.variant.inputs):
            raise InputError(
                f"{self.name} with {settings.layers} layers of {settings.units} units goes on from {settings.begun}, "
                f"which has {own.layers} of {network.units}: leave --layers and --units out."
            )
        layers = {
            f"memory.{kind}_l{place}": weight
            for place, layer in enumerate(network.layers)
            for kind, weight in zip(_WEIGHTS, layer, strict=True)
        }
        layers |= {"output.weight": network.output_weight, "output.bias": network.output_bias}
        self.model.load_state_dict({name: torch.tensor(value, dtype=torch.float32) for name, value in layers.items()})

    def _statistics(self, drives: Drives) -> tuple[Array, Array]:
        """Median and deviation of the inputs while driving, of turns to both sides alike.

        By quantiles: a filter that diverges must not decide them.
        """
        rows = drives.inputs[drives.driving > 0.0]
        seen = rows[:: 1 + len(rows) // _MOST_ROWS][:, self._places].astype(np.float64)
        places, signs = mirror(self.variant.inputs)
        both = np.concatenate([seen, seen[:, places] * signs])
        low, middle, high = np.quantile(both, [0.05, 0.5, 0.95], axis=0)
        return middle, np.maximum((high - low) / (2.0 * DEVIATIONS), _LEAST_DEVIATION)

    def _tensors(self, drives: Drives) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Inputs, wanted velocities and places over their scale, weights, and whether it drives."""
        base = velocity_base(self.variant.base, drives.rims, drives.filtered)
        wanted = (drives.truth - base) / np.float32(VELOCITY_SCALE)
        if self.variant.place:
            carried = drives.inputs[..., [INPUTS.index("pose_x"), INPUTS.index("pose_y")]]
            wanted = np.concatenate([wanted, (drives.places - carried) / np.float32(PLACE_SCALE)], axis=-1)
        weights = drives.driving + self.settings.rest_weight * (drives.present - drives.driving)
        parts = (drives.inputs[..., self._places], wanted, weights, drives.driving)
        inputs, due, weight, driving = (torch.from_numpy(np.ascontiguousarray(part)) for part in parts)
        return inputs.to(self._device), due.to(self._device), weight.to(self._device), driving.to(self._device)

    def _normal(self, inputs: Tensor) -> Tensor:
        numbers = (self._mean, self._deviation)
        mean, deviation = (torch.from_numpy(a.astype(np.float32)).to(self._device) for a in numbers)
        return ((inputs - mean) / deviation).clamp(-self.settings.clip, self.settings.clip)

    def run(self) -> VelocityNetwork:
        """Train to the end, from the last kept epoch on, and calibrate."""
        self._resume()
        with Progress(self.settings.epochs, f"training {self.name}") as progress:
            progress.advance(len(self.course))
            while len(self.course) < self.settings.epochs:
                self._keep_epoch()
                progress.advance()
        return self.network(self.calibration())

    def _keep_epoch(self) -> None:
        """One more pass, judged and kept."""
        begun = self._clock()
        loss = self._epoch(len(self.course))
        self.seconds += self._clock() - begun
        self.course.append({"loss": loss, **self.judged()})
        self._keep()

    def _clock(self) -> float:
        """Time of the processor that trains [s]."""
        return time.process_time() if self.device == "cpu" else time.monotonic()

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
            places = torch.from_numpy(chosen).to(self._device)
            inputs, wanted, weights, _ = (part[places] for part in self._drives)
            inputs, wanted = self._mirrored(inputs, wanted, rng.random(len(chosen)) < 0.5)
            outputs = self.model(self._normal(inputs))
            loss = total_loss(outputs, wanted, weights)
            self._optimiser.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            torch.nn.utils.clip_grad_norm_(self.model.parameters(), 1.0)
            self._optimiser.step()
            total += loss.item() / len(batches)
        return total

    def _mirrored(self, inputs: Tensor, wanted: Tensor, chosen: NDArray[np.bool_]) -> tuple[Tensor, Tensor]:
        places, signs = (torch.from_numpy(part).to(self._device) for part in self._mirror)
        rows = torch.from_numpy(chosen).to(self._device)
        inputs[rows] = inputs[rows][..., places] * signs
        wanted[rows, :, 1::2] *= -1.0
        return inputs, wanted

    def _predicted(self) -> tuple[Array, Array]:
        """Errors and deviations [m/s, then m] (M, 2 or 4) at the validation's driving instants."""
        inputs, wanted, _, driving = self._validation
        with torch.no_grad():
            outputs = self.model(self._normal(inputs))
        firsts = OUTPUTS * np.arange(wanted.shape[-1] // 2)
        means, spreads = (np.ravel([firsts + first, firsts + first + 1], order="F") for first in (0, 2))
        own, due = outputs[driving > 0.0].double().cpu().numpy(), wanted[driving > 0.0].double().cpu().numpy()
        errors = (own[:, means] - due) * self._scales
        logs = own[:, spreads].clip(LEAST_LOG, LARGEST_LOG)
        return errors, self._scales * np.exp(logs)

    @property
    def _scales(self) -> Array:
        """Of what is estimated [m/s, then m]."""
        found = 2 * [VELOCITY_SCALE] + (2 * [PLACE_SCALE] if self.variant.place else [])
        return np.array(found)

    def judged(self) -> dict[str, float]:
        """Root mean square and median errors [mm/s, mm] and coverage of 90 % [-] on the validation turns."""
        errors, deviations = self._predicted()
        inside = np.abs(errors) <= DEVIATIONS * deviations
        found = {}
        for i, (name, unit) in enumerate(ESTIMATED[: errors.shape[1]]):
            found[f"{name}_rmse_{unit}"] = 1e3 * float(np.sqrt(np.mean(errors[:, i] ** 2)))
            found[f"{name}_median_{unit}"] = 1e3 * float(np.median(np.abs(errors[:, i])))
            found[f"{name}_covered"] = float(inside[:, i].mean())
        return found

    def calibration(self) -> tuple[float, ...]:
        """Factors on the deviations with which 90 % of the validation's errors are inside."""
        errors, deviations = self._predicted()
        return tuple((np.quantile(np.abs(errors) / deviations, 0.90, axis=0) / DEVIATIONS).tolist())

    def network(self, calibration: tuple[float, ...] | None = None) -> VelocityNetwork:
        """As numpy runs it."""
        settings, variant = self.settings, self.variant
        described = NetworkDescription(
            FORMAT, self.name, variant.inputs, variant.base, CONTROL_INTERVAL, Sensors().period,
            calibration or tuple(np.ones(len(self._scales)).tolist()), asdict(settings) | {"version": __version__},
            settings.layers, variant.place,
        )  # fmt: skip
        numbers = {name: value.detach().cpu().numpy().copy() for name, value in self.model.state_dict().items()}
        layers = tuple(
            RecurrentLayer(*(numbers[f"memory.{kind}_l{place}"] for kind in _WEIGHTS))
            for place in range(settings.layers)
        )
        output = (numbers["output.weight"], numbers["output.bias"])
        return VelocityNetwork(described, layers, *output, self._mean, self._deviation, settings.clip)

    def _keep(self) -> None:
        state = {"model": self.model.state_dict(), "optimiser": self._optimiser.state_dict()}
        with atomic_path(self.folder / "checkpoint.pt") as temporary:
            torch.save(state | {"record": json.dumps(self._record())}, temporary)

    def _record(self) -> dict[str, Any]:
        return {
            "name": self.name, "settings": asdict(self.settings), "course": self.course,
            "seconds": self.seconds, "device": self.device, "begun": self._begun,
        }  # fmt: skip

    def _resume(self) -> None:
        file = self.folder / "checkpoint.pt"
        if not file.is_file():
            return
        state: Mapping[str, Any] = torch.load(file, weights_only=True, map_location=self._device)
        record = json.loads(state["record"])
        record["settings"] = asdict(VelocitySettings()) | record["settings"]
        mine = self._record()
        if any(record.get(name) != mine[name] for name in ("name", "settings", "device")):
            raise InputError(f"{file} is of a training with other settings: give another folder.")
        if record.get("begun", mine["begun"]) != mine["begun"]:
            raise InputError(f"{file} went on from another {self.settings.begun} than is here: give another folder.")
        self.model.load_state_dict(state["model"])
        self._optimiser.load_state_dict(state["optimiser"])
        self.course, self.seconds = record["course"], record["seconds"]
