"""``ddagr demo``: the main job on a small scale, and a folder to look at."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ddagr_gym.commands.output import output_folder, write_text

EXAMPLES = (
    "ddagr demo",
    "ddagr demo --output my_demo --seed 7",
)


@dataclass(frozen=True)
class Arguments:
    """Drive a row turn and write a report folder: page, figure, video and CSV.

    Attributes:
        output: folder to write; one that an earlier command wrote is replaced.
        radius: of the turn [m].
        side: left or right.
        seed: of the soil and the sensor noise.
    """

    output: Path = Path("ddagr_demo")
    radius: float = 0.80
    side: str = "left"
    seed: int = 1


def run(arguments: Arguments) -> None:
    """Run the demonstration and print where its page lies."""
    start = time.monotonic()
    with output_folder(arguments.output, overwrite=True) as folder:
        print("Calibrating two constant bank speeds on the nominal soil ...", flush=True)
        turn_run, summary = _drive(arguments)
        print("Writing the CSV, the figure and the video ...", flush=True)
        _write(folder, turn_run)
        write_text(folder / "index.html", _page(summary))
    print(summary)
    print(f"\nDone in {time.monotonic() - start:.0f} s. Open {arguments.output.resolve() / 'index.html'}")


def _drive(arguments: Arguments) -> tuple[Any, str]:
    from ddagr_gym.envs.options import make_settings
    from ddagr_gym.evaluation.calibration import calibrate_constant_speeds
    from ddagr_gym.evaluation.metrics import turn_metrics
    from ddagr_gym.evaluation.runs import drive_turn
    from ddagr_gym.presets import get_robot, get_soil

    settings = make_settings(radius=arguments.radius, side=arguments.side)
    turn = settings.turn(arguments.radius, arguments.side)
    controller = calibrate_constant_speeds(get_robot("ddagr"), get_soil("thesis_a1"), turn)
    print("Driving a row turn on a soil drawn from the default range ...", flush=True)
    driven = drive_turn(controller, settings, arguments.seed)
    metrics = turn_metrics(driven.columns, driven.episode.turn, driven.episode.robot)
    return driven, _summary(driven, metrics)


def _summary(driven: Any, metrics: Any) -> str:
    from ddagr_gym.commands.output import format_table

    radius, exit_ = metrics.turn, metrics.exit
    turn = driven.episode.turn
    rows: list[tuple[str, str]] = [("commanded radius", f"{turn.radius:.3f} m to the {turn.side}")]
    if radius.error is not None:
        rows += [("driven radius", f"{radius.radius:.3f} m"), ("turn radius error", f"{100 * radius.error:+.1f} %")]
    if exit_ is not None:
        rows += [("lateral error at the next row", f"{1e3 * exit_.lateral_error:+.0f} mm")]
    rows += [("every wheel fits its furrow", "yes" if driven.success else "no")]
    return format_table(("row turn by two constant speeds (B1)", "value"), rows)


def _write(folder: Path, driven: Any) -> None:
    from ddagr_gym.commands.simulate import write_recording
    from ddagr_gym.reporting.figures import turn_figure
    from ddagr_gym.reporting.render import SceneRenderer
    from ddagr_gym.reporting.scene import scenes, turn_stage
    from ddagr_gym.reporting.video import write_video

    columns, episode = driven.columns, driven.episode
    write_recording(folder / "row_turn.csv", columns, episode.robot)
    turn_figure(columns, episode.turn, folder / "row_turn.png", robot=episode.robot, soil_name="a drawn soil")
    stage = turn_stage(episode.turn, episode.robot, "a drawn soil")
    renderer = SceneRenderer()
    frames = (renderer.draw(scene) for scene in scenes(columns, stage, side=episode.turn.side))
    write_video(folder / "row_turn.mp4", frames)
    renderer.close()


def _page(summary: str) -> str:
    from html import escape

    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>ddagr-gym demo</title>
<style>
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #222; }}
img, video {{ width: 100%; height: auto; display: block; margin: 1rem 0; }}
pre {{ background: #f4f4f2; padding: .8rem; overflow-x: auto; }}
</style></head><body>
<h1>A row turn on soft soil</h1>
<pre>{escape(summary)}</pre>
<video controls muted loop src="row_turn.mp4"></video>
<img src="row_turn.svg" alt="Path, speeds, yaw rate, slip and sinkage of the turn">
<p>Data: <a href="row_turn.csv">row_turn.csv</a> (sensor columns, and the truth as <code>true_...</code>).</p>
</body></html>
"""
