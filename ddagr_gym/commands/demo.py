"""``ddagr demo``: the main job on a small scale, and a folder to look at."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from ddagr_gym.commands.output import Section, output_folder, write_text
from ddagr_gym.errors import at_least
from ddagr_gym.progress import LinePrinter

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ddagr_gym.evaluation.runs import TurnRun

    Array = NDArray[np.float64]

EXAMPLES = (
    "ddagr demo",
    "ddagr demo --output my_demo --seed 7",
    "ddagr demo --recording drive.csv.gz --robot warthog --soil lete_sand_wong",
)

SAMPLE = "replay_demo.parquet"
"""Simulated drive that ships with the package, in ``ddagr_gym/data``."""
SAMPLE_SOIL = "sandy_loam_lll_15"
"""Soil from which the sample's refit starts; it was driven on a somewhat different one."""

HARD_GROUND = "firm_ground"
"""Nominal soil of a given recording, unless another is named: the refit moves it."""

_SPEED = 0.20  # [m/s], the reference speed of the row turn (theory: control, section 1)


@dataclass(frozen=True)
class Arguments:
    """Turn between rows, replay and diagnose drives, compare controllers: pages, figures, video.

    Attributes:
        output: folder to write; one that an earlier command wrote is replaced.
        radius: radius of the turn [m].
        side: left or right.
        seed: random seed of the soil and the sensor noise.
        recording: drive to replay, in any format that `ddagr import` takes; a simulated one that ships with the
            package when it is left out.
        robot: the robot that drove, where the recording does not say.
        soil: from which the replay's refit starts.
    """

    output: Annotated[Path, tyro.conf.arg(aliases=("-o",))] = Path("ddagr_demo")
    radius: float = 0.80
    side: str = "left"
    seed: int = 1
    recording: Path | None = None
    robot: str = ""
    soil: str = ""


def run(arguments: Arguments) -> None:
    """Run the demonstration and print where its page lies."""
    from ddagr_gym.commands.demo_diagnosis import diagnosis_step
    from ddagr_gym.commands.demo_evaluation import evaluation_step

    at_least(**{"--seed": (arguments.seed, 0)})
    start = time.monotonic()
    drive = _drive_to_replay(arguments)
    with output_folder(arguments.output, overwrite=True) as folder:
        sections = [
            turn_step(arguments, folder),
            replay_step(drive, folder),
            diagnosis_step(folder, arguments.seed),
            evaluation_step(folder),
        ]
        write_text(folder / "index.html", _page(sections))
    for section in sections:
        print(f"\n{section.title}\n{section.text}")
    print(f"\nDone in {time.monotonic() - start:.0f} s. Open {arguments.output.resolve() / 'index.html'}")


def turn_step(arguments: Arguments, folder: Path) -> Section:
    """A row turn by the default controller on a drawn soil; figure, video and CSV into the folder."""
    from ddagr_gym.evaluation.controllers import DEFAULT
    from ddagr_gym.evaluation.shown import estimated_track

    driven = _drive(arguments)
    track = estimated_track(driven, DEFAULT)
    print("Writing the CSV, the figure and the video ...", flush=True)
    _write(folder, driven, track)
    html = """<video controls muted loop src="row_turn.mp4"></video>
<div class="wide"><img src="row_turn.svg" alt="Path, speeds, yaw rate, slip and sinkage of the turn"></div>
<p>Dotted: where the controller's filter believes the robot to be. It knows the pose at the start, and from there on
only accelerometer, gyro, encoders and the commands; a network corrects it.</p>
<p>Data: <a href="row_turn.csv">row_turn.csv</a> (sensor columns, and the truth as <code>true_...</code>).</p>"""
    return Section("A row turn on soft soil", _summary(driven, track), html)


@dataclass(frozen=True)
class DriveToReplay:
    """What the replay step needs.

    Attributes:
        recording: the drive.
        robot: nominal robot's name.
        soil: nominal soil's name.
        words: what the recording is.
    """

    recording: Any
    robot: str
    soil: str
    words: str


def _drive_to_replay(arguments: Arguments) -> DriveToReplay:
    """Read first, so that a wrong path or name ends the demonstration at its start."""
    from ddagr_gym.api.replay import driven_robot
    from ddagr_gym.presets import get_soil
    from ddagr_gym.recordings.load import load_recording

    shipped = Path(__file__).resolve().parents[1] / "data" / SAMPLE
    path = shipped if arguments.recording is None else arguments.recording
    recording = load_recording(path, None, arguments.robot or None)
    driven_robot(arguments.robot or None, [recording])
    robot = arguments.robot or recording.meta.robot
    soil = arguments.soil or (SAMPLE_SOIL if arguments.recording is None else HARD_GROUND)
    get_soil(soil)
    words = "a simulated drive on weaker soil, with slower motors, than the nominal simulator's"
    return DriveToReplay(recording, robot, soil, words if arguments.recording is None else path.name)


def replay_step(drive: DriveToReplay, folder: Path) -> Section:
    """A recording driven again in the simulator, with a refit; report, figures and page into ``folder/replay``."""
    import ddagr_gym
    from ddagr_gym.reporting.replay_text import lead_text

    print(f"Replaying {drive.recording.meta.source} and refitting the simulator ...", flush=True)
    replayed = folder / "replay"
    result = ddagr_gym.replay(drive.recording, drive.robot, drive.soil, refit=True, progress=LinePrinter())
    result.report(replayed, progress=LinePrinter())
    overview = min(path.name for path in replayed.glob("*.png") if not path.stem.endswith("_residuals"))
    html = f"""<p>Replayed: {escape(drive.words)}. Errors are those on the part of the drive that no fit has seen.</p>
<div class="wide"><a href="replay/index.html"><img src="replay/{escape(overview)}" alt="Roll-outs and errors"></a></div>
<p>Everything about it: <a href="replay/index.html">page</a>, <a href="replay/replay.json">JSON</a>.</p>"""
    return Section("A recording driven again in the simulator", lead_text(result.document), html)


def _drive(arguments: Arguments) -> TurnRun:
    from ddagr_gym.envs.options import make_settings
    from ddagr_gym.evaluation.controllers import DEFAULT, find_controller, needs_filter
    from ddagr_gym.evaluation.runs import drive_turn

    settings = make_settings(
        radius=arguments.radius, side=arguments.side, speed=_SPEED, ekf_features=needs_filter(DEFAULT)
    )
    turn = settings.turn(arguments.radius, arguments.side, _SPEED)
    print(f"Driving a row turn by {DEFAULT} on a soil drawn from the default range ...", flush=True)
    return drive_turn(find_controller(DEFAULT, turn), settings, arguments.seed)


def _summary(driven: TurnRun, track: Array) -> str:
    from ddagr_gym.commands.output import format_table
    from ddagr_gym.evaluation.controllers import DEFAULT
    from ddagr_gym.evaluation.metrics import turn_metrics

    turn = driven.episode.turn
    metrics = turn_metrics(driven.columns, turn, driven.episode.robot)
    radius, exit_ = metrics.turn, metrics.exit
    rows: list[tuple[str, str]] = [("commanded radius", f"{turn.radius:.3f} m to the {turn.side}")]
    if radius.error is not None:
        rows += [("driven radius", f"{radius.radius:.3f} m"), ("turn radius error", f"{100 * radius.error:+.1f} %")]
    if exit_ is not None:
        rows += [("lateral error at the next row", f"{1e3 * exit_.lateral_error:+.0f} mm")]
    rows += [("every wheel fits its furrow", "yes" if driven.success else "no")]
    rows += _estimate_rows(driven, track)
    return format_table((f"row turn by {DEFAULT}, the default controller", "value"), rows)


def _estimate_rows(driven: TurnRun, track: Array) -> list[tuple[str, str]]:
    from ddagr_gym.evaluation.metrics import turn_radius_error

    turn, columns = driven.episode.turn, driven.columns
    x, y, yaw = track.T
    radius = turn_radius_error(x, y, yaw, turn.radius, turn.side).radius
    off = math.hypot(x[-1] - columns["true_x"][-1], y[-1] - columns["true_y"][-1])
    rows = [] if radius is None else [("radius estimated by the Kalman filter", f"{radius:.3f} m")]
    return [*rows, ("estimated path off at the end", f"{1e3 * off:.0f} mm")]


def _write(folder: Path, driven: TurnRun, track: Array) -> None:
    from ddagr_gym.recordings.storage import save_drive
    from ddagr_gym.rendering.render import SceneRenderer
    from ddagr_gym.rendering.scene import scenes, turn_stage
    from ddagr_gym.rendering.video import write_video
    from ddagr_gym.reporting.figures import turn_figure

    episode = driven.episode
    save_drive(folder / "row_turn.csv", driven.columns, episode.robot)
    columns = driven.columns | {"estimated_x": track[:, 0], "estimated_y": track[:, 1]}
    turn_figure(columns, episode.turn, folder / "row_turn.png", robot=episode.robot, soil_name="a drawn soil")
    stage = turn_stage(episode.turn, episode.robot, "a drawn soil")
    renderer = SceneRenderer()
    frames = (renderer.draw(scene) for scene in scenes(columns, stage, side=episode.turn.side))
    write_video(folder / "row_turn.mp4", frames)
    renderer.close()


def _page(sections: Sequence[Section]) -> str:
    parts = [f"<h1>{escape(s.title)}</h1>\n<pre>{escape(s.text)}</pre>\n{s.html}" for s in sections]
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>ddagr-gym demo</title>
<style>
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #222; }}
h1 {{ font-size: 1.5rem; margin-top: 3rem }} h1:first-child {{ margin-top: 0 }}
img, video {{ width: 100%; height: auto; display: block; margin: 1rem 0; }}
.wide {{ overflow-x: auto }} .wide img {{ min-width: 40rem }}
pre {{ background: #f4f4f2; padding: .8rem; overflow-x: auto; font-size: .85rem }}
</style></head><body>
{chr(10).join(parts)}
</body></html>
"""
