"""A flexible learned model of the same inputs: how good a forecast of these drives can get without any physics.

A gated recurrent unit reads the commands before a window and in it, and the motion at its start; it gives wheel speeds,
forward speed and yaw rate at every sample, and position and heading are their integrals. It is trained on windows of
the other drives and on their mirror images, several times from other seeds, and the mean of these is taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.identification.windows import CHANNELS, STATE, WindowSet

Array = NDArray[np.float64]

HIDDEN = 64  # units of the recurrent layer; 32 and 128 were not better on the open drives
EPOCHS = 60
BATCH = 64
RATE = 3e-3  # of Adam, falling to nothing along a cosine
MEMBERS = 3  # networks whose mean is the forecast
HUBER = 1.0  # standard deviations from which the loss is linear
OUTPUTS = ("encoder_right", "encoder_left", "yaw_rate", "speed")
_MIRROR_OUTPUT = ([1, 0, 2, 3], np.array([1.0, 1.0, -1.0, 1.0]))
_OMEGA = [STATE.index("omega_right"), STATE.index("omega_left")]
_YAW_RATE, _FORWARD = STATE.index("yaw_rate"), STATE.index("v_x")


@dataclass(frozen=True, eq=False)
class Examples:
    """What the network sees, and what it is to say.

    Attributes:
        inputs: (W, H + T, 6) commands, and the motion at the start at every sample, each over its spread.
        targets: (W, T, 4) in the order of OUTPUTS over their spreads; NaN where nothing measures them.
    """

    inputs: Array
    targets: Array

    def mirrored(self) -> Examples:
        """The same drives with right and left exchanged."""
        places, signs = _MIRROR_OUTPUT
        inputs = self.inputs[..., [1, 0, 3, 2, 4, 5]] * np.array([1.0, 1.0, 1.0, 1.0, -1.0, 1.0])
        return Examples(inputs, self.targets[..., places] * signs)

    def with_mirrored(self) -> Examples:
        """Both."""
        other = self.mirrored()
        return Examples(np.concatenate([self.inputs, other.inputs]), np.concatenate([self.targets, other.targets]))


@dataclass(frozen=True)
class Scales:
    """Spreads by which inputs and outputs are divided: of wheel speeds [rad/s], yaw rates [rad/s], speeds [m/s]."""

    wheel: float
    yaw_rate: float
    speed: float

    @property
    def outputs(self) -> Array:
        """In the order of OUTPUTS."""
        return np.array([self.wheel, self.wheel, self.yaw_rate, self.speed])


def scales_of(windows: WindowSet, wheel_radius: float) -> Scales:
    """Spreads of some windows."""
    wheel = float(np.nanstd(windows.commands))
    return Scales(wheel, float(np.nanstd(windows.measured[..., CHANNELS.index("yaw_rate")])), wheel_radius * wheel)


def examples(windows: WindowSet, scales: Scales) -> Examples:
    """Inputs and targets of some windows; the speed is that of the poses between their samples."""
    commands = windows.commands[:, : windows.history + windows.samples] / scales.wheel
    start = np.concatenate(
        [
            windows.initial[:, _OMEGA] / scales.wheel,
            windows.initial[:, [_YAW_RATE]] / scales.yaw_rate,
            windows.initial[:, [_FORWARD]] / scales.speed,
        ],
        axis=1,
    )
    inputs = np.concatenate([commands, np.repeat(start[:, None], commands.shape[1], axis=1)], axis=2)
    measured = windows.measured[..., [CHANNELS.index(name) for name in OUTPUTS[:3]]]
    return Examples(inputs, np.concatenate([measured, _speeds(windows)[..., None]], axis=2) / scales.outputs)


def _speeds(windows: WindowSet) -> Array:
    """Distance between successive poses over their time, (W, T), at the later one [m/s], signed by the commands."""
    found = np.full(windows.measured.shape[:2], np.nan)
    places = windows.measured[..., [CHANNELS.index("pose_x"), CHANNELS.index("pose_y")]]
    for w in range(windows.count):
        rows = np.flatnonzero(np.isfinite(places[w]).all(axis=1))
        if rows.size < 2:
            continue
        steps = np.linalg.norm(np.diff(places[w, rows], axis=0), axis=1) / (np.diff(rows) * windows.period)
        now = windows.drive()[w, rows[1:]].sum(axis=1)
        found[w, rows[1:]] = steps * np.where(now < 0.0, -1.0, 1.0)
    return found


def learned_forecast(
    training: WindowSet, judged: WindowSet, wheel_radius: float, seed: int, members: int = MEMBERS, epochs: int = EPOCHS
) -> Array:
    """Channels (W, T, 8) of windows by networks that were trained on others.

    Args:
        training: windows of the same length and history.
        judged: to forecast.
        wheel_radius: hub to tread [m].
        seed: of the first network; each gets one of its own.
        members: networks.
        epochs: of training.
    """
    scales = scales_of(training, wheel_radius)
    seen, asked = examples(training, scales).with_mirrored(), examples(judged, scales)
    given = [_train_and_ask(seen, asked, seed + k, epochs) for k in range(members)]
    return _channels(judged, np.mean(given, axis=0) * scales.outputs)


def _train_and_ask(seen: Examples, asked: Examples, seed: int, epochs: int) -> Array:
    """(W, T, 4) outputs of one network."""
    import torch

    torch.manual_seed(seed)
    network = torch.nn.GRU(seen.inputs.shape[2], HIDDEN, batch_first=True)
    head = torch.nn.Linear(HIDDEN, len(OUTPUTS))
    weights = [*network.parameters(), *head.parameters()]
    steps = epochs * -(-len(seen.inputs) // BATCH)
    optimiser = torch.optim.Adam(weights, lr=RATE)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps)
    inputs, targets = (torch.tensor(item, dtype=torch.float32) for item in (seen.inputs, seen.targets))
    known = torch.isfinite(targets)
    loss_of = torch.nn.HuberLoss(delta=HUBER, reduction="none")
    rng = np.random.default_rng(seed)
    for _ in range(epochs):
        for rows in np.array_split(rng.permutation(len(inputs)), -(-len(inputs) // BATCH)):
            said = head(network(inputs[rows])[0][:, -targets.shape[1] :])
            loss = loss_of(said, torch.nan_to_num(targets[rows]))[known[rows]].mean()
            optimiser.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(weights, 1.0)
            optimiser.step()
            schedule.step()
    with torch.no_grad():
        said = head(network(torch.tensor(asked.inputs, dtype=torch.float32))[0][:, -targets.shape[1] :])
    return np.asarray(said.numpy(), dtype=np.float64)


def _channels(windows: WindowSet, outputs: Array) -> Array:
    """Channels in their order from OUTPUTS (W, T, 4), position and heading integrated from the windows' starts."""
    found = np.full((*outputs.shape[:2], len(CHANNELS)), np.nan)
    for k, name in enumerate(OUTPUTS[:3]):
        found[..., CHANNELS.index(name)] = outputs[..., k]
    x, y, yaw = windows.initial[:, :3].T[..., None]
    turned = np.cumsum(outputs[..., 2], axis=1) * windows.period
    middle = yaw + turned - 0.5 * outputs[..., 2] * windows.period
    moved = outputs[..., 3] * windows.period
    found[..., CHANNELS.index("pose_x")] = x + np.cumsum(moved * np.cos(middle), axis=1)
    found[..., CHANNELS.index("pose_y")] = y + np.cumsum(moved * np.sin(middle), axis=1)
    found[..., CHANNELS.index("pose_yaw")] = yaw + turned
    return found


def training_windows(windows: WindowSet, left_out: int, first_half: bool) -> WindowSet:
    """Windows that a forecast of one drive may learn from: the other drives', and where the calibration may, its half.

    Args:
        windows: of all drives.
        left_out: number of the drive that is forecast.
        first_half: whether the first half of that drive may be seen, as where its ground is no other drive's.
    """
    own = windows.recording == left_out
    seen: NDArray[np.bool_] = ~own
    if first_half:
        seen |= own & (windows.time < np.median(windows.time[own]))
    return windows.subset(seen)
