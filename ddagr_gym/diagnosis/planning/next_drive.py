"""What to drive next: the manoeuvre of a bank in which the remaining rivals would differ most.

Each rival is taken for the truth at its fitted size. What it would do to the readings of a manoeuvre is then explained
as well as possible by another rival, whose size, with the windows' unknowns and the nominal parameters, is refitted
linearly. Half the square of what is left over the noise is the gain by which the right name would lead; it is compared
per minute of driving.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ddagr_gym.control.manoeuvres import MANOEUVRES, Manoeuvre
from ddagr_gym.diagnosis.answer.channel_faults import CHANNEL_FAULT_TITLES
from ddagr_gym.diagnosis.answer.next_drive_plan import DriveProposal, NextDrivePlan
from ddagr_gym.diagnosis.answer.verdict import Diagnosis, Finding, Options
from ddagr_gym.diagnosis.planning.isolability import APART
from ddagr_gym.diagnosis.planning.planned_drive import RATE, SENSORS, Plan, plan, with_room
from ddagr_gym.diagnosis.preprocessing.session import DiagnosisSession
from ddagr_gym.diagnosis.search.candidates import Candidate, candidates_of
from ddagr_gym.diagnosis.search.initial_guess import looped
from ddagr_gym.diagnosis.search.scan import drive_extent, probe_columns
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.errors import InputError
from ddagr_gym.identification.least_squares import explained_by
from ddagr_gym.identification.nuisances import NuisancePriors
from ddagr_gym.identification.size_prior import TYPICAL_MULTIPLE
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.parameters import Imu, Robot, Sensors, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.encoder_scale import EncoderScale
from ddagr_gym.physics.effects.registry import effect_kind
from ddagr_gym.physics.effects.wheel_radius_mismatch import WheelRadiusMismatch
from ddagr_gym.simulator import simulate

Array = NDArray[np.float64]

SEEN_IN_VALUES = ("sensor_hold", *CHANNEL_FAULT_TITLES)
"""Names that no drive needs to tell from others."""

MOST_RIVALS = 5
"""Rivals that are compared: those with most weight."""

MOST_MINUTES = 30.0
"""Driving that is asked of nobody to tell two names apart (ours)."""

_ALTERNATIVES = 3
"""Manoeuvres that are listed beside the best, at most (ours: a short list to choose from)."""

_NOTHING = 1e-12
"""Gain per minute, and information, below which there is nothing but rounding."""


@dataclass(frozen=True, eq=False)
class _Columns:
    """Projected sensitivities of a plan's windows.

    Attributes:
        table: (W, M + S, P + K) nuisances, then effects at their sizes and their probes.
        precision: (P,).
        whole: column of each rival at its size.
        probes: columns of each rival's candidates, with the precision of their multiples.
    """

    table: Array
    precision: Array
    whole: tuple[int, ...]
    probes: tuple[tuple[tuple[tuple[int, ...], Array], ...], ...]


@dataclass(frozen=True)
class _Separation:
    """Of a pair in a manoeuvre.

    Attributes:
        gain: of the right name over the wrong one.
        channels: (8,) shares of the channels in it.
    """

    gain: float
    channels: tuple[float, ...]


def next_drive(
    robot: Robot,
    soil: Soil,
    rivals: Sequence[Effect],
    *,
    sensors: Sequence[str] = tuple(SENSORS),
    bank: Sequence[Manoeuvre] | None = None,
    seed: int = 0,
    setting: Setting | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> NextDrivePlan:
    """Rank manoeuvres by how well they would tell rivals apart (theory: diagnosis, section 12).

    Args:
        robot: nominal.
        soil: nominal.
        rivals: effects at their fitted sizes; with a single one the manoeuvre is sought that shows it best.
        sensors: names of :data:`ddagr_gym.diagnosis.planning.planned_drive.SENSORS`.
        bank: manoeuvres; all built-in ones by default.
        seed: of the noise whose level is estimated.
        setting: of the diagnosis that shall tell them apart, its windows shortened to the manoeuvres.
        progress: called with what is being done.

    Raises:
        InputError: no rival, or the same one twice.
    """
    _check(rivals)
    manoeuvres = tuple(MANOEUVRES.values()) if bank is None else tuple(bank)
    planned = [_timeless(rival) for rival in rivals]
    place = _place(planned)
    starts = None if place is None else [_towards(place, robot, soil, item) for item in manoeuvres]
    progress("simulating the bank of manoeuvres")
    own = with_room(Setting() if setting is None else setting, manoeuvres)
    prepared = plan(robot, soil, manoeuvres, sensors, starts=starts, seed=seed, setting=own)
    progress("simulating the rivals")
    columns = _columns(prepared, planned)
    found = [_separations(prepared, columns, number, len(planned)) for number in range(len(manoeuvres))]
    return _answer(manoeuvres, planned, found)


def plan_next_drive(session: DiagnosisSession, diagnosis: Diagnosis) -> NextDrivePlan:
    """The drive that would separate the explanations that a diagnosis leaves; without one, why there is none.

    Args:
        session: of the diagnosis.
        diagnosis: its verdict.
    """
    try:
        return next_drive(
            session.robot,
            session.soil,
            rivals_of_diagnosis(diagnosis),
            sensors=sensors_of_diagnosis(diagnosis),
            seed=session.seed,
            setting=session.setting,
            progress=session.progress,
        )
    except InputError as error:
        return NextDrivePlan.none(str(error))


def _check(rivals: Sequence[Effect]) -> None:
    names = [rival.name for rival in rivals]
    if not names:
        raise InputError("no rival is given: name the effects that the next drive shall tell apart.")
    if len(set(names)) < len(names):
        raise InputError(f"the rivals are {', '.join(names)}: give each name once.")


def _timeless(rival: Effect) -> Effect:
    """An effect that began at some time holds from the start of the next drive on."""
    if "onset" in rival.shape_names():
        return rival.with_values(onset=float(rival.parameter("onset").metadata["low"]))
    return rival


def _place(rivals: Sequence[Effect]) -> tuple[float, float] | None:
    """Where the first effect that has a place acts."""
    for rival in rivals:
        if {"centre_x", "centre_y"} <= set(rival.shape_names()):
            values = rival.as_mapping()["parameters"]
            return float(values["centre_x"]), float(values["centre_y"])
    return None


def _towards(place: tuple[float, float], robot: Robot, soil: Soil, manoeuvre: Manoeuvre) -> tuple[float, float, float]:
    """Start from which a manoeuvre passes over a place about half way."""
    suite = Sensors(Imu(sample_rate=RATE))
    columns = simulate(robot, soil, manoeuvre.commands(RATE), sensors=suite)
    middle = len(columns["t"]) // 2
    return place[0] - float(columns["true_x"][middle]), place[1] - float(columns["true_y"][middle]), 0.0


def _columns(prepared: Plan, rivals: Sequence[Effect]) -> _Columns:
    """Simulate every rival at its size and by its probes, and project the windows' unknowns out."""
    problem, fitted = prepared.problem, prepared.fitted
    extent = drive_extent(problem, fitted.prediction)
    free = np.flatnonzero(problem.free)
    columns = list(np.moveaxis(fitted.by_parameter[..., free], 2, 0))
    whole, probes = [], []
    for rival in rivals:
        whole.append(len(columns))
        columns += probe_columns(problem, fitted, [rival])
        own = []
        for candidate in _close(candidates_of(type(rival), extent, 0), rival):
            places = tuple(range(len(columns), len(columns) + len(candidate.probes)))
            columns += probe_columns(problem, fitted, candidate.probes)
            own.append((places, 1.0 / np.array(candidate.scales) ** 2))
        probes.append(tuple(own))
    table = fitted.elimination.project(problem.padded(np.stack(columns, axis=2)))
    return _Columns(table, 1.0 / problem.prior[free] ** 2, tuple(whole), tuple(probes))


def _close(candidates: Sequence[Candidate], rival: Effect) -> list[Candidate]:
    """Candidates that may imitate another effect: none of a flip or limit, which stands where it was fitted."""
    if rival.categorical or not rival.differentiable:
        return []
    if {"centre_x", "centre_y"} <= set(rival.shape_names()):
        return []
    return list(candidates)


def _separations(prepared: Plan, columns: _Columns, number: int, count: int) -> dict[tuple[int, int], _Separation]:
    """By pair (truth, rival) in one manoeuvre; the truth against nothing where it is alone."""
    chosen = prepared.problem.blocked.windows.recording == number
    table = columns.table[chosen]
    flat = table.reshape(-1, table.shape[2])
    total = flat.T @ flat
    pairs = [(a, b) for a in range(count) for b in range(count) if a != b] or [(0, -1)]
    return {pair: _separation(pair, columns, total, table) for pair in pairs}


def _separation(pair: tuple[int, int], columns: _Columns, total: Array, table: Array) -> _Separation:
    """What the best imitation by the rival leaves of the truth."""
    truth = columns.whole[pair[0]]
    groups: list[tuple[tuple[int, ...], Array]] = [((), np.zeros(0))]
    if pair[1] >= 0:
        whole = columns.whole[pair[1]]
        own = columns.probes[pair[1]] or (((), np.zeros(0)),)
        groups = [((whole, *places), np.concatenate([[0.0], precision])) for places, precision in own]
    left = [_left_over(truth, places, precision, columns, total, table) for places, precision in groups]
    return min(left, key=lambda item: item.gain)


def _left_over(
    truth: int, places: Sequence[int], precision: Array, columns: _Columns, total: Array, table: Array
) -> _Separation:
    p = len(columns.precision)
    index = np.array([*range(p), *places, truth])
    inside = total[np.ix_(index, index)]
    weights = np.concatenate([columns.precision, precision])
    ridge = weights + 1e-9 * np.maximum(np.diag(inside)[:-1], _NOTHING)
    answer = explained_by(inside[:-1, :-1], ridge, inside[:-1, -1])
    gain = 0.5 * max(float(inside[-1, -1] - inside[-1, :-1] @ answer), 0.0)
    rest = table[..., truth] - table[..., index[:-1]] @ answer
    rows = rest.shape[1] // len(CHANNELS) * len(CHANNELS)
    # the rows of the priors lie below the block means
    energy = (rest[:, :rows].reshape(rest.shape[0], -1, len(CHANNELS)) ** 2).sum(axis=(0, 1))
    whole = float(energy.sum())
    return _Separation(gain, tuple((energy / whole).tolist() if whole > 0.0 else energy.tolist()))


def _answer(
    manoeuvres: Sequence[Manoeuvre], rivals: Sequence[Effect], found: Sequence[Mapping[tuple[int, int], _Separation]]
) -> NextDrivePlan:
    minutes = [m.duration / 60.0 for m in manoeuvres]
    power = [min(s.gain for s in f.values()) / t for f, t in zip(found, minutes, strict=True)]
    order = sorted(range(len(manoeuvres)), key=lambda k: -power[k])
    proposals = [_proposal(manoeuvres[k], rivals, found[k], power[k], minutes[k]) for k in order]
    best = proposals[0]
    if best.minutes is None:
        return NextDrivePlan.none(_nothing(rivals), best.power)
    others = tuple(item for item in proposals[1:] if item.minutes is not None)[:_ALTERNATIVES]
    return NextDrivePlan(**vars(best), alternatives=others)


def _proposal(
    manoeuvre: Manoeuvre, rivals: Sequence[Effect], found: Mapping[tuple[int, int], _Separation], power: float, t: float
) -> DriveProposal:
    needed = APART / power if power > _NOTHING else math.inf
    separates = tuple(
        (rivals[a].name, rivals[b].name)
        for a, b in found
        if 0 <= a < b and min(found[a, b].gain, found[b, a].gain) / t >= APART / MOST_MINUTES
    )
    why = _why(manoeuvre, rivals, found, needed)
    return DriveProposal(manoeuvre.name, why, separates, power, needed if needed <= MOST_MINUTES else None)


def _why(
    manoeuvre: Manoeuvre, rivals: Sequence[Effect], found: Mapping[tuple[int, int], _Separation], needed: float
) -> str:
    """The worst pair, where it shows, and how long it takes."""
    (a, b), worst = min(found.items(), key=lambda item: item[1].gain)
    channel = CHANNELS[int(np.argmax(worst.channels))]
    share = 100.0 * max(worst.channels)
    if b < 0:
        what = f"{rivals[a].name} stands out from what soil and robot may do"
    else:
        what = f"{rivals[a].name} leaves readings that {rivals[b].name} cannot imitate"
    return f"{manoeuvre.description}: {what}, {share:.0f} % of it in {channel}; {_runs(manoeuvre, needed)}."


def _runs(manoeuvre: Manoeuvre, needed: float) -> str:
    """How often it has to be driven until the wrong name keeps a weight of 5 percent."""
    if not math.isfinite(needed):
        return "no number of runs is enough"
    runs = math.ceil(60.0 * needed / manoeuvre.duration)
    length = f"{manoeuvre.duration:.0f} s"
    return f"one run of {length} is enough" if runs <= 1 else f"{runs} runs of {length} are needed"


def _nothing(rivals: Sequence[Effect]) -> str:
    names = ", ".join(rival.name for rival in rivals)
    return f"No manoeuvre of the bank tells {names} apart within {MOST_MINUTES:g} min with these sensors."


def rivals_of_diagnosis(diagnosis: Diagnosis) -> list[Effect]:
    """Effects that a diagnosis leaves open, at their fitted or typical sizes.

    Those of the equivalence set with most names, of what comes nearest where nothing is named; else, of a finding
    without rivals, what it is itself; else the effects that could hide in these drives at several times the size that
    matters.
    """
    every = [*diagnosis.findings, *diagnosis.rejected]
    findings = [f for f in every if f.name not in SEEN_IN_VALUES]
    if findings:
        widest = max(findings, key=lambda f: (len(f.equivalence_set), -_certainty(f)))
        weights = {widest.name: 1.0, **widest.equivalence_set}
        names = sorted(weights, key=lambda name: (name != widest.name, -weights[name]))[:MOST_RIVALS]
        fitted = {f.name: f for f in every}
        known = {name: _at_size(name, fitted[name]) for name in names if name in fitted}
        return [known.get(name) or _retold(name, known) for name in names if name in known or _has_typical_size(name)]
    return [_at_size(name, None) for name in _hidden(diagnosis.detectable)]


def _retold(name: str, known: Mapping[str, Effect]) -> Effect:
    """A rival that was not kept: in the words of a fitted effect where it tells the same, else at a typical size."""
    radii = known.get(WheelRadiusMismatch.name)
    if name == EncoderScale.name and isinstance(radii, WheelRadiusMismatch):
        return looped(radii)
    return _at_size(name, None)


def _certainty(finding: Finding) -> float:
    return finding.equivalence_set.get(finding.name, 1.0)


def _has_typical_size(name: str) -> bool:
    """Whether an effect that was not fitted can be given a size: limits and held readings cannot."""
    kind = effect_kind(name)
    return kind.categorical or kind.differentiable


def _at_size(name: str, finding: Finding | None) -> Effect:
    kind = effect_kind(name)
    if finding is not None:
        return kind(**{key: item.value for key, item in finding.parameters.items()})
    size = kind.size_names()[0]
    data = kind.parameter(size).metadata
    if kind.categorical:
        return replace(kind.neutral(), **{size: data["high"]})
    direction = math.copysign(1.0, data["step"])
    value = data["neutral"] + direction * TYPICAL_MULTIPLE * data["least"]
    return kind.neutral().with_values(**{size: min(max(value, data["low"]), data["high"])})


def _hidden(detectable: Mapping[str, Mapping[str, float | None]]) -> list[str]:
    """Effects whose main size shows worst, most hidden first; one is enough to plan for."""
    found = []
    for name, sizes in detectable.items():
        kind = effect_kind(name)
        main = kind.size_names()[0]
        if kind.categorical or not kind.differentiable or main not in sizes:
            continue
        value = sizes[main]
        least = kind.parameter(main).metadata["least"]
        found.append((math.inf if value is None else float(value) / least, name))
    return [name for _, name in sorted(found, key=lambda item: (-item[0], item[1]))[:1]]


def sensors_of_diagnosis(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Sensors whose channels a diagnosis has a misfit of."""
    channels = set(diagnosis.misfit.get("nominal", {}))
    return tuple(name for name, own in SENSORS.items() if channels & set(own)) or tuple(SENSORS)


def setting_of_diagnosis(diagnosis: Diagnosis) -> Setting:
    """Windows and priors of a diagnosis; usual ones where it does not say.

    Raises:
        InputError: its options are not whole, or have priors of another form.
    """
    options = diagnosis.options
    if options == Options():
        return Setting()
    try:
        if options.window is None or options.stride is None or options.block is None or options.priors is None:
            raise ValueError("window, stride, block and priors are not all there")
        return Setting(options.window, options.stride, options.block, NuisancePriors(**options.priors))
    except (TypeError, ValueError) as error:
        raise InputError(
            f"the options of the diagnosis cannot be read ({error}): make it with `ddagr diagnose`."
        ) from None
