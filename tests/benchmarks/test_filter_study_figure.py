"""The figure of ``ddagr study filter`` from a document of made-up values."""

from __future__ import annotations

import pytest

from benchmarks.filter_study.figure import ESTIMATORS, filter_study_figure

pytest.importorskip("matplotlib")

CHANNELS = ("specific_force_x", "specific_force_y", "yaw_rate", "encoder_right", "encoder_left")


def figure(value, low=None, high=None):
    return {"value": value, "interval": [low, high]}


@pytest.fixture
def document():
    names = ("radius_error_median", "radius_error_p95", "speed_rmse", "speed_rmse_median_drive")
    item = {name: figure(0.01 * (k + 1)) for k, name in enumerate(names)}
    item["nis"] = {name: figure(1.0, 0.9, 1.1) for name in CHANNELS}
    block = {"band": [0.8, 1.2], "by_instant": [1.0, 1.1, 0.9]}
    laws = {law: {"peak_error_x": 0.1, "peak_error_y": 0.2} for law in ("thesis", "thesis_with_resistance", "coupled")}
    priors = ("soil_known_to_15_percent", "default_prior")
    return {
        **{estimator: {"my_soils": dict(item)} for estimator in ESTIMATORS},
        "aims": {},
        "nees": {prior: {"velocity": block, "parameters": block} for prior in priors},
        "nis_of_matched_drives": {prior: {name: {"band": [0.5, 1.5]} for name in CHANNELS} for prior in priors},
        "force_laws": {"my_soils": {"turn": laws}},
        "real_drives": {},
    }


def test_without_real_drives_or_known_set_names(document, tmp_path):
    filter_study_figure(document, tmp_path / "figure.png")
    assert (tmp_path / "figure.png").stat().st_size > 40_000


def test_an_arm_that_broke_down_and_a_real_drive(document, tmp_path):
    broken = {"radius_error_median": figure(None), "radius_error_p95": figure(None)}
    document["thesis_filter"]["my_soils"] = broken
    heading = {"filter": {"value": 0.1, "interval": None, "windows": 9}}
    document["real_drives"] = {"drive": {"drives": {"wheel_speeds": {"5": {"heading": heading}}}}}
    filter_study_figure(document, tmp_path / "figure.png")
    assert (tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")
