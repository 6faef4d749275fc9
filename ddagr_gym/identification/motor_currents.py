"""Motor currents as evidence: what they measure of a simulated drive, with their unknown constants.

With the torque T of a bank's motors at the wheels and the bank's speed w (theory: drivetrain, section 5),

    motors' own current       i = g T + c,                                                                        (1)
    drawn from the supply     i = g (T w + r T^2) + c.                                                              (2)

The gain g and the offset c of each bank and the loss r of the robot are unknown; their priors say no more than their
order of magnitude. They are parameters of the fit like all others, so that what is left of the currents' information
on the robot and the ground is free of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.parameters import CURRENT, ModelParameter
from ddagr_gym.identification.windows import CHANNELS, WindowSet
from ddagr_gym.parameters import STANDARD_GRAVITY, Robot
from ddagr_gym.recordings.channels import CURRENTS, VOLTAGES
from ddagr_gym.recordings.checks.currents import CurrentKind, current_kind, wrong_sign
from ddagr_gym.recordings.schema import Recording

Array = NDArray[np.float64]

BANKS = ("right", "left")

GAIN_DEVIATION = 10.0
"""Prior deviation of a gain, over its first guess (ours): no more than an order of magnitude is known."""

LARGEST_GAIN = 100.0
"""Over its first guess (ours)."""

SMALLEST_GAIN = 0.01
"""Over its first guess (ours): a current that goes the other way has the wrong sign, which the checks say."""

USUAL_VOLTAGE = 24.0
"""Of a supply whose voltage was not recorded [V] (ours): it is only a first guess of a gain."""

USUAL_LOAD = 0.1
"""Torque of a driving bank over that which would lift half of the robot (ours): it is only a first guess of a gain."""

NOISE_SHARE = 0.01
"""Least standard deviation of a current, over its root mean square (ours): a current sensor's class."""


@dataclass(frozen=True)
class CurrentModel:
    """How a robot's currents follow from its drive.

    Attributes:
        kind: what they measure.
        gain: first guesses of g of both banks, [A/(N m)] or [A/W].
        scale: root mean square of the currents of both banks [A].
        loss: scale of r [rad/s/(N m)].
    """

    kind: CurrentKind
    gain: tuple[float, float]
    scale: tuple[float, float]
    loss: float

    @property
    def parameters(self) -> tuple[ModelParameter, ...]:
        """Unknown constants: gains over their first guess less 1, offsets [A], and the loss over its scale."""
        made = []
        for bank, scale in zip(BANKS, self.scale, strict=True):
            low, high = SMALLEST_GAIN - 1.0, LARGEST_GAIN - 1.0
            made.append(_constant(f"{CURRENT}gain_{bank}", "-", GAIN_DEVIATION, 0.02, low, high))
            offset = max(scale, np.finfo(float).tiny)
            made.append(_constant(f"{CURRENT}offset_{bank}", "A", offset, 0.02 * offset, -10.0 * offset, 10.0 * offset))
        if self.kind is CurrentKind.SUPPLY:
            made.append(_constant(f"{CURRENT}loss", "-", 1.0, 0.02, 0.0, 10.0))
        return tuple(made)

    def currents(self, torque: Array, speed: Array, values: Mapping[str, float]) -> Array:
        """Currents (..., 2) [A] of both banks, equations (1) and (2).

        Args:
            torque: (..., 2) of the motors at the wheels [N m].
            speed: (..., 2) of the banks [rad/s].
            values: of the constants by name; 0 for those that are missing.
        """
        drawn = torque
        if self.kind is CurrentKind.SUPPLY:
            drawn = torque * speed + self.loss * values.get(f"{CURRENT}loss", 0.0) * torque**2
        gain = [g * (1.0 + values.get(f"{CURRENT}gain_{bank}", 0.0)) for g, bank in zip(self.gain, BANKS, strict=True)]
        offset = [values.get(f"{CURRENT}offset_{bank}", 0.0) for bank in BANKS]
        return np.asarray(np.array(gain) * drawn + np.array(offset))

    def derivative(self, name: str, base: Array, values: Mapping[str, float]) -> Array | None:
        """Derivative of a prediction (W, T, 10) to a gain or an offset; None for what has to be simulated.

        Args:
            name: of the parameter.
            base: the prediction.
            values: of the constants by name.
        """
        bank = next((k for k, side in enumerate(BANKS) if name.startswith(CURRENT) and name.endswith(side)), None)
        if bank is None:
            return None
        found = np.zeros(base.shape)
        channel = len(CHANNELS) + bank
        if name.startswith(f"{CURRENT}offset"):
            found[..., channel] = 1.0
        else:
            offset = values.get(f"{CURRENT}offset_{BANKS[bank]}", 0.0)
            found[..., channel] = (base[..., channel] - offset) / (1.0 + values.get(name, 0.0))
        return found

    def constants(self, values: Mapping[str, float]) -> dict[str, float]:
        """Constants in SI units by name: gains [A/(N m)] or [A/W], offsets [A], the loss [rad/s/(N m)]."""
        found = {}
        for bank, gain in zip(BANKS, self.gain, strict=True):
            found[f"{CURRENT}gain_{bank}"] = gain * (1.0 + values.get(f"{CURRENT}gain_{bank}", 0.0))
            found[f"{CURRENT}offset_{bank}"] = values.get(f"{CURRENT}offset_{bank}", 0.0)
        if self.kind is CurrentKind.SUPPLY:
            found[f"{CURRENT}loss"] = self.loss * values.get(f"{CURRENT}loss", 0.0)
        return found

    def unit(self, name: str) -> str:
        """SI unit of a constant."""
        if name.startswith(f"{CURRENT}offset"):
            return "A"
        if name == f"{CURRENT}loss":
            return "rad/s/(N m)"
        return "A/W" if self.kind is CurrentKind.SUPPLY else "A/(N m)"

    def of_one(self, name: str) -> float:
        """What a change of 1 of a parameter is of its constant, in SI units."""
        if name.startswith(f"{CURRENT}offset"):
            return 1.0
        return self.loss if name == f"{CURRENT}loss" else self.gain[0 if name.endswith(BANKS[0]) else 1]


def _constant(name: str, unit: str, prior: float, step: float, low: float, high: float) -> ModelParameter:
    return ModelParameter(name, unit, (), False, prior, step, low, high)


def current_model(
    recordings: Sequence[Recording], robot: Robot, rng: np.random.Generator
) -> tuple[CurrentModel | None, tuple[str, ...]]:
    """Model of the currents of some recordings of a robot, and why there is none where they have currents.

    Args:
        recordings: of the robot; those without currents count for nothing.
        robot: for the order of magnitude of its torque.
        rng: of the resampled intervals of the checks.
    """
    measured = [recording for recording in recordings if recording.has(*CURRENTS)]
    if not measured:
        return None, ()
    wrong = [f"{r.meta.source}: {name}" for r in measured for name in CURRENTS if wrong_sign(r, name, rng)]
    if wrong:
        return None, (f"the currents are left out: {', '.join(wrong)} has the wrong sign.",)
    kinds = {kind for kind in (current_kind(recording, rng) for recording in measured) if kind is not None}
    if len(kinds) != 1:
        why = "their signs do not say whether they are the motors' own or those of the supply"
        why = "they are the motors' own in one drive and those of the supply in another" if kinds else why
        return None, (f"the currents are left out: {why}.",)
    return _guess(measured, kinds.pop(), robot), ()


def _guess(recordings: Sequence[Recording], kind: CurrentKind, robot: Robot) -> CurrentModel:
    """First guesses by the size of the readings."""
    scale = tuple(float(np.sqrt(np.nanmean(np.concatenate([r[name] for r in recordings]) ** 2))) for name in CURRENTS)
    lifting = 0.5 * robot.mass * STANDARD_GRAVITY * robot.outer_radius
    if kind is CurrentKind.MOTOR:
        gain = tuple(max(size, np.finfo(float).tiny) / (USUAL_LOAD * lifting) for size in scale)
    else:
        gain = (1.0 / _voltage(recordings),) * 2
    return CurrentModel(kind, (gain[0], gain[1]), (scale[0], scale[1]), robot.maximum_wheel_speed / lifting)


def _voltage(recordings: Sequence[Recording]) -> float:
    """Median of the recorded voltages [V]."""
    values = np.concatenate([recording[name] for recording in recordings for name in VOLTAGES])
    values = values[np.isfinite(values) & (values > 0.0)]
    return float(np.median(values)) if values.size else USUAL_VOLTAGE


def with_currents(windows: WindowSet, recordings: Sequence[Recording]) -> WindowSet:
    """Windows that also compare the currents: measured (W, T, 10).

    Args:
        windows: cut from these recordings.
        recordings: that they were cut from.
    """
    rows = windows.start[:, None] + 1 + np.arange(windows.samples)
    found = np.full((windows.count, windows.samples, len(CURRENTS)), np.nan)
    for number, recording in enumerate(recordings):
        own = windows.recording == number
        for channel, name in enumerate(CURRENTS):
            found[own, :, channel] = recording[name][rows[own]]
    return replace(windows, measured=np.concatenate([windows.measured, found], axis=2))


def without_currents(windows: WindowSet) -> WindowSet:
    """The same windows with the eight channels that every simulator predicts."""
    return replace(windows, measured=windows.measured[..., : len(CHANNELS)])


def current_noise(model: CurrentModel, windows: WindowSet) -> Array:
    """(W, 1, 2) least standard deviations of the currents [A]; what a fit leaves unexplained makes them larger."""
    return np.broadcast_to(NOISE_SHARE * np.maximum(model.scale, np.finfo(float).tiny), (windows.count, 1, 2))
