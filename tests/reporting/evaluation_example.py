"""A small evaluation by hand: B1, a policy and an upper bound on S1 and T; names that want to be escaped."""

from functools import lru_cache

import numpy as np

from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.evaluation.report_data import Arm, Evaluation, SetNote, ShownDrive
from ddagr_gym.evaluation.summary import summaries

HOSTILE = "<script>alert('$x_1$')</script>"

ERRORS = {
    "B1": [-0.09, 0.05, -0.04, 0.06, None, -0.03],
    "B4": [0.02, -0.02, 0.03, 0.02, -0.01, 0.02],
    "ppo_ekf": [0.01, -0.01, 0.01, 0.02, -0.01, 0.02],
    "true_path": [0.001, 0.001, 0.002, 0.001, 0.001, 0.002],
}


def rows_of(controller, errors, set_name="S1", infeasible=()):
    """Rows with these e_R; None is a turn that never reached the row."""
    return [
        {
            "controller": controller, "arm": controller, "run": 0, "set": set_name, "number": n, "radius": 0.8,
            "side": ("left", "right")[n % 2], "ending": 1 if e is not None else 3, "status": "COMPLETE",
            "feasible": n not in infeasible, "radius_error": e, "radius_consistent": True, "fit_residual": 0.001,
            "success": e is not None and abs(e) < 0.055, "within_practice": e is not None and abs(e) < 0.04,
            "exit_lateral_error": None if e is None else 1.6 * e, "exit_heading_error": None if e is None else e,
            "radial_error_rms": None if e is None else 0.01, "radial_error_maximum": None if e is None else 0.02,
            "headland_depth": 1.4, "radius_disagreement": 0.004, "duration": 18.0,
            "slip_energy": 900.0, "wheel_speed_variation": 0.2, "bank_stalls": 0, "robot_stalls": 0,
            "estimator_speed_rms": 0.004, "estimator_yaw_rate_rms": 4e-4,
            "estimator_slip_rms": 0.05, "estimator_radius": -0.015, "estimator_prediction_1s": 0.006,
            "estimator_prediction_5s": 0.03, "estimator_dead_reckoning": 0.015, "estimator_innovation": 0.9,
        }
        for n, e in enumerate(errors)
    ]  # fmt: skip


@lru_cache(maxsize=1)
def driven():
    """Rows and their summary, once."""
    rows = [row for name, errors in ERRORS.items() for row in rows_of(name, errors)]
    rows += [row for name in ("B1", "ppo_ekf") for row in rows_of(name, [0.1, 0.2, -0.02], "T", infeasible=(1,))]
    return rows, summaries(rows)


def evaluation(**changes):
    rows, summary = driven()
    turn = RowTurn()
    path = turn.sample(0.1)
    points = np.column_stack([path.x, path.y])
    drives = [
        ShownDrive(arm, "S1", number, turn, points * scale, 0.02, True)
        for arm in ("B1", "ppo_ekf")
        for number, scale in ((0, 1.0), (3, 1.02))
    ]
    claim = {
        "name": HOSTILE,
        "arm": "ppo_ekf",
        "set_name": "S1",
        "metric": "radius_error_median",
        "relation": "at most",
    }
    given = {
        "rows": rows,
        "summary": summary,
        "arms": [
            Arm("B1", f"constants {HOSTILE}"),
            Arm("B4", "force balance"),
            Arm("ppo_ekf", "learned policy", learned=True, versions=("abc",)),
            Arm("true_path", "upper bound", deployable=False),
        ],
        "sets": [SetNote("S1", "in range", 6, 6, "0" * 64), SetNote("T", "another law", 3, 3, "1" * 64)],
        "headline": "ppo_ekf",
        "claims": [
            claim | {"measured": 0.01, "bound": 0.02, "verdict": "held"},
            claim | {"measured": None, "bound": 0.02, "verdict": "not held"},
            claim | {"measured": None, "bound": 0.5, "verdict": "not driven"},
        ],
        "drives": drives,
        "tracked": [ShownDrive("B4", "S1", 0, turn, points, 0.02, True, points * 1.01, 0.013)],
        "infeasible": [{"scenario": "T 1", "cohesion [Pa]": 512.25, "friction [°]": 21.0}],
        "sources": [("scenarios S1", HOSTILE)],
    }  # fmt: skip
    return Evaluation(**(given | changes))
