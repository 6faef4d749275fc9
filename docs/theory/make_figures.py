"""Figures of the theory pages, drawn with the package's own functions.

Run from the root of the checkout: ``python docs/theory/make_figures.py [NAME ...]``; takes about a minute for all.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ddagr_gym.control.manoeuvres import MANOEUVRES
from ddagr_gym.control.row_turn import RowTurn
from ddagr_gym.envs.options import make_settings
from ddagr_gym.estimation import FilterModel, estimates, run_filter
from ddagr_gym.evaluation.calibration import steady_motion
from ddagr_gym.evaluation.controllers import find_controller, needs_filter, nominal_constants
from ddagr_gym.evaluation.runs import drive_turn
from ddagr_gym.parameters import STANDARD_GRAVITY, Sensors, Soil
from ddagr_gym.physics import equilibrium_sinkage, wheel_force
from ddagr_gym.physics.contact_geometry import sin_edge
from ddagr_gym.physics.contact_stress import normal_stress, peak_fraction, pressure_modulus, shear_over_speed
from ddagr_gym.presets import ddagr, get_soil
from ddagr_gym.rendering.palette import BLUE, GREEN, ORANGE, VERMILLION
from ddagr_gym.simulator import simulate

Array = NDArray[np.float64]

FOLDER = Path(__file__).parent / "figures"

SPEED = 0.2  # [m/s] of a row turn
SOILS = ("thesis_a1", "sandy_loam_lll_15", "lete_sand_wong")


def _save(figure: Figure, name: str) -> None:
    figure.tight_layout()
    figure.savefig(FOLDER / f"{name}.svg", metadata={"Date": None})
    plt.close(figure)


def _wheel_load() -> float:
    return ddagr().mass * STANDARD_GRAVITY / 4.0


def _rim_speed(slip: float) -> float:
    """Bank speed [rad/s] of a wheel that rolls at SPEED with a slip ratio below 1."""
    radius = ddagr().outer_radius
    rim = SPEED / (1.0 - slip) if slip >= 0.0 else SPEED * (1.0 + slip)
    return rim / radius


def _middle_slice(soil: Soil, slip: float) -> tuple[Array, Array, Array]:
    """Angles [rad], pressure and tangential shear stress [Pa] along the middle slice at the static load."""
    wheel, omega = ddagr().wheels[0], _rim_speed(slip)
    sinkage, _ = equilibrium_sinkage(wheel, soil, SPEED, 0.0, omega, 0.0, _wheel_load())
    rho, height = wheel.outer_radius, wheel.outer_radius - sinkage
    entry = np.arccos(height / rho)
    peak = entry * peak_fraction(soil.peak_stress_coefficient_0, soil.peak_stress_coefficient_1, slip)
    leave = -soil.exit_angle_ratio * entry
    modulus = pressure_modulus(
        soil.cohesive_modulus, soil.frictional_modulus, wheel.half_width, sin_edge(wheel.minor_radius, sinkage)
    )
    theta = np.linspace(leave, entry, 241)
    mapped = np.where(theta >= peak, theta, entry - (theta - leave) / (peak - leave) * (entry - peak))
    depth = rho * (np.cos(mapped) - np.cos(entry))
    sigma = np.array([normal_stress(modulus, soil.sinkage_exponent, z) for z in depth])
    rate = max(abs(omega), SPEED / rho)
    shear = np.empty_like(theta)
    for k, angle in enumerate(theta):
        v_t = SPEED * np.cos(angle) - omega * rho
        j_t = SPEED * (np.sin(entry) - np.sin(angle)) - omega * rho * (entry - angle)
        strength = soil.cohesion + sigma[k] * np.tan(soil.friction_angle)
        shear[k] = -v_t * shear_over_speed(strength, j_t, 0.0, v_t, 0.0, -1.0 / (rate * soil.shear_modulus))
    return theta, sigma, shear


def stress_around_rim() -> None:
    """Pressure and shear stress along the middle slice at three slips."""
    figure, panels = plt.subplots(1, 2, figsize=(8.0, 3.0), sharex=True)
    soil = get_soil("thesis_a1")
    for slip, colour in ((-0.2, BLUE), (0.1, GREEN), (0.5, VERMILLION)):
        theta, sigma, shear = _middle_slice(soil, slip)
        panels[0].plot(np.degrees(theta), 1e-3 * sigma, color=colour, label=f"slip {slip:g}")
        panels[1].plot(np.degrees(theta), 1e-3 * shear, color=colour)
    panels[0].set_ylabel("pressure [kPa]")
    panels[1].set_ylabel("shear stress along the tread [kPa]")
    for panel in panels:
        panel.set_xlabel("angle from bottom dead centre [deg], front to the right")
        panel.axvline(0.0, color="0.8", linewidth=0.8)
        panel.axhline(0.0, color="0.8", linewidth=0.8)
    panels[0].legend(frameon=False)
    _save(figure, "stress_around_rim")


def load_and_force() -> None:
    """Load over sinkage, and force over slip at the static load."""
    figure, panels = plt.subplots(1, 2, figsize=(8.0, 3.2))
    wheel, load = ddagr().wheels[0], _wheel_load()
    depth = np.linspace(1e-4, 0.03, 120)
    for name, colour in zip(SOILS, (BLUE, GREEN, ORANGE), strict=True):
        carried = wheel_force(wheel, get_soil(name), SPEED, 0.0, _rim_speed(0.1), 0.0, depth).force[:, 2]
        panels[0].plot(1e3 * depth, carried, color=colour, label=name)
    panels[0].axhline(load, color="0.4", linestyle="--", linewidth=0.9)
    panels[0].set(xlabel="sinkage [mm]", ylabel="load carried [N]", ylim=(0.0, 3.0 * load))
    slips = np.linspace(-0.95, 0.95, 77)
    omega = np.array([_rim_speed(slip) for slip in slips])
    for name, colour in zip(SOILS, (BLUE, GREEN, ORANGE), strict=True):
        for angle, style in ((0.0, "-"), (15.0, ":")):
            v_y = SPEED * np.tan(np.radians(angle))
            sinkage, _ = equilibrium_sinkage(wheel, get_soil(name), SPEED, v_y, omega, 0.0, load)
            force = wheel_force(wheel, get_soil(name), SPEED, v_y, omega, 0.0, sinkage).force[:, 0]
            panels[1].plot(slips, force / load, color=colour, linestyle=style)
    panels[1].axhline(0.0, color="0.8", linewidth=0.8)
    panels[1].plot([], [], color="0.4", linestyle="-", label="straight")
    panels[1].plot([], [], color="0.4", linestyle=":", label="slip angle 15 deg")
    panels[1].set(xlabel="slip ratio [-]", ylabel="longitudinal force over load [-]")
    for panel in panels:
        panel.legend(frameon=False, fontsize=8)
    _save(figure, "load_and_force")


def filter_turn() -> None:
    """The filter in the turn of Table 6.2: speed, and what it learns of the soil."""
    robot, sensors = ddagr(), Sensors()
    columns = simulate(robot, get_soil("thesis_a1"), MANOEUVRES["table_6_2"].commands(125.0), sensors=sensors, seed=1)
    model = FilterModel.of(robot, sensors)
    run = run_filter(model, columns)
    found = estimates(model, run.states, run.covariances)
    thin = slice(None, None, 20)
    t = run.t[thin]
    figure, panels = plt.subplots(1, 2, figsize=(8.0, 3.0))
    speed, deviation = found.velocity[thin, 0], found.velocity_deviation[thin, 0]
    panels[0].fill_between(t, speed - 2.0 * deviation, speed + 2.0 * deviation, color=BLUE, alpha=0.25, linewidth=0.0)
    panels[0].plot(t, speed, color=BLUE, label="estimate, 2 standard deviations")
    panels[0].plot(t, columns["true_v_x"][thin], color="0.2", linewidth=0.9, label="truth")
    panels[0].set(xlabel="time [s]", ylabel="forward speed [m/s]")
    prior = np.sqrt(np.diag(model.soil_prior.logs(model.wheel_load)[1]))
    names = ("traction limit", "traction rate", "lateral stiffness", "motion resistance")
    for k, (name, colour) in enumerate(zip(names, (BLUE, GREEN, ORANGE, VERMILLION), strict=True)):
        panels[1].plot(t, found.log_deviations[thin, k] / prior[k], color=colour, label=name)
    panels[1].set(xlabel="time [s]", ylabel="deviation over prior [-]", ylim=(0.0, None))
    for panel in panels:
        panel.axvspan(5.0, 22.5, color="0.95", zorder=0)
        panel.legend(frameon=False, fontsize=8)
    _save(figure, "filter_turn")


def _weaker(soil: Soil, factor: float) -> Soil:
    """A soil with another shear strength."""
    angle = float(np.arctan(factor * np.tan(soil.friction_angle)))
    return replace(soil, cohesion=factor * soil.cohesion, friction_angle=angle)


def row_turn() -> None:
    """Commanded path, what is judged, driven paths; radius at constant bank speeds over the soil's strength."""
    figure, panels = plt.subplots(1, 2, figsize=(8.0, 3.6))
    turn, soil = RowTurn(), get_soil("thesis_a1")
    path = turn.sample()
    panels[0].plot(path.x, path.y, color="0.3", linewidth=1.0, linestyle="--", label="commanded")
    judged = (np.abs(path.yaw) >= np.radians(30.0)) & (np.abs(path.yaw) <= np.radians(150.0))
    panels[0].plot(path.x[judged], path.y[judged], color="0.8", linewidth=6.0, zorder=0, label="radius fitted")
    controllers = (("B0", VERMILLION), ("B1", ORANGE), ("B4", BLUE))
    for name, colour in controllers:
        settings = make_settings(
            soil=_weaker(soil, 0.8), randomisation=False, side=turn.side, ekf_features=needs_filter(name)
        )
        run = drive_turn(find_controller(name, turn), settings, 0)
        track = slice(None, None, 12)
        panels[0].plot(run.columns["true_x"][track], run.columns["true_y"][track], color=colour, label=name)
    panels[0].axvline(0.0, color="0.8", linewidth=0.8)
    panels[0].set(xlabel="x [m]", ylabel="y [m]", aspect="equal", xlim=(-1.1, 2.6))
    factors = np.linspace(0.6, 1.6, 6)
    spread = ddagr().half_track / turn.radius
    rolling = [SPEED * (1.0 + sign * spread) / ddagr().outer_radius for sign in (1.0, -1.0)]
    constants = nominal_constants(turn)
    for name, colour, (outer, inner) in (
        ("B0", VERMILLION, rolling),
        ("B1", ORANGE, (constants.outer, constants.inner)),
    ):
        motion = np.array([steady_motion(ddagr(), _weaker(soil, f), outer, inner) for f in factors])
        radius = np.hypot(motion[:, 0], motion[:, 1]) / motion[:, 2]
        panels[1].plot(factors, radius, color=colour, marker=".", label=f"bank speeds of {name}")
    panels[1].axhline(turn.radius, color="0.3", linestyle="--", linewidth=1.0, label="commanded")
    panels[1].set(xlabel="shear strength over nominal [-]", ylabel="radius of the steady turn [m]")
    for panel in panels:
        panel.legend(frameon=False, fontsize=8)
    _save(figure, "row_turn")


def gates() -> None:
    """Gates of the shipped bank, and what its null runs reach."""
    from ddagr_gym.diagnosis.gates.threshold_files import shipped_thresholds

    bank = shipped_thresholds("ddagr")
    assert bank is not None
    names = sorted(bank.gates, key=lambda name: bank.of(name).gain)
    figure, panels = plt.subplots(1, 2, figsize=(8.0, 4.6), width_ratios=(1.6, 1.0))
    panels[0].barh(names, [bank.of(name).gain for name in names], color=BLUE)
    panels[0].set(xlabel="gate: gain that must be exceeded [-]")
    panels[0].tick_params(axis="y", labelsize=7)
    panels[1].hist(bank.maxima, bins=20, color="0.6")
    panels[1].axvline(1.0, color=VERMILLION, linewidth=1.0)
    panels[1].set(xlabel="largest gain over its gate [-]", ylabel="null runs")
    _save(figure, "gates")


def window_elimination() -> None:
    """What a slope and a gyro bias do to one window, before and after its free initial state has its say."""
    from ddagr_gym.diagnosis.planning.planned_drive import plan
    from ddagr_gym.diagnosis.search.scan import probe_columns
    from ddagr_gym.identification.windows import CHANNELS
    from ddagr_gym.physics.effects.gyro_bias import GyroBias
    from ddagr_gym.physics.effects.slope import Slope

    made = plan(ddagr(), get_soil("thesis_a1"), (MANOEUVRES["two_radii"],), ("imu", "encoders", "pose"))
    problem, fitted = made.problem, made.fitted
    shape, window = problem.blocked.sigma.shape, 2
    figure, panels = plt.subplots(2, 2, figsize=(8.0, 4.4), sharex=True)
    length = problem.blocked.weights.shape[2] * problem.blocked.windows.period
    for column, (effect, title) in enumerate(((Slope(0.02), "slope of 1.1 degrees"), (GyroBias(0.005), "gyro bias"))):
        raw = problem.padded(next(probe_columns(problem, fitted, [effect]))[..., None])
        after = fitted.elimination.project(raw)
        for row, channel in enumerate(("pose_x", "yaw_rate")):
            place = CHANNELS.index(channel)
            known = np.isfinite(problem.blocked.sigma[window, :, place])
            time = length * (0.5 + np.arange(shape[1]))[known]
            for values, colour, label in ((raw, "0.6", "as simulated"), (after, BLUE, "after elimination")):
                seen = values[window, : shape[1] * shape[2], 0].reshape(shape[1:])[known, place]
                panels[row, column].plot(time, seen, color=colour, marker=".", label=label)
            panels[row, column].axhline(0.0, color="0.8", linewidth=0.8)
            panels[row, column].set_ylabel(f"{channel} [sigma]")
        panels[0, column].set_title(title, fontsize=10)
        panels[1, column].set_xlabel("time in the window [s]")
    panels[0, 0].legend(frameon=False, fontsize=8)
    _save(figure, "window_elimination")


FIGURES: dict[str, Callable[[], None]] = {
    function.__name__: function
    for function in (stress_around_rim, load_and_force, filter_turn, row_turn, gates, window_elimination)
}


def main(names: list[str]) -> None:
    """Draw the named figures, all by default."""
    plt.rcParams.update({"font.size": 9, "svg.hashsalt": "ddagr", "axes.spines.top": False, "axes.spines.right": False})
    FOLDER.mkdir(exist_ok=True)
    for name in names or FIGURES:
        FIGURES[name]()


if __name__ == "__main__":
    main(sys.argv[1:])
