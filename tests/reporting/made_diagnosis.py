"""A diagnosis, by its entries in the file, and its evidence, made by hand, for the tests of its page."""

import numpy as np

from ddagr_gym.diagnosis.answer.evidence import Evidence
from ddagr_gym.diagnosis.answer.verdict import SCHEMA
from ddagr_gym.diagnosis.result.files import validate
from ddagr_gym.identification.windows import CHANNELS

HOSTILE = "<script>alert('$x_1$')</script>.csv"


def evidence(windows=12, seed=0):
    rng = np.random.default_rng(seed)
    blocks, pieces, channels = 20, 4, len(CHANNELS)
    time = 2.0 * (np.arange(windows) % (windows // 2))
    turn = 0.2 * (time[:, None] + 0.1 * np.arange(blocks))
    path = np.stack([2.0 * np.sin(turn), 1.0 - np.cos(turn), turn], axis=2)
    measured = rng.normal(size=(windows, blocks, channels))
    measured[:, ::2, 5:] = np.nan
    sigma = np.where(np.isnan(measured), np.inf, 0.5)
    regimes = rng.uniform(size=(3, windows, pieces))
    regimes[2] = 1.0
    return Evidence(
        0.1, 0.5, np.repeat([0, 1], windows // 2), time, path, measured, measured - 1.0, measured - 0.8,
        measured + 0.2 * rng.normal(size=measured.shape), sigma, ("slope", "payload"), np.array([80.0, 3.0]),
        np.array([np.nan, 0.1]), np.array([9.0, 7.0]), ("speed", "heading", "slip"), regimes,
        np.stack([path[:, 2::5, 0], path[:, 2::5, 1]], axis=2), ("slope",), rng.normal(2.0, size=(1, windows, pieces)),
        np.ones((1, windows, pieces)), np.ones((1, windows, pieces)), rng.normal(size=(windows, 3)) + 9.0,
        rng.normal(size=(windows, 3)), np.ones((windows, 3)),
    )  # fmt: skip


def where(**changes):
    share = {
        "name": "speed", "unit": "m/s", "edges": [0.0, 1.0], "time_share": [1.0], "weight_share": [1.0], "low": 0.5,
        "high": None, "excess": 0.5, "weight_inside": 0.8, "time_inside": 0.3, "p": 0.01,
    }  # fmt: skip
    span = {"recording": 0, "start": 2.0, "end": 8.0, "share": 0.9, "size": 1.0, "deviation": 0.1}
    found = {"spans": [span], "time_share": 0.5, "regimes": [share], "places": [], "uneven": None, "phrase": "uphill"}
    return found | changes


def diagnosis(**changes):
    """The answer with some entries of the file changed."""
    return validate(entries() | changes)


def entries():
    """Entries of the file."""
    angle = {"value": 0.065, "unit": "rad", "interval": [0.06, 0.07]}
    direction = {"value": 0.56, "unit": "rad", "interval": [0.5, 0.62]}
    finding = {
        "name": "slope", "parameters": {"angle": angle, "direction": direction}, "gain": 80.0, "gate": 9.0,
        "score": 6.0, "held_out": 70.0, "channels": {}, "where": where(), "calibrated_p": 0.004,
        "equivalence_set": {"slope": 0.8, "accelerometer_bias": 0.2},
    }  # fmt: skip
    misfit = dict.fromkeys(CHANNELS, 1.5)
    return {
        "schema": SCHEMA, "verdict": ["slope"], "complete": True, "findings": [finding],
        "sentence": "The ground slopes 3.7 ± 0.3 degrees.", "version": "0.1", "seconds": 61.0,
        "misfit": {"nominal": misfit, "corrected": dict.fromkeys(CHANNELS, 0.9), "limit": dict.fromkeys(CHANNELS, 1.2)},
        "detectable": {"slope": {"angle": 0.01}, "payload": {"mass": None}}, "nuisances": {"soil_strength": -0.1},
        "recordings": [HOSTILE, "run_2.csv"], "thresholds": {"nulls": 120, "bank": "abc", "level": 0.05, "gates": {}},
        "robot": "", "soil": "", "options": {}, "checks": [], "data": [], "rejected": [],
        **dict.fromkeys(("fit", "localisation", "unnamed", "next_drive")),
    }  # fmt: skip


def later_entries():
    error, nothing = {"value": 0.2, "interval": [0.1, 0.3]}, {"value": None, "interval": None}
    arms = dict.fromkeys(("raw", "refitted", "corrected", "black_box"), error)
    arms |= {"ceiling": {"value": 0.1, "interval": None}, "unit": "rad/s", "count": 40}
    wrench = {"component": "F_x", "unit": "N", "before": 9.0, "after": 0.1, "deviation": 1.0, "chi_before": 9.0}
    return {
        "fit": {
            "folds": "by recording", "note": f"Decided on all drives of {HOSTILE}.", "horizons": [1.0, 30.0],
            "gain_share": {"1": None, "30": {"value": 0.91, "interval": [0.85, 0.95]}},
            "gain_share_readings": {"1": None, "30": None}, "level": 0.9,
            "gain": {"1": None, "30": dict.fromkeys(("corrected", "black_box", "ceiling"), error)},
            "gain_readings": {"1": None},
            "channels": {"yaw_rate": {"1": arms, "30": arms | {"raw": nothing}}},
        },
        "localisation": {
            "explained": 0.71, "mismatch": where(), "remaining": where(phrase="nothing above the noise", regimes=[]),
            "wrench": [wrench | {"chi_after": 1.0}], "channels": {}, "findings": {},
        },
        "unnamed": {
            "equation": f"F_x = -12 v_x {HOSTILE}", "ceiling_share": 0.9, "where": "at speed", "equation_share": 0.5,
            "terms": [{"regressor": "v_x", "target": "F_x", "coefficient": -12.0, "unit": "N s/m",
                       "interval": [-15.0, -9.0], "stability": 0.95, "alternatives": []}],
        },
        "next_drive": {
            "manoeuvre": "square_both_ways", "why": "Gravity turns.", "separates": [["slope", "accelerometer_bias"]],
            "power": 0.97, "minutes": None,
            "alternatives": [{"manoeuvre": "spin", "why": "", "separates": [], "power": 0.5, "minutes": 9.0}],
        },
        "checks": [{"recording": "run_2.csv", "channel": HOSTILE, "finding": "stuck", "sentence": "It never changes.",
                    "suspects": []}],
        "data": [{"source": HOSTILE, "sha256": "f" * 64, "rows": 600, "seconds": 12.0}],
    }  # fmt: skip
