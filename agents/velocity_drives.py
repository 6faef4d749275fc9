"""Simulated turns from which the learned estimator learns: drawn plants and controllers, kept as arrays in parts.

Soils, robots, sensors and ground are drawn from what the scenario sets S1 to S8 describe, and wider; no frozen scenario
is read. Theory: filter, section 11.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ddagr_gym.control.pid import PidGains
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.control.timing import CONTROL_INTERVAL, CONTROL_PERIOD
from ddagr_gym.envs.constants import EPISODE_STEPS
from ddagr_gym.envs.options import make_settings
from ddagr_gym.envs.settings import Episode, Randomisation, TurnSettings
from ddagr_gym.errors import InputError
from ddagr_gym.estimation import CHANNELS, DeadReckoning, InertialBatch, InertialModel
from ddagr_gym.estimation.layout import COMMANDS
from ddagr_gym.estimation.learned_inputs import INPUTS, MEMORY_SIZE, Filtered, block_inputs, mean_rim_speed
from ddagr_gym.evaluation.controllers import find_controller, make_path_tracker
from ddagr_gym.evaluation.ladder_gains import LadderGains, ladder_gains
from ddagr_gym.evaluation.runs import Controller, drive_turn
from ddagr_gym.files import atomic_path, write_json
from ddagr_gym.parameters import Drivetrain, Sensors
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.lateral_bulldozing import LateralBulldozing
from ddagr_gym.physics.effects.multipass import Multipass
from ddagr_gym.physics.effects.payload import Payload
from ddagr_gym.physics.effects.slip_sinkage import SlipSinkage
from ddagr_gym.physics.effects.slope import Slope
from ddagr_gym.physics.effects.soil_change import SoilChange
from ddagr_gym.physics.effects.soil_patch import SoilPatch
from ddagr_gym.physics.effects.soil_split import SoilSplit
from ddagr_gym.physics.lateral_scale import LateralScale
from ddagr_gym.presets import ddagr
from ddagr_gym.tasks import Task, TaskRunner, run_tasks

Array = NDArray[np.float64]
Rng = np.random.Generator

PART = 50
"""Turns in one part: what an interrupted run loses at most."""
_LEAST_SHARE = 22.0  # [s] of an episode's 25 s that a turn may plan for
_SLOW_MOTOR_RATE = 1.4  # [1/s] thesis, retuned


@dataclass(frozen=True)
class Plan:
    """How often and how far a drawn turn differs from the nominal task (shares of turns; ranges are even draws).

    Attributes:
        other_soil: share on soils weaker or stiffer than the range.
        other_size: share of other radii and speeds.
        stressed: share with sensors at their data sheets' limits.
        slow: share with slow motors and dead time.
        late: share with further dead time.
        loaded: share with a payload.
        sloping: share on a slope.
        lateral: share with scaled lateral forces.
        changing: share with soil that changes during the drive.
        weak: share with motors that the ground slows down, with a limited torque.
        one_sided: share with a payload at a place on the platform.
        patched: share with a patch of other soil on the turn.
        split: share with another soil on one side than on the other.
        worked: share with ruts, wheels that dig in, or soil that their sides push.
    """

    other_soil: float = 0.25
    other_size: float = 0.35
    stressed: float = 0.10
    slow: float = 0.10
    late: float = 0.35
    loaded: float = 0.35
    sloping: float = 0.55
    lateral: float = 0.50
    changing: float = 0.40
    weak: float = 0.0
    one_sided: float = 0.0
    patched: float = 0.0
    split: float = 0.0
    worked: float = 0.0


NOMINAL = Plan(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""The task as it is: no turn differs."""

WIDE = Plan(
    other_soil=0.25, other_size=0.30, stressed=0.35, slow=0.10, late=0.30, loaded=0.30, sloping=0.35, lateral=0.35,
    changing=0.30, weak=0.12, one_sided=0.20, patched=0.12, split=0.15, worked=0.20,
)  # fmt: skip
"""Robots, grounds and sensors that trouble a network which learnt from :class:`Plan` as it is."""


def draw_turn(rng: Rng, plan: Plan = Plan()) -> tuple[TurnSettings, Episode]:
    """Settings with the effects of a turn, and its episode."""
    soil = str(rng.choice(["weaker", "stiffer"])) if rng.random() < plan.other_soil else "thesis_a1_range"
    radius, speed = 0.80, 0.20
    if rng.random() < plan.other_size:
        radius = float(rng.uniform(0.65, 1.2))
        speed = float(rng.uniform(max((1.0 + math.pi * radius) / _LEAST_SHARE, 0.15), 0.30))
    spread = Randomisation(soil_variation=float(rng.uniform(0.0, 0.10)))
    settings = make_settings(soil=soil, radius=radius, speed=speed, randomisation=spread)
    episode = settings.draw(rng)
    if rng.random() < plan.stressed:
        episode = _stressed(episode, rng)
    if rng.random() < plan.slow:
        robot = replace(episode.robot, motor_rate=_SLOW_MOTOR_RATE)
        episode = replace(episode, robot=robot, command_delay=float(rng.uniform(0.05, 0.25)))
    elif rng.random() < plan.late:
        episode = replace(episode, command_delay=episode.command_delay + float(rng.uniform(0.0, 0.15)))
    if rng.random() < plan.loaded:
        mass = episode.robot.mass * float(rng.uniform(0.9, 1.25))
        episode = replace(episode, robot=replace(episode.robot, mass=mass))
    effects = _effects(episode, rng, plan)
    if plan.weak and rng.random() < plan.weak:
        episode = _weakened(episode, rng)
    return replace(settings, effects=(*effects, *_further_effects(episode, rng, plan))), episode


def _stressed(episode: Episode, rng: Rng) -> Episode:
    """Biases, scales and noise several times the usual, as in set S5."""
    imu, encoder = episode.sensors.imu, episode.sensors.encoder
    times = float(rng.uniform(1.0, 4.0))
    imu = replace(
        imu,
        gyro_bias=float(rng.normal(0.0, 2e-3 * times)),
        gyro_scale=float(rng.uniform(0.97, 1.03)),
        gyro_noise=times * imu.gyro_noise,
        accelerometer_noise=times * imu.accelerometer_noise,
        accelerometer_bias=(float(rng.normal(0.0, 0.06 * times)), float(rng.normal(0.0, 0.06 * times))),
    )
    encoder = replace(encoder, scale=(float(rng.uniform(0.98, 1.02)), float(rng.uniform(0.98, 1.02))))
    return replace(episode, sensors=replace(episode.sensors, imu=imu, encoder=encoder))


def _effects(episode: Episode, rng: Rng, plan: Plan) -> tuple[Effect, ...]:
    turn, found = episode.turn, []
    if rng.random() < plan.sloping:
        found.append(Slope(math.radians(float(rng.uniform(0.0, 6.0))), float(rng.uniform(-math.pi, math.pi))))
    if rng.random() < plan.lateral:
        found.append(LateralScale(float(rng.uniform(0.75, 1.3))))
    if rng.random() < plan.changing:
        strength, stiffness = np.exp(rng.uniform(math.log(0.6), math.log(1.6), 2))
        duration = (turn.run_in + turn.turn_length + turn.run_out) / turn.speed
        found.append(SoilChange(float(strength), float(stiffness), float(rng.uniform(0.15, 0.85)) * duration))
    return tuple(found)


def _weakened(episode: Episode, rng: Rng) -> Episode:
    """Banks that the ground slows down, with 40 to 200 N m at standstill: from none to all of what turns need."""
    drivetrain = Drivetrain(
        load_compliance=float(rng.uniform(0.1, 0.3)),
        integral_rate=30.0,
        integral_limit=12.0,
        acceleration_limit=float(rng.uniform(12.0, 20.0)),
        no_load_speed=4.0,
    )
    return replace(episode, robot=replace(episode.robot, drivetrain=drivetrain))


def _further_effects(episode: Episode, rng: Rng, plan: Plan) -> list[Effect]:
    """Effects drawn after all else, so that the draws of plans without them stay as they are."""
    found: list[Effect] = []
    if plan.one_sided and rng.random() < plan.one_sided:
        x, y = (float(value) for value in rng.uniform((-0.25, -0.2), (0.25, 0.2)))
        found.append(Payload(float(rng.uniform(5.0, 50.0)), x, y))
    if plan.patched and rng.random() < plan.patched:
        found.append(_patch(episode.turn, rng))
    if plan.split and rng.random() < plan.split:
        found.append(SoilSplit(float(np.exp(rng.uniform(-0.3, 0.3)))))
    if plan.worked and rng.random() < plan.worked:
        size, kind = float(rng.uniform(0.0, 0.5)), int(rng.integers(3))
        found.append((Multipass(size), SlipSinkage(size), LateralBulldozing(3.0 * size))[kind])
    return found


def _patch(turn: RowTurn, rng: Rng) -> SoilPatch:
    """Other soil between 30 and 150 degrees of the turn."""
    angle = math.radians(float(rng.uniform(30.0, 150.0)))
    x, y = turn.place_on_turn(angle).tolist()
    strength = float(np.exp(rng.uniform(math.log(0.5), math.log(1.6))))
    return SoilPatch(strength, centre_x=x, centre_y=y, radius=float(rng.uniform(0.3, 0.7)), edge=0.1)


class WanderingController:
    """A controller that stands first and whose commands wander: what it drives is not only what it would drive.

    Args:
        inner: drives.
        standing: control periods for which it stands before.
        seed: of what is added.
        common: deviation of the speed of both banks, over their maximum.
        opposite: deviation of their difference.
        time: in which either is forgotten [s].
    """

    def __init__(
        self, inner: Controller, standing: int, seed: int, common: float, opposite: float, time: float
    ) -> None:
        self._inner, self._standing, self._seed = inner, standing, seed
        self._deviations, self._share = np.array([common, opposite]), math.exp(-CONTROL_PERIOD / time)
        self.reset()

    def reset(self) -> None:
        """Forget the last episode."""
        self._inner.reset()
        self._rng, self._added, self._stood = np.random.default_rng(self._seed), np.zeros(2), 0

    def __call__(self, observation: ArrayLike, info: Any = None) -> NDArray[np.float32]:
        """Action (2,)."""
        if self._stood < self._standing:
            self._stood += 1
            return np.zeros(2, dtype=np.float32)
        fresh = math.sqrt(1.0 - self._share**2) * self._rng.standard_normal(2)
        self._added = self._share * self._added + fresh * self._deviations
        common, opposite = self._added
        wanted = self._inner(observation, info)
        if not wanted.any():  # it stands by itself
            return wanted
        action = wanted + np.array([common + opposite, common - opposite])
        return np.clip(action, -1.0, 1.0).astype(np.float32)


def _drawn_gains(rng: Rng) -> LadderGains:
    """Gains of B4 and B6 by factors from a half to two."""
    gains = ladder_gains()

    def factor() -> float:
        return float(np.exp(rng.uniform(math.log(0.5), math.log(2.0))))

    def drawn(loop: PidGains) -> PidGains:
        return replace(loop, proportional=loop.proportional * factor(), integral=loop.integral * factor())

    balance, tracker = gains.force_balance, gains.path_tracker
    return replace(
        gains,
        force_balance=replace(balance, gains=drawn(balance.gains)),
        path_tracker=replace(tracker, gains=drawn(tracker.gains)),
        path_tracker_course=gains.path_tracker_course * factor(),
        path_tracker_ahead=gains.path_tracker_ahead * factor(),
        path_tracker_aligning=gains.path_tracker_aligning * float(rng.uniform(0.0, 1.3)),
    )


def draw_controller(rng: Rng, episode: Episode) -> tuple[Controller, bool]:
    """A controller for a turn, and whether it needs the filter's features: B6 mostly, B4, or two constants."""
    kind, gains = float(rng.random()), _drawn_gains(rng)
    name = "B6" if kind < 0.6 else "B4" if kind < 0.85 else "B1"
    if name == "B6":
        model = InertialModel.of(ddagr(), Sensors()).with_known_vibration()
        inner = make_path_tracker(DeadReckoning(model), model.flat, int(rng.integers(6, 16)))(episode.turn, gains)
        standing = 0
    else:
        inner, standing = find_controller(name, episode.turn, gains), int(rng.integers(4, 16))
    size = float(rng.choice([0.0, 0.02, 0.06]))
    wandering = (size * float(rng.random()), size * float(rng.random()), float(rng.uniform(0.3, 3.0)))
    return WanderingController(inner, standing, int(rng.integers(2**31)), *wandering), name == "B4"


@dataclass(frozen=True)
class Drives:
    """Turns at their control instants; those that end early are filled up with zeros.

    Attributes:
        inputs: (D, B, len(INPUTS)) of the learned estimator.
        truth: (D, B, 2) true v_x, v_y [m/s].
        rims: (D, B) mean rim speed [m/s].
        filtered: (D, B, 2) the inertial filter's v_x and v_y [m/s].
        places: (D, B, 2) true x and y from where it started, along its first heading [m].
        driving: (D, B) 1 from the first command on, 0 at rest before it and after the end.
        present: (D, B) 1 up to the end.
    """

    inputs: NDArray[np.float32]
    truth: NDArray[np.float32]
    rims: NDArray[np.float32]
    filtered: NDArray[np.float32]
    places: NDArray[np.float32]
    driving: NDArray[np.float32]
    present: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.inputs)

    def part(self, chosen: Any) -> Drives:
        """Some of the drives."""
        return Drives(*(getattr(self, item.name)[chosen] for item in fields(self)))


def _drive(seed: Sequence[int], plan: Plan) -> dict[str, Array]:
    """Columns of one turn; the seed alone decides it."""
    rng = np.random.default_rng(seed)
    settings, episode = draw_turn(rng, plan)
    controller, features = draw_controller(rng, episode)
    settings = replace(settings, ekf_features=features)
    return drive_turn(controller, settings, int(rng.integers(2**31)), episode).columns


def as_drives(columns: Sequence[Mapping[str, Array]]) -> Drives:
    """Turns as the learned estimator sees them; the filter beside it knows the nominal robot and sensors."""
    model = InertialModel.of(ddagr(), Sensors()).with_known_vibration()
    radius, prior = model.flat.outer_radius, model.flat.soil_prior.logs(model.flat.wheel_load)[0]
    count = len(columns)
    commands, readings, truth, places, present = _blocks(columns)
    batch, memory = InertialBatch(model, count), np.zeros((count, MEMORY_SIZE))
    inputs = np.zeros((count, EPISODE_STEPS, len(INPUTS)), dtype=np.float32)
    rims = np.zeros((count, EPISODE_STEPS), dtype=np.float32)
    filtered = np.zeros((count, EPISODE_STEPS, 2), dtype=np.float32)
    for k in range(EPISODE_STEPS):
        given = np.ascontiguousarray(readings[:, k])
        innovations = batch.step(commands[:, k], given)
        own = Filtered(batch.states, batch.covariances, innovations, batch.poses, batch.pose_covariances)
        inputs[:, k] = block_inputs(memory, commands[:, k], given, own, model.flat.sample_period, radius, prior)
        rims[:, k], filtered[:, k] = mean_rim_speed(given, radius), own.states[:, :2]
    begun = np.maximum.accumulate((np.abs(commands) > 0.0).any(axis=2), axis=1)
    driving = (begun * present).astype(np.float32)
    single = (part.astype(np.float32) for part in (places, driving, present))
    return Drives(inputs, truth.astype(np.float32), rims, filtered, *single)


def _blocks(columns: Sequence[Mapping[str, Array]]) -> tuple[Array, Array, Array, Array, Array]:
    """Commands (D, B, 2), readings (D, B, K, 5), true velocities and places (D, B, 2), presence (D, B)."""
    shape = (len(columns), EPISODE_STEPS)
    commands, truth, places, present = *(np.zeros((*shape, 2)) for _ in range(3)), np.zeros(shape)
    readings = np.zeros((*shape, CONTROL_INTERVAL, len(CHANNELS)))
    for d, own in enumerate(columns):
        blocks = len(own["t"]) // CONTROL_INTERVAL
        size = blocks * CONTROL_INTERVAL
        sampled = np.column_stack([own[name][:size] for name in CHANNELS])
        readings[d, :blocks] = sampled.reshape(blocks, CONTROL_INTERVAL, -1)
        ends = slice(CONTROL_INTERVAL - 1, size, CONTROL_INTERVAL)
        commands[d, :blocks] = np.column_stack([own[name][ends] for name in COMMANDS])
        truth[d, :blocks] = np.column_stack([own["true_v_x"][ends], own["true_v_y"][ends]])
        places[d, :blocks] = _from_start(own)[ends]
        present[d, :blocks] = 1.0
    return commands, readings, truth, places, present


def _from_start(columns: Mapping[str, Array]) -> Array:
    """True x and y (T, 2) from where a robot started, along its first heading [m]; it stands at the first sample."""
    x, y, yaw = (columns[f"true_{name}"] for name in ("x", "y", "yaw"))
    cosine, sine, along, across = math.cos(yaw[0]), math.sin(yaw[0]), x - x[0], y - y[0]
    return np.column_stack([cosine * along + sine * across, cosine * across - sine * along])


def make_drives(count: int, root_seed: int, folder: Path, plan: Plan = Plan(), workers: int = 1) -> Drives:
    """Turns 0 to ``count - 1`` of a root seed; parts that the folder holds are not driven again.

    Args:
        count: of turns.
        root_seed: of all.
        folder: of the parts.
        plan: of the draws.
        workers: processes that drive; the turns are the same with any number.

    Raises:
        InputError: the folder holds turns of another seed or plan.
    """
    _check_same(folder, {"root_seed": root_seed, "plan": asdict(plan), "inputs": list(INPUTS)})
    wanted = [range(first, min(first + PART, count)) for first in range(0, count, PART)]
    files = [folder / f"turns_{numbers[0]}_to_{numbers[-1]}.npz" for numbers in wanted]
    missing = [(numbers, file) for numbers, file in zip(wanted, files, strict=True) if not file.is_file()]
    tasks = [Task(file.stem, _make_part, (root_seed, plan, numbers, file)) for numbers, file in missing]
    with TaskRunner(min(workers, max(len(tasks), 1))) as runner:
        run_tasks(tasks, "driving", runner)
    parts = []
    for file in files:
        with np.load(file, allow_pickle=False) as stored:
            parts.append(Drives(**{name: stored[name] for name in stored.files}))
    return joined_drives(parts)


def joined_drives(parts: Sequence[Drives]) -> Drives:
    """The drives of all parts, in their order."""
    return Drives(*(np.concatenate([getattr(part, item.name) for part in parts]) for item in fields(Drives)))


def _make_part(root_seed: int, plan: Plan, numbers: range, file: Path) -> None:
    """Drive the turns of one part into its file; workers call it by name."""
    own = as_drives([_drive([root_seed, number], plan) for number in numbers])
    with atomic_path(file) as temporary:
        np.savez(temporary, **{item.name: getattr(own, item.name) for item in fields(own)})


def _check_same(folder: Path, settings: Mapping[str, Any]) -> None:
    file = folder / "drives.json"
    stored = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else settings
    # what a plan had not when they were driven it had not in them
    if stored | {"plan": asdict(Plan()) | stored.get("plan", {})} != settings:
        raise InputError(f"{folder} holds turns of another seed or plan: give another folder.")
    write_json(file, settings)
