"""The acceptance of the replay: its arithmetic, its committed result, and (slow) the sand recording itself."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path

import numpy as np
import pytest

from benchmarks.replay_open import JUDGED, SOILS, acceptance, both_folds, pooled, recording_results
from ddagr_gym.replay_analysis.drive_mode import HorizonResult
from ddagr_gym.replay_analysis.report import EFFECTIVE_TRACK, NO_SLIP, REFITTED


@pytest.fixture
def recordings_dir(repository) -> Path:
    """Real drives; skips when absent."""
    shared = os.environ.get("DDAGR_SHARED") or repository.parent / "shared"
    folder = Path(os.environ.get("DDAGR_RECORDINGS") or Path(shared) / "recordings")
    if not (folder / "open").is_dir():
        pytest.skip(f"real drives are not at {folder}: set DDAGR_RECORDINGS to their folder")
    return folder


@pytest.fixture(scope="module")
def committed():
    path = Path(__file__).resolve().parents[2] / "benchmarks" / "results" / "replay.json"
    return json.loads(path.read_text())


class Fold:
    """One fold's errors after 5 s."""

    def __init__(self, clusters, values):
        errors = {REFITTED: {"heading": np.array(values)}}
        self.horizons = {5.0: HorizonResult(np.array(clusters), errors, {}, 0.05)}


def test_folds_are_pooled_without_mixing_their_clusters():
    joined = pooled([Fold([0, 0, 1], [1.0, 2.0, 3.0]), Fold([0, 1], [4.0, 5.0])])[5.0]
    np.testing.assert_array_equal(joined.clusters, [0, 0, 1, 2, 3])
    np.testing.assert_array_equal(joined.errors[REFITTED]["heading"], [1.0, 2.0, 3.0, 4.0, 5.0])


def mode(ours, no_slip, track):
    recording, horizon, metric = JUDGED
    sizes = {REFITTED: ours, NO_SLIP: no_slip, EFFECTIVE_TRACK: track}
    errors = [
        {"model": m, "horizon": h, "metric": metric, "error": {"rms": size * h / horizon, "count": 7}}
        for m, size in sizes.items()
        for h in (1.0, horizon)
    ]
    pairs = [
        {"horizon": horizon, "metric": metric, "comparison": {
            "model": REFITTED, "baseline": m, "rms_ratio": ours / sizes[m], "rms_ratio_interval": [0.1, 2.0]}}
        for m in (NO_SLIP, EFFECTIVE_TRACK)
    ]  # fmt: skip
    return {recording: {"arms": {"commands": {"errors": errors, "comparisons": pairs}}}}


@pytest.mark.parametrize(
    ("sizes", "half", "track"),
    [((0.3, 1.0, 0.4), True, True), ((0.5, 1.0, 0.4), False, False), ((0.45, 1.0, 0.4), True, False)],
)
def test_both_conditions_are_judged_apart(sizes, half, track):
    found = acceptance(mode(*sizes))
    assert found["met"]["commands"] == {"below_half_of_no_slip": half, "below_effective_track": track}
    row = found["root_mean_square"][JUDGED[0]]["commands"]
    assert (row[REFITTED], row["windows"]) == (sizes[0], 7)
    assert row[f"ratio_to_{NO_SLIP}"] == [sizes[0] / sizes[1], 0.1, 2.0]


def test_the_committed_result_says_what_its_numbers_say(committed):
    assert set(committed["recordings"]) == set(SOILS)
    again = acceptance(committed["recordings"])
    assert committed["acceptance"] == json.loads(json.dumps(again))
    for item in committed["recordings"].values():
        for found in item["arms"].values():
            assert all(fold["speed"]["times_real_time"] >= 100.0 for fold in found["folds"])


def test_the_committed_result_is_of_these_recordings(committed, recordings_dir):
    for name, item in committed["recordings"].items():
        content = (recordings_dir / "open" / f"{name}.csv.gz").read_bytes()
        assert item["sha256"] == hashlib.sha256(content).hexdigest()


@pytest.mark.slow
def test_a_refitted_soil_beats_the_kinematic_models_on_sand(recordings_dir):
    name = JUDGED[0]
    results = {name: recording_results(recordings_dir / "open" / f"{name}.csv.gz", SOILS[name], 1, 0)}
    for conditions in acceptance(results)["met"].values():
        assert conditions == {"below_half_of_no_slip": True, "below_effective_track": True}


@pytest.mark.slow
def test_every_window_is_judged_by_the_fold_that_has_not_seen_it(recordings_dir):
    folds = both_folds(recordings_dir / "open" / "warthog_grass.csv.gz", SOILS["warthog_grass"], 1, 0)
    for one, other in zip(*(fold.drive_modes for fold in folds), strict=True):
        assert not (one.in_training & other.in_training).any()
        assert one.report.refit.windows <= one.in_training.sum()
