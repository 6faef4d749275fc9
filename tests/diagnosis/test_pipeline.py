"""The stages of a diagnosis: in their order, each once, and behind the last finished one after an interruption."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from ddagr_gym.diagnosis import diagnose, pipeline
from ddagr_gym.diagnosis.answer.certificate import Certificate
from ddagr_gym.diagnosis.answer.location import EffectLocation, Localisation
from ddagr_gym.diagnosis.answer.next_drive_plan import NextDrivePlan
from ddagr_gym.diagnosis.answer.unnamed_terms import UnnamedTerms
from ddagr_gym.diagnosis.answer.verdict import Diagnosis, GatesUsed
from ddagr_gym.diagnosis.gates.thresholds import Thresholds
from ddagr_gym.diagnosis.pipeline import LATER, STEPS
from ddagr_gym.diagnosis.preprocessing.data_checks import DoubtedBanks
from ddagr_gym.diagnosis.setting import Setting
from ddagr_gym.physics.effects.pose_latency import PoseLatency
from ddagr_gym.presets import get_robot, get_soil

_NOTHING = EffectLocation((), 0.0, (), (), None, "")
LOCATED = Localisation({}, None, _NOTHING, _NOTHING, {}, ())
ANSWER = Diagnosis(
    ("none",),
    False,
    (),
    "",
    {"limit": {"yaw_rate": 1.2}},
    {},
    {},
    ("a",),
    GatesUsed(nulls=20, bank="a test", level=0.05),
    0.0,
    "0",
)
STAGES: dict[str, Any] = {
    "data_doubts": (),
    "search": "what was found",
    "search_in_parts": ({}, "what was found"),
    "conclude": (ANSWER, ()),
    "certify": Certificate("by recording", "", (), 0.9, {}, {}, {}, {}, {}),
    "trace_mismatch": "traces",
    "locate": LOCATED,
    "onsets_of_names": {},
    "unnamed_terms": UnnamedTerms("", (), 0.0, 0.0, ""),
    "plan_next_drive": NextDrivePlan.none("nothing is left open"),
    "gather_evidence": "arrays",
}
"""Stages by the name that the pipeline calls them by, and what they give here."""


class Stages:
    """Stands in for all stages of the pipeline; says which were called and stops in one of them."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.called: list[str] = []
        self.stopped_in = ""
        mended = SimpleNamespace(given=(), recordings=(), repeated=(), left_out=(), contradictions=(), names=())
        self.session = SimpleNamespace(
            robot=get_robot("ddagr"), soil=get_soil("thesis_a1"), mended=mended, problem=None, seed=3,
            setting=Setting(), gates=SimpleNamespace(misfit={}), rng=lambda stage: None, key=lambda: "the same",
        )  # fmt: skip
        for name, result in STAGES.items():
            monkeypatch.setattr(pipeline, name, self._stage(name, result))
        monkeypatch.setattr(pipeline, "prepare", self._stage("prepare", self.session))
        start = SimpleNamespace(session=self.session)
        monkeypatch.setattr(pipeline, "starting_models", self._stage("starting_models", start))
        monkeypatch.setattr(pipeline, "accept", lambda found, gates: found)

    def _stage(self, name: str, result: Any) -> Any:
        def stage(*inputs: object, **named: object) -> Any:
            self.called.append(name)
            if name == self.stopped_in:
                raise KeyboardInterrupt
            return result

        return stage

    def run(self, **options: Any) -> tuple[Any, list[tuple[str, bool]]]:
        """Diagnose; the outcome, and the steps that began with whether they were kept."""
        self.called.clear()
        began: list[tuple[str, bool]] = []
        nominal = (self.session.robot, self.session.soil, Thresholds({}, {}, 20, "a test"), Setting())
        outcome = diagnose((), *nominal, on_step=lambda name, kept: began.append((name, kept)), **options)
        return outcome, began


@pytest.fixture
def stages(monkeypatch: pytest.MonkeyPatch) -> Stages:
    return Stages(monkeypatch)


def test_every_stage_is_called_once_in_its_order(stages: Stages) -> None:
    outcome, began = stages.run(soil_name="loam")
    assert began == [(name, False) for name in STEPS]
    first, *later = STAGES
    assert stages.called == ["prepare", first, "starting_models", *later]
    diagnosis = outcome.diagnosis
    assert (diagnosis.robot, diagnosis.soil, diagnosis.options.seed) == ("ddagr", "loam", 3)
    assert (diagnosis.fit, diagnosis.unnamed) == (STAGES["certify"], STAGES["unnamed_terms"])
    assert diagnosis.localisation.mismatch.time_share == 0.0


def test_names_only_leaves_out_what_follows_the_verdict(stages: Stages) -> None:
    outcome, began = stages.run(names_only=True)
    assert [name for name, _ in began] == [name for name in STEPS if name not in LATER]
    assert (outcome.diagnosis.fit, outcome.diagnosis.unnamed, outcome.diagnosis.next_drive) == (None, None, None)


@pytest.mark.parametrize(
    ("explained", "told"),
    [(0.9, True), (None, False), pytest.param(0.3, False, id="most of the wheels' errors are left")],
)
def test_the_drivetrain_is_fitted_where_the_library_leaves_too_much_in_the_encoders(
    stages: Stages, monkeypatch: pytest.MonkeyPatch, explained: float | None, told: bool
) -> None:
    late, answer = PoseLatency(0.2), SimpleNamespace(explained=explained, parts=())
    nominal = SimpleNamespace(
        robot=get_robot("warthog"), soil=get_soil("thesis_a1"), effects=(late,), answer=answer, meant=frozenset()
    )
    undone: list[Any] = []

    def with_nominal(robot: Any, soil: Any, sensors: Any) -> Any:
        undone.append(sensors)
        return SimpleNamespace(**{**vars(stages.session), "robot": robot})

    stages.session.with_nominal = with_nominal
    stages.session.progress = lambda line: None
    monkeypatch.setattr(pipeline, "unlike_commands", lambda accepted, gates, common: {"encoder_left": 9.0})
    monkeypatch.setattr(pipeline, "doubted_banks", lambda recordings, rng: DoubtedBanks(("command_gain",)))
    monkeypatch.setattr(pipeline, "standing", lambda found, gates: found)
    monkeypatch.setattr(pipeline, "refit_nominal", lambda problem, progress: ("raw", "refitted"))
    monkeypatch.setattr(pipeline, "beside_completed", lambda session, refitted, effects: f"{effects} beside {refitted}")
    monkeypatch.setattr(pipeline, "with_drivetrain", lambda answer, made, misfit: replace(answer, verdict=("load",)))
    monkeypatch.setattr(
        pipeline,
        "search",
        lambda *inputs: SimpleNamespace(
            nominal=SimpleNamespace(misfit={"yaw_rate": 2.0}),
            chosen=SimpleNamespace(fitted=SimpleNamespace(point=SimpleNamespace(effects=()))),
        ),
    )
    monkeypatch.setattr(pipeline, "search_in_parts", lambda session, start, found: ({}, found))
    asked: list[Any] = []

    def complete(misfit: Any, mended: Any, doubted: Any) -> Any:
        assert mended is stages.session.mended
        asked.append((misfit, doubted))
        return None if explained is None else nominal

    outcome, _ = stages.run(complete_nominal=complete)
    assert asked == [({"encoder_left": 9.0}, DoubtedBanks(("command_gain",)))]
    assert outcome.diagnosis.verdict == (("load",) if told else ("none",))
    assert outcome.nominal[0].name == ("warthog" if told else "ddagr")
    assert ("certify" in stages.called) is not told
    assert (late in outcome.effects) is told
    assert undone == ([(late,)] if told else [])
    if told:
        assert outcome.diagnosis.next_drive is not None
        assert "ddagr calibrate" in outcome.diagnosis.next_drive.why


def test_a_stopped_diagnosis_goes_on_behind_its_last_step(stages: Stages, tmp_path: Path) -> None:
    stages.stopped_in = "locate"
    with pytest.raises(KeyboardInterrupt):
        stages.run(cache=tmp_path / "steps")
    stages.stopped_in = ""
    _, began = stages.run(cache=tmp_path / "steps")
    kept = [name for name, was_kept in began if was_kept]
    assert kept == ["checks", "search", "verdict", "certification"]
    later = ["locate", "onsets_of_names", "unnamed_terms", "plan_next_drive", "gather_evidence"]
    assert stages.called == ["prepare", "starting_models", *later]
    stages.run(cache=tmp_path / "steps")
    assert stages.called == ["prepare", "starting_models"]
