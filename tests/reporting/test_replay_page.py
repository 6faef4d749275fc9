from __future__ import annotations

from pathlib import Path

import pytest

from ddagr_gym.replay_analysis.intervals import ErrorStatistics
from ddagr_gym.replay_analysis.report import (
    EFFECTIVE_TRACK,
    MODELS,
    NO_SLIP,
    NOMINAL,
    REFITTED,
    SCHEMA,
    SCHEMA_VERSION,
    BaselineReport,
    DriveModeReport,
    FittedParameter,
    HorizonError,
    ModelResiduals,
    RefitReport,
    ReplayReport,
    RunReport,
    Speed,
    lead_errors,
)
from ddagr_gym.reporting.replay_page import replay_page

SIZES = dict(zip(MODELS, (0.4, 0.1, 0.8, 0.2), strict=True))


def error(model, metric="heading", horizon=5.0, count=9):
    size = SIZES[model] if count else None
    statistics = ErrorStatistics(count, size, None if size is None else (0.9 * size, 1.1 * size), size, None, size)
    return HorizonError(model, horizon, metric, "rad", statistics)


def mode(horizons, notes=(), refit=None):
    return DriveModeReport(
        "commands", 4, 4, (ModelResiduals(NOMINAL, (), ()),), tuple(horizons), (), (),
        BaselineReport(None, 0.0, None, None, None), refit, Speed(60.0, 0.1, 600.0), tuple(notes),
    )  # fmt: skip


def report(modes, source="a.csv"):
    run = RunReport((source,), ("",), 100, 5.0, 0.05, "halves", {}, (0.0,), (0.0,), ("a <note>.",), tuple(modes), 3.0)
    return ReplayReport(SCHEMA, SCHEMA_VERSION, "1", "ddagr", "clay", (), 2.0, False, 0, (run,))


def test_all_models_stand_at_the_head_with_their_intervals():
    page = replay_page(report([mode([error(m) for m in MODELS])]), {})
    head = page[: page.index("<h2")]
    for size in SIZES.values():
        assert f"{size:.3g} <small>({0.9 * size:.2g}–{1.1 * size:.2g})</small>" in head


def test_poses_judge_the_heading_where_the_gyro_does_not():
    blind = mode([error(NO_SLIP, count=0), error(NO_SLIP, "heading_pose")])
    assert lead_errors(blind)[NO_SLIP].metric == "heading_pose"
    assert lead_errors(mode([error(NO_SLIP, horizon=1.0)])) == {}


def test_a_model_that_is_absent_has_a_dash():
    page = replay_page(report([mode([error(NOMINAL), error(NO_SLIP)])]), {})
    head = page[: page.index("<h2")]
    assert head.count("<td>–</td>") == 2


def test_texts_are_escaped():
    page = replay_page(report([mode([], notes=("no <b> & no </script>.",))], source="<img src=x>.csv"), {})
    assert "A &lt;note&gt;." in page
    assert "No &lt;b&gt; &amp; no &lt;/script&gt;." in page
    assert "<img src=x>" not in page


def test_figures_are_named_beside_the_page():
    page = replay_page(report([mode([])]), {(0, "commands"): [Path("/somewhere/else/a_commands.png")]})
    assert 'src="a_commands.png"' in page
    assert "/somewhere" not in page


@pytest.mark.parametrize(("value", "bound", "word"), [(0.1, False, ""), (0.9, False, "pulled"), (0.9, True, "bound")])
def test_parameters_that_were_pulled_are_marked(value, bound, word):
    parameter = FittedParameter("soil_strength", "-", value, 0.1, 0.1, 0.2, value / 0.2, bound)
    refit = RefitReport((parameter,), 4, 2.0, 3, True, 1.0, 1.0)
    page = replay_page(report([mode([error(REFITTED), error(EFFECTIVE_TRACK)], refit=refit)]), {})
    assert "soil strength [log of a factor]" in page
    row = page[page.index("soil strength") :].split("</tr>")[0]
    assert ("pulled" in row, "at its bound" in row) == (word == "pulled", word == "bound")
