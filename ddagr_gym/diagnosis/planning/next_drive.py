"""What to drive next: the manoeuvre of a bank in which the remaining rivals would differ most.

Each rival is taken for the truth at its fitted size. What it would do to the readings of a manoeuvre is then explained
as well as possible by another rival, whose size, with the windows' unknowns and the nominal parameters, is refitted
linearly. Half the square of what is left over the noise is the gain by which the right name would lead; it is compared
per minute of driving. A lead that is less than the library's form of the right name may lose settles nothing, however
often it is driven.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ddagr_gym.control.manoeuvres import MANOEUVRES, Manoeuvre
from ddagr_gym.diagnosis.answer.channel_faults import CHANNEL_FAULT_TITLES
from ddagr_gym.diagnosis.answer.next_drive_plan import DriveProposal, NextDrivePlan
from ddagr_gym.diagnosis.answer.verdict import Diagnosis, Finding, Options
from ddagr_gym.diagnosis.planning.planned_drive import RATE, SENSORS, plan, with_room
from ddagr_gym.diagnosis.planning.separations import Separation, columns_of, separations
from ddagr_gym.diagnosis.preprocessing.session import DiagnosisSession
from ddagr_gym.diagnosis.search.initial_guess import looped
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.errors import InputError
from ddagr_gym.identification.nuisances import NuisancePriors
from ddagr_gym.identification.size_prior import TYPICAL_MULTIPLE
from ddagr_gym.identification.windows import CHANNELS
from ddagr_gym.parameters import Imu, Robot, Sensors, Soil
from ddagr_gym.physics.effects import Effect
from ddagr_gym.physics.effects.encoder_scale import EncoderScale
from ddagr_gym.physics.effects.registry import effect_kind
from ddagr_gym.physics.effects.wheel_radius_mismatch import WheelRadiusMismatch
from ddagr_gym.simulator import simulate

SEEN_IN_VALUES = ("sensor_hold", *CHANNEL_FAULT_TITLES)
"""Names that no drive needs to tell from others."""

MOST_RIVALS = 5
"""Rivals that are compared: those with most weight."""

MOST_MINUTES = 30.0
"""Driving that is asked of nobody to tell two names apart (ours)."""

_ALTERNATIVES = 3
"""Manoeuvres that are listed beside the best, at most (ours: a short list to choose from)."""


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
    columns = columns_of(prepared, planned)
    found = [separations(prepared, columns, number, len(planned)) for number in range(len(manoeuvres))]
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


def _answer(
    manoeuvres: Sequence[Manoeuvre], rivals: Sequence[Effect], found: Sequence[Mapping[tuple[int, int], Separation]]
) -> NextDrivePlan:
    minutes = [m.duration / 60.0 for m in manoeuvres]
    power = [min(s.gain for s in f.values()) / t for f, t in zip(found, minutes, strict=True)]
    # more of what leaves a pair together for ever is no better
    open_ = [any(math.isinf(s.runs) for s in f.values()) for f in found]
    order = sorted(range(len(manoeuvres)), key=lambda k: (open_[k], -power[k]))
    proposals = [_proposal(manoeuvres[k], rivals, found[k], power[k], minutes[k]) for k in order]
    best = proposals[0]
    if best.minutes is None:
        return NextDrivePlan.none(_nothing(rivals, found), best.power)
    others = tuple(item for item in proposals[1:] if item.minutes is not None)[:_ALTERNATIVES]
    return NextDrivePlan(**vars(best), alternatives=others)


def _proposal(
    manoeuvre: Manoeuvre, rivals: Sequence[Effect], found: Mapping[tuple[int, int], Separation], power: float, t: float
) -> DriveProposal:
    needed = t * max(item.runs for item in found.values())
    separates = tuple(
        (rivals[a].name, rivals[b].name)
        for a, b in found
        if 0 <= a < b and t * max(found[a, b].runs, found[b, a].runs) <= MOST_MINUTES
    )
    why = _why(manoeuvre, rivals, found, needed)
    return DriveProposal(manoeuvre.name, why, separates, power, needed if needed <= MOST_MINUTES else None)


def _why(
    manoeuvre: Manoeuvre, rivals: Sequence[Effect], found: Mapping[tuple[int, int], Separation], needed: float
) -> str:
    """The worst pair, where it shows, and how long it takes."""
    (a, b), worst = max(found.items(), key=lambda item: (item[1].runs, -item[1].gain))
    channel = CHANNELS[int(np.argmax(worst.channels))]
    share = 100.0 * max(worst.channels)
    if b < 0:
        what = f"{rivals[a].name} stands out from what soil and robot may do"
    elif math.isinf(worst.runs):
        what = f"what {rivals[a].name} leaves that {rivals[b].name} cannot imitate is within the error of its form"
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


def _nothing(rivals: Sequence[Effect], found: Sequence[Mapping[tuple[int, int], Separation]]) -> str:
    """That no manoeuvre is enough, and of which pairs no number of runs would be."""
    names = ", ".join(rival.name for rival in rivals)
    said = f"No manoeuvre of the bank tells {names} apart within {MOST_MINUTES:g} min with these sensors."
    pairs = {(min(pair), max(pair)) for pair in found[0] if min(pair) >= 0}
    alike = [
        f"{rivals[a].name} and {rivals[b].name}"
        for a, b in sorted(pairs)
        if all(math.isinf(max(item[a, b].runs, item[b, a].runs)) for item in found)
    ]
    if not alike:
        return said
    less = "they differ by less than the library's forms err"
    return f"{said} No number of runs is enough for {', '.join(alike)}: {less}."


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
