"""The answer of a diagnosis. ``docs/diagnosis_schema.md`` is made of these classes' docstrings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from ddagr_gym.diagnosis.answer.certificate import Certificate
from ddagr_gym.diagnosis.answer.change import Change
from ddagr_gym.diagnosis.answer.drivetrain import DrivetrainAnswer
from ddagr_gym.diagnosis.answer.location import EffectLocation, Localisation
from ddagr_gym.diagnosis.answer.next_drive_plan import NextDrivePlan
from ddagr_gym.diagnosis.answer.nuisance_spread import NuisanceSpread
from ddagr_gym.diagnosis.answer.onset import Onset
from ddagr_gym.diagnosis.answer.soil_at_work import SoilAtWork
from ddagr_gym.diagnosis.answer.unnamed_terms import UnnamedTerms

SCHEMA = "ddagr-diagnosis/4"
"""Name and version: raised whenever an entry is renamed, removed or changes its meaning."""

NONE = "none"
UNKNOWN = "unknown"

IncompleteFor = Literal["left", "names", "dead", "contradictions"]
"""Why an answer is not complete."""


@dataclass(frozen=True)
class Estimate:
    """A parameter of a named effect.

    Attributes:
        value: in unit. Directions and places refer to the world of the poses, or, where no recording has any, to the
            start of the first.
        unit: SI.
        interval: 90 %, resampled over windows, holding the value in any case; for sizes at least 10 % of their distance
            from neutral to either side, 2 % of a limit, by which forms of other simulators differ, for sizes of a soil
            as logarithms, and more in the direction in which strength and stiffness trade; null where it was not fitted
            or nothing shows it.
    """

    value: float
    unit: str
    interval: tuple[float, float] | None = None

    def __float__(self) -> float:
        return self.value

    def __str__(self) -> str:
        unit = "" if self.unit == "-" else f" {self.unit}"
        between = "" if self.interval is None else f" ({self.interval[0]:.3g} to {self.interval[1]:.3g})"
        return f"{self.value:.3g}{unit}{between}"


@dataclass(frozen=True)
class Finding:
    """One named effect, part of the drivetrain, or fault of channels.

    Attributes:
        name: of the effect (`ddagr effects`), of the part (`drivetrain`), or of readings that belong to other channels
            than the map says, which were mended before anything was fitted: `encoders_exchanged`, `encoders_reversed`,
            `commands_exchanged`, `commands_reversed`, `imu_upside_down`, `heading_reversed`, `path_mirrored`.
        parameters: by field.
        gain: fall of the cost over the dispersion when it was added; of a part of the drivetrain, and of a sensor or
            a gain of commands that was fitted with it, the relative growth of the forecasts' loss without it.
        gate: what the gain had to pass: beside other names more than alone (`thresholds` has the gates of first names);
            0 where it was seen in the values themselves.
        score: cluster-robust, along the fitted direction.
        held_out: gain on windows that its size was not fitted to.
        channels: share of each channel, `local_` ones included, in the fall of the misfit when it was added.
        equivalence_set: names that the same windows may mean, with weights that add up to 1; itself included.
        where: where it shows; null where nothing was located.
        calibrated_p: share of null drives that reach as much; null without a bank.
        onset: how its size goes with time; absent for what was seen in the values themselves, and where it acts in too
            few windows.
        soil: what a soil of which strength and stiffness are said does under a wheel; absent for other effects, and
            against earlier drives.
    """

    name: str
    parameters: Mapping[str, Estimate]
    gain: float
    gate: float
    score: float
    held_out: float
    channels: Mapping[str, float] = field(default_factory=dict)
    equivalence_set: Mapping[str, float] = field(default_factory=dict)
    where: EffectLocation | None = None
    calibrated_p: float | None = None
    onset: Onset | None = None
    soil: SoilAtWork | None = None

    @classmethod
    def seen(cls, name: str, parameters: Mapping[str, Estimate]) -> Finding:
        """One that the values themselves show: no fit speaks for it, and it passed no gate."""
        return cls(name, parameters, 0.0, 0.0, 0.0, 0.0, {}, {name: 1.0})

    @property
    def by_forecasts(self) -> bool:
        """Whether gain and gate are growths of the forecasts' loss: gates of gains are above 1."""
        return 0.0 < self.gate < 1.0


@dataclass(frozen=True)
class DataSource:
    """A recording that was used.

    Attributes:
        source: its name.
        sha256: of the file it came from, or of its values where it came from no file.
        rows: how many.
        seconds: from the first to the last.
    """

    source: str
    sha256: str
    rows: int
    seconds: float


@dataclass(frozen=True)
class DataDoubt:
    """Something suspicious about a recording's clocks, signs, units or channels, as `ddagr check` says it.

    Attributes:
        recording: its name; "" for what several say together.
        channel: of the recording, or "a to b" for a pair; "" where it is about all.
        finding: family of checks. With a channel that never changes while the robot drives (`stuck`) no answer is
            `complete`.
        sentence: what it is and what to do.
        suspects: effects that would explain it.
    """

    recording: str
    channel: str
    finding: str
    sentence: str
    suspects: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class GatesUsed:
    """Where the gates come from: what gain an effect had to reach. How long windows are comes from the bank as well.

    Attributes:
        nulls: null drives behind them.
        bank: its hash.
        level: of false alarms over the whole library.
        robot: nominal one of the bank; absent where its file does not say.
        soil: the same.
        soil_uncertainty: factor on how far the soil may be from the nominal one; absent the same.
        seed: of the bank; absent the same.
        kind: "simulated" or "ordinary" real drives; absent the same.
        gates: of all effects, for recordings of this length.
    """

    nulls: int
    bank: str
    level: float
    robot: str | None = None
    soil: str | None = None
    soil_uncertainty: float | None = None
    seed: int | None = None
    kind: str | None = None
    gates: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Options:
    """Choices that the answer depends on besides data, robot, soil and gates, so that the same can be run again.

    An entry is absent where the diagnosis was not made by the command.

    Attributes:
        window: length of the windows as they were searched [s].
        stride: between their starts [s].
        block: length of the means that were compared [s].
        priors: standard deviations of what is uncertain, by name.
        seed: of everything random.
        names_only: whether certification, unnamed terms and the next drive were left out.
        robot_file: where the nominal robot came from, where that was a file.
    """

    window: float | None = None
    stride: float | None = None
    block: float | None = None
    priors: Mapping[str, float] | None = None
    seed: int | None = None
    names_only: bool | None = None
    robot_file: str | None = None


@dataclass(frozen=True)
class Diagnosis:
    """What recordings say about the physics that the nominal simulator leaves out.

    Attributes:
        verdict: names of effects (`ddagr effects`), of parts of the drivetrain and of faults of channels, or
            `["none"]`: nothing that these data can show, or `["unknown"]`: something that no effect explains.
        complete: whether no more is left than in drives with nothing missing, the names explain at least 80 % of the
            mismatch, every size is the same everywhere, none reaches the bound of what exists, no drive that nothing
            was fitted to is certainly predicted worse, no channel is dead, and no sources of one motion contradict each
            other in a way that no name of the verdict explains (the sentence begins with it then). Rivals in an
            equivalence set and what else the checks of the recordings suspect leave it as it is; the sentence has them.
        findings: one per name of the verdict, in the order in which they were found; none with `["none"]` and
            `["unknown"]`.
        sentence: the answer in words.
        misfit: mean square of each channel's residual over its noise: `nominal` (refitted), `corrected`, and the null
            bank's `limit`; the names that begin with `local_` are the variations of soil and sensors from window to
            window, which have to make up for what is missing.
        detectable: least distance from neutral that these recordings would have shown nine times in ten, by effect and
            field, of the usual shape (a soil changed from the beginning on), in the worst direction, at the median of
            the places driven on; of a limit the mildest tried one that shows, as it is, of a reversed sign 1 (held
            readings are found in the values, from a fifth of repeats on, and not listed); named effects beside the
            nominal model, the others beside what was named, whose gates are higher; null: none that can exist.
        nuisances: refitted soil, robot, biases, clocks and headings of recordings without poses (0 where nothing shows
            them) by name; logarithms of factors where they have no unit.
        recordings: names of the sources.
        thresholds: where the gates come from.
        seconds: that the run took.
        version: of the package.
        fit: errors on drives that the models were not fitted to; null with `--names-only`.
        localisation: where the mismatch is.
        unnamed: what has no name; null where the names suffice.
        next_drive: the drive that would tell what is left open apart best; null with `--names-only`.
        data: the recordings, with hashes.
        robot: name of the nominal one; "" where the diagnosis was not made by the command.
        soil: the same.
        options: windows, priors and seed.
        checks: what the recordings say against themselves.
        rejected: what fits best where that leaves too much in the channels to be a name; it is in no model of `misfit`,
            `fit` and `localisation`, and in no effects.yaml.
        drivetrain: what the nominal simulator lacks between command and wheel; absent where the wheels follow
            their commands about as it says. Where it is there, robot and soil of all other entries have it.
        detectable_alone: the same as `detectable` for all effects beside the nominal model, before any was named.
        schema: name and version of the file's form.
        change: with `--calibration`, what changed against ordinary drives of the robot; else absent. With it `gain` and
            `gate` of a finding are half the squares of the distance and its limit in `change`, `score` is the distance,
            `held_out` and `where` are null, `parameters` are what differs from ordinary drives, `calibrated_p` is the
            probability over the whole library, `detectable` is the least detectable change, `misfit` has no limit,
            and `complete` says that nothing else is out of the ordinary.
        nuisance_spread: how sure the nuisances are; absent with `--calibration` and in files of before.
        incomplete_for: why it is not `complete`: `left` (more is left that has no name), `names` (what is named is
            doubtful), `dead` (a channel never changes), `contradictions` (sources of one motion contradict each other);
            empty where it is, and where only something is left in a comparison, beside a drivetrain or in files of
            before.
    """

    verdict: tuple[str, ...]
    complete: bool
    findings: tuple[Finding, ...]
    sentence: str
    misfit: Mapping[str, Mapping[str, float]]
    detectable: Mapping[str, Mapping[str, float | None]]
    nuisances: Mapping[str, float]
    recordings: tuple[str, ...]
    thresholds: GatesUsed
    seconds: float
    version: str
    fit: Certificate | None = None
    localisation: Localisation | None = None
    unnamed: UnnamedTerms | None = None
    next_drive: NextDrivePlan | None = None
    data: tuple[DataSource, ...] = ()
    robot: str = ""
    soil: str = ""
    options: Options = field(default_factory=Options)
    checks: tuple[DataDoubt, ...] = ()
    rejected: tuple[Finding, ...] = ()
    drivetrain: DrivetrainAnswer | None = None
    detectable_alone: Mapping[str, Mapping[str, float | None]] = field(default_factory=dict)
    schema: str = SCHEMA
    change: Change | None = None
    nuisance_spread: NuisanceSpread | None = None
    incomplete_for: tuple[IncompleteFor, ...] = ()

    def doubted(self, reason: IncompleteFor, sentence: str) -> Diagnosis:
        """The same, not complete for a further reason.

        Args:
            reason: why.
            sentence: the answer in words, with the reason.
        """
        before: tuple[IncompleteFor, ...] = () if self.complete else self.incomplete_for or ("left",)
        return replace(self, complete=False, sentence=sentence, incomplete_for=(*before, reason))
