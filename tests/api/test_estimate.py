"""``ddagr_gym.estimate``: parameters, errors, table and files."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import ddagr_gym
from ddagr_gym.api.estimate import SoilParameter
from ddagr_gym.errors import InputError, InputWarning


@pytest.fixture(scope="module")
def estimated(drive):
    return ddagr_gym.estimate(drive)


def test_parameters_have_units_and_are_numbers(estimated):
    assert set(estimated.parameters) == {"traction_limit", "traction_rate", "lateral_stiffness", "motion_resistance"}
    resistance = estimated.parameters["motion_resistance"]
    assert resistance.unit == "N"
    assert float(resistance) == resistance.value > 0.0
    assert math.isnan(float(SoilParameter(None, "N", None, None)))


def test_errors_are_known_where_the_truth_is(drive, estimated):
    assert abs(estimated.errors["radius_error"]) < 0.08
    read = {name: values for name, values in drive.columns.items() if not name.startswith("true_")}
    with pytest.warns(InputWarning, match="does not say which robot drove: it is taken for the ddagr"):
        assert ddagr_gym.estimate(read).errors == {}


def test_table_and_summary_go_out(estimated, drive, tmp_path):
    pandas = pytest.importorskip("pandas")
    frame = estimated.to_pandas()
    assert isinstance(frame, pandas.DataFrame)
    assert len(frame) == len(drive.columns["t"])
    np.testing.assert_array_equal(frame["v_x"], estimated.columns["v_x"])
    estimated.to_json(tmp_path / "summary.json")
    assert json.loads((tmp_path / "summary.json").read_text()) == estimated.summary


def test_text_and_notebook(estimated, page_text):
    assert "motion resistance" in str(estimated)
    assert "radius_error" in page_text(estimated)
    assert repr(estimated).startswith("<EstimateResult: simulation: 36 s, filter ours")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "give either a recording or"),
        ({"recording": "nothing.parquet"}, "nothing.parquet"),
        ({"thesis": "6.2", "robot": "husky"}, "the thesis's runs have their own"),
        ({"thesis": "6.2", "attitude": True}, "attitude True: the thesis's runs have their own"),
        ({"recording": "a.csv", "filter": "thesis", "attitude": True}, "with the thesis's filter, which knows level"),
        ({"thesis": "6.2", "soil": "mud"}, "unknown soil 'mud'"),
        ({"thesis": "6.2", "law": "couple"}, "unknown force law 'couple'.*coupled"),
        ({"thesis": "6.2", "filter": "our"}, "unknown filter 'our'.*ours"),
    ],
)
def test_bad_requests_are_one_sentence(options, message):
    with pytest.raises(InputError, match=message):
        ddagr_gym.estimate(**options)


def test_several_recordings_are_refused(drive):
    with pytest.raises(InputError, match="2 recordings are given"):
        ddagr_gym.estimate([drive, drive])
