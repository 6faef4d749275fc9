"""What localisation, certification and checks add to the findings and to the sentence."""

from dataclasses import replace

import pytest

from ddagr_gym.diagnosis.answer.certificate import Certificate, Gains, Measured
from ddagr_gym.diagnosis.answer.location import EffectLocation, Localisation, Unevenness
from ddagr_gym.diagnosis.answer.verdict import DataDoubt, Diagnosis, Estimate, Finding, GatesUsed
from ddagr_gym.diagnosis.result.channel_fault_findings import with_contradictions
from ddagr_gym.diagnosis.result.files import as_mapping, validate
from ddagr_gym.diagnosis.review import review, with_dead_channels
from ddagr_gym.recordings.checks.findings import CheckFinding, Status

MISFIT = {"yaw_rate": 4.0}
BANK = GatesUsed(nulls=60, bank="f", level=0.05)


def diagnosis(name: str, field: str, value: float, complete: bool = True) -> Diagnosis:
    finding = Finding(name, {field: Estimate(value, "s")}, 50.0, 10.0, 5.0, 40.0, equivalence_set={name: 1.0})
    limits = {"nominal": MISFIT, "corrected": {"yaw_rate": 0.9}, "limit": {"yaw_rate": 1.2}}
    return Diagnosis((name,), complete, (finding,), "", limits, {}, {}, ("a.csv",), BANK, 1.0, "0")


def where(uneven: Unevenness | None = None) -> EffectLocation:
    return EffectLocation((), 0.0, (), (), uneven, "everywhere")


def made_of(dead: str) -> tuple[DataDoubt, ...]:
    """Checks of a recording with a dead channel."""
    return (DataDoubt("a.csv", dead, "stuck", "It never changes."),)


def located(explained: float | None = 1.0, **findings: EffectLocation) -> Localisation:
    return Localisation({}, explained, where(), where(), findings, ())


@pytest.mark.parametrize("complete", [True, False])
def test_a_size_that_is_not_the_same_everywhere_is_said_and_leaves_the_answer_incomplete(complete: bool) -> None:
    uneven = where(Unevenness("speed", "m/s", 0.5, None, 1.5, 0.7, 0.01))
    made = review(diagnosis("command_delay", "delay", 0.1, complete), located(command_delay=uneven))
    assert not made.complete
    assert "the size of command delay is not the same everywhere: 1.5 of the fitted one" in made.sentence
    assert made.sentence.endswith("; nothing else was found, but what is named is doubtful.") == complete
    assert made.sentence.endswith("that has no name here.") != complete
    assert made.incomplete_for == (("names",) if complete else ("left", "names"))


def test_an_even_size_changes_nothing() -> None:
    made = review(diagnosis("command_delay", "delay", 0.1), located(command_delay=where()))
    assert made.complete
    assert "everywhere" not in made.sentence


def test_repeated_readings_keep_their_place() -> None:
    """The model has no such effect, so that localisation says nothing about it."""
    made = review(diagnosis("sensor_hold", "duration", 0.2), located(), where())
    assert made.findings[0].where == where()
    validate(as_mapping(made))


def test_drives_predicted_worse_make_a_name_doubtful() -> None:
    """Only where the fall of the error is certain."""

    def made(interval: tuple[float, float]) -> Diagnosis:
        gain = Gains(Measured(-0.3, interval), Measured(0.0), Measured(0.0))
        fit = Certificate("by recording", "", (30.0,), 0.9, {}, {"30": gain}, {}, {}, {})
        return review(diagnosis("command_delay", "delay", 0.1), located(), None, fit)

    assert not made((-0.4, -0.2)).complete
    assert "predicted worse with it, by 30 % (20 to 40 %) after 30 s" in made((-0.4, -0.2)).sentence
    assert made((-0.4, 0.1)).complete
    assert "worse" not in made((-0.4, 0.1)).sentence


def test_findings_that_leave_much_of_the_mismatch_are_not_complete() -> None:
    made = review(diagnosis("command_delay", "delay", 0.1), located(explained=0.4))
    assert not made.complete
    assert made.sentence.endswith("; 40 % of the mismatch; something more is left that has no name here.")
    assert review(diagnosis("command_delay", "delay", 0.1), located()).complete


@pytest.mark.parametrize(
    ("name", "field", "value", "interval", "words"),
    [
        ("soil_patch", "stiffness", 0.137, (0.1, 0.24), "the stiffness of soil patch reaches 0.1, the bound"),
        ("soil_patch", "stiffness", 0.137, (0.11, 0.24), ""),
        ("soil_patch", "stiffness", 1.7, (0.1, 4.0), ""),
        ("pose_latency", "latency", 0.9, (0.8, 1.0), "the latency of late pose reaches 1 s, the bound"),
        ("motor_saturation", "speed_limit", 0.9, (0.85, 1000.0), ""),
    ],
)
def test_a_size_at_its_bound_makes_its_form_doubtful(
    name: str, field: str, value: float, interval: tuple[float, float], words: str
) -> None:
    """On its own side of neutral only; a limit out of reach is what has no effect."""
    answer = diagnosis(name, field, value)
    estimate = replace(answer.findings[0].parameters[field], value=value, unit="s" if name == "pose_latency" else "-")
    finding = replace(answer.findings[0], parameters={field: replace(estimate, interval=interval)})
    made = review(replace(answer, findings=(finding,)), located())
    assert made.complete == (not words)
    assert words in made.sentence


def test_what_is_seen_in_the_values_has_no_share_of_the_mismatch() -> None:
    """It is mended in all models, so that a model without it is not there to compare with."""
    answer = diagnosis("sensor_hold", "duration", 0.2)
    seen = replace(answer, findings=(replace(answer.findings[0], gate=0.0),))
    made = review(seen, located(explained=0.0))
    assert made.complete
    assert "mismatch" not in made.sentence


def test_a_dead_channel_leaves_no_answer_complete() -> None:
    given = replace(diagnosis("command_delay", "delay", 0.1), sentence="The commands come late.")
    assert with_dead_channels(given, ()) is given
    made = with_dead_channels(given, made_of("yaw_rate"))
    assert not made.complete
    assert made.sentence.startswith("The commands come late. Yaw rate never changes")
    assert made.sentence.endswith(": the answer is that of the other channels.")
    assert made.incomplete_for == ("dead",)
    assert with_dead_channels(replace(given, complete=False), made_of("yaw_rate")).incomplete_for == ("left", "dead")


def test_a_dead_channel_makes_no_name_doubtful() -> None:
    """The other channels hold nothing else; where nothing is named not every channel has said so."""
    made = review(diagnosis("command_delay", "delay", 0.1), located(), checks=made_of("yaw_rate"))
    assert not made.complete
    assert made.incomplete_for == ("dead",)
    assert made.sentence.endswith("; nothing else above what the other channels can show.")
    nothing = replace(diagnosis("slope", "angle", 0.1), verdict=("none",), findings=())
    assert review(nothing, located(), checks=made_of("yaw_rate")).incomplete_for == ("dead",)


def test_contradictions_and_something_left_are_both_kept() -> None:
    finding = CheckFinding("turning", "gyro", Status.SUSPICIOUS, meaning="Gyro and poses differ.")
    complete, open_ = (
        with_contradictions(diagnosis("slope", "angle", 0.1, whole), [finding]) for whole in (True, False)
    )
    assert complete.incomplete_for == ("contradictions",)
    assert open_.incomplete_for == ("left", "contradictions")
    validate(as_mapping(open_))


def test_without_a_name_the_sentence_has_what_the_recordings_own_checks_suspect() -> None:
    doubt = DataDoubt("a.csv", "encoder_right", "travel", "Twice as far.", ("encoder_scale",))
    nothing = replace(diagnosis("slope", "angle", 0.1), verdict=("none",), findings=())
    made = review(nothing, located(), checks=[doubt, doubt])
    assert made.complete
    assert made.sentence.count("in a way that encoder scale would explain") == 1, made.sentence
    assert "look wrong" not in review(diagnosis("slope", "angle", 0.1), located(), checks=[doubt]).sentence
