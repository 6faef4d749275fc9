"""``ddagr validate``: the physics against measured wheels and against another simulator."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from ddagr_gym import __version__
from ddagr_gym.commands.output import format_table, output_folder, write_json

if TYPE_CHECKING:
    from ddagr_gym.validation.chrono import Agreement
    from ddagr_gym.validation.single_wheel import RegionError

EXAMPLES = (
    "ddagr validate --data ../shared/reference --output validation",
    "ddagr validate --data ../shared/reference --output validation --overwrite",
)


@dataclass(frozen=True)
class Arguments:
    """Compare the physics with measured wheels and with another simulator.

    Prints tables, and writes them with the figures to a folder. No soil value is fitted; the one fitted variant of the
    wheel comparison says so.

    Attributes:
        data: folder of the reference data (it holds single_wheel/ and chrono_scm_skid.csv).
        output: folder to write: validation.json and figures.
        overwrite: replace an output folder that an earlier command wrote.
    """

    data: Path
    output: Annotated[Path, tyro.conf.arg(aliases=("-o",))]
    overwrite: bool = False


def run(arguments: Arguments) -> None:
    """Run both comparisons, print their tables, write JSON and figures."""
    with output_folder(arguments.output, overwrite=arguments.overwrite) as folder:
        results = {
            "version": __version__,
            "single_wheel": _single_wheel(arguments.data, folder),
            "chrono": _chrono(arguments.data, folder),
        }
        write_json(folder / "validation.json", results)
    print(f"\nwritten to {arguments.output}")


def _single_wheel(data: Path, folder: Path) -> dict[str, Any]:
    from ddagr_gym.reporting.validation_figures import single_wheel_figure
    from ddagr_gym.validation import single_wheel

    trials, wheel = single_wheel.read_trials(data), single_wheel.approximating_torus()
    published = single_wheel.published_soil()
    fitted = single_wheel.fit_contact(trials, wheel, published)
    soils = {"published soil values": published, "FIT of stress peak and exit angle": fitted}
    predictions = {name: single_wheel.predict(trials, wheel, soil) for name, soil in soils.items()}
    errors = {name: single_wheel.region_errors(trials, found) for name, found in predictions.items()}
    for name, regions in errors.items():
        print(f"\nsingle wheel, {name}: rms of model - measured\n{_wheel_table(regions)}")
    curves = {"model": predictions["published soil values"], "FIT": predictions["FIT of stress peak and exit angle"]}
    single_wheel_figure(vars(trials), {name: vars(curve) for name, curve in curves.items()}, folder / "single_wheel")
    return {
        name: {"soil": asdict(soils[name]), "wheel": asdict(wheel), "regions": [asdict(r) for r in regions]}
        for name, regions in errors.items()
    }


def _wheel_table(errors: list[RegionError]) -> str:
    header = (
        "region", "trials", "drawbar/load", "repeats", "lateral/load", "sinkage [mm]", "drawbar bias", "lateral bias",
        "bogged",
    )  # fmt: skip
    rows = [
        (
            e.region, e.trials, _rounded(e.drawbar), _rounded(e.drawbar_repeatability), _rounded(e.lateral),
            _rounded(1e3 * e.sinkage), _rounded(e.drawbar_bias), _rounded(e.lateral_bias), e.bogged,
        )
        for e in errors
    ]  # fmt: skip
    return format_table(header, rows)


def _rounded(value: float) -> float:
    return round(float(value), 3)


def _chrono(data: Path, folder: Path) -> dict[str, Any]:
    from ddagr_gym.reporting.validation_figures import turn_comparison_figure
    from ddagr_gym.validation import chrono

    reference = chrono.read_turns(data)
    turns, agreements = chrono.compare(reference)
    header = ("soil", "right [rad/s]", "left [rad/s]", "yaw rate SCM", "model", "ratio", "v_x SCM", "model",
              "sinkage front SCM [mm]", "model", "rear SCM [mm]", "model")  # fmt: skip
    table = format_table(header, _turn_rows(reference, turns, agreements))
    print(f"\nturns of Chrono's soil contact model (SCM)\n{table}")
    print(f"\nagreement by variant, medians over the turns\n{_agreement_table(agreements)}")
    robot = chrono.reference_robot()
    columns = {
        name: {"yaw_rate": t.yaw_rate, "v_x": t.v_x, "slip": chrono.bank_slips(t, robot), "sinkage": t.sinkage}
        for name, t in {"SCM": reference, **turns}.items()
    }
    drawn = {name: columns[name] for name in chrono.VARIANTS[:2]}
    turn_comparison_figure(
        reference.soil, columns["SCM"], drawn, folder / "chrono", reference_name="SCM"
    )  # fmt: skip
    return {item.variant: _agreement_record(item) for item in agreements}


def _turn_rows(reference: Any, turns: dict[str, Any], agreements: list[Agreement]) -> list[tuple[object, ...]]:
    model, ratio = next(iter(turns.values())), agreements[0].yaw_rate_ratio
    rows: list[tuple[object, ...]] = []
    for i, soil in enumerate(reference.soil):
        front, rear = (1e3 * reference.sinkage[i, part].mean() for part in (slice(0, 2), slice(2, 4)))
        our_front, our_rear = (1e3 * model.sinkage[i, part].mean() for part in (slice(0, 2), slice(2, 4)))
        numbers = (
            *reference.commands[i], reference.yaw_rate[i], model.yaw_rate[i], ratio[i], reference.v_x[i], model.v_x[i],
            front, our_front, rear, our_rear,
        )  # fmt: skip
        rows.append((soil, *(_rounded(number) + 0.0 for number in numbers)))
    return rows


def _agreement_table(agreements: list[Agreement]) -> str:
    header = ("variant", "yaw rate ratio", "least", "largest", "speed ratio", "slip right", "slip left",
              "front sinkage ratio", "rear", "correlation")  # fmt: skip
    rows = []
    for item in agreements:
        record = _agreement_record(item)
        rows.append((item.variant, *(_rounded(value) for value in record["summary"].values())))
    return format_table(header, rows)


def _agreement_record(item: Agreement) -> dict[str, Any]:
    import numpy as np

    def listed(values: Any) -> Any:
        return [None if np.isnan(v) else round(float(v), 5) for v in np.ravel(values)]

    slip = np.nanmedian(item.slip_difference, axis=0)
    summary = {
        "yaw_rate_ratio": float(np.nanmedian(item.yaw_rate_ratio)),
        "yaw_rate_ratio_least": float(np.nanmin(item.yaw_rate_ratio)),
        "yaw_rate_ratio_largest": float(np.nanmax(item.yaw_rate_ratio)),
        "speed_ratio": float(np.nanmedian(item.speed_ratio)),
        "slip_difference_right": float(slip[0]),
        "slip_difference_left": float(slip[1]),
        "front_sinkage_ratio": float(np.median(item.front_sinkage_ratio)),
        "rear_sinkage_ratio": float(np.median(item.rear_sinkage_ratio)),
        "correlation": item.correlation,
    }
    return {"summary": summary, "yaw_rate_ratio": listed(item.yaw_rate_ratio), "speed_ratio": listed(item.speed_ratio)}
