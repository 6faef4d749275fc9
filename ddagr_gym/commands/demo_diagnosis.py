"""The demonstration's diagnosis: two short drives on ground that slopes, in a simulator that is not the nominal one."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from ddagr_gym.commands.output import Section
from ddagr_gym.progress import LinePrinter

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ddagr_gym.diagnosis.gates.thresholds import Thresholds
    from ddagr_gym.recordings.schema import Recording

SECONDS = 30.0
"""Length of a drive [s]."""

ROBOT, SOIL = "ddagr", "thesis_a1"
MISSING = "slope=0.04,direction=2.0"
"""What the drives have and the nominal simulator lacks."""

WORLD = "pressure law"
"""Structure of the simulator that made them, of :data:`ddagr_gym.diagnosis.null_bank.structural_variants.KINDS`."""

_RATE, _POSE_RATE = 50.0, 5.0  # [Hz], of sensors and poses (ours): usual for a field robot
_REACH = 20.0  # [m], of the varying ground from the start (ours): a drive goes 10 m at most


def drives(seed: int) -> tuple[Recording, ...]:
    """Two drives, to and fro, in a world of another soil law and with soil that varies from place to place.

    Args:
        seed: of the world and the sensor noise.
    """
    import numpy as np

    from ddagr_gym.diagnosis.null_bank.structural_variants import draw_world
    from ddagr_gym.parameters import Imu, PoseReceiver, Sensors
    from ddagr_gym.physics.effects import load_effects
    from ddagr_gym.presets import get_robot, get_soil
    from ddagr_gym.recordings.schema import Recording
    from ddagr_gym.simulator import simulate

    robot, soil = get_robot(ROBOT), get_soil(SOIL)
    world = draw_world(WORLD, soil, _REACH, np.random.default_rng(seed))
    sensors = Sensors(Imu(sample_rate=_RATE), pose=PoseReceiver(_POSE_RATE))
    effects = (*world.changes, *load_effects(MISSING))
    made = []
    for number, commands in enumerate(_commands()):
        columns = simulate(
            robot, soil, commands, sensors=sensors, effects=effects, field=world.field, numerics=world.numerics,
            seed=seed + number,
        )  # fmt: skip
        read = {name: values for name, values in columns.items() if not name.startswith("true_")}
        made.append(Recording.from_columns(read, robot, source=f"drive {number + 1}"))
    return tuple(made)


def _commands() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Straights, arcs to both sides and turns on the spot, 3 s each; the second drive mirrors the first."""
    import numpy as np

    steps = [(0.9, 0.9), (1.1, 0.5), (0.9, 0.9), (0.6, -0.6), (1.0, 1.0), (0.5, 1.1), (0.7, 0.7), (-0.6, 0.6)]
    steps += [(1.2, 1.2), (1.0, 0.2)]
    length = int(SECONDS * _RATE / len(steps))
    first = np.concatenate([np.tile(step, (length, 1)) for step in steps])
    return first, np.ascontiguousarray(first[::-1, ::-1])


def diagnosis_step(folder: Path, seed: int = 1, thresholds: Thresholds | None = None) -> Section:
    """Diagnose the drives; page, figures and files into ``folder/diagnosis``.

    Args:
        folder: of the demonstration, which exists.
        seed: of the drives.
        thresholds: of the gate; those that ship with the package by default.
    """
    import ddagr_gym
    from ddagr_gym.api.diagnosis_result import PAGE

    print("Diagnosing two drives on ground of which the nominal simulator does not know that it slopes ...", flush=True)
    progress = LinePrinter("ddagr diagnose: ")
    result = ddagr_gym.diagnose(
        drives(seed), ROBOT, SOIL, thresholds=thresholds, seed=seed, threads=2, progress=progress
    )
    result.report(folder / "diagnosis")
    html = f"""<p>The drives were simulated on ground that slopes ({escape(MISSING)}), by a simulator with another
soil law ({escape(WORLD)}); the diagnosis knew neither.</p>
<p>Everything about it: <a href="diagnosis/{PAGE}">page</a>, <a href="diagnosis/diagnosis.json">JSON</a>, and the
<a href="diagnosis/effects.yaml">effects file</a> that <code>gym.make</code>, <code>ddagr simulate</code> and
<code>ddagr replay</code> load.</p>"""
    return Section("What the nominal simulator leaves out", str(result), html)
