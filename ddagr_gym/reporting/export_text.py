"""What the command and the page of an export say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from ddagr_gym.exporting.files import GAZEBO, MUJOCO, MUJOCO_FILE
from ddagr_gym.exporting.ranges import SHARE, Range
from ddagr_gym.exporting.sensor_faults import what_becomes_of
from ddagr_gym.exporting.working_point import LEFT_TURN, RIGHT_TURN
from ddagr_gym.reporting.text_table import format_table, short

if TYPE_CHECKING:
    from ddagr_gym.exporting.comparison import Compared
    from ddagr_gym.exporting.outcome import Outcome

COMPARED_HEADER = (
    "drive", "right [rad/s]", "left [rad/s]", "yaw rate [rad/s]", "exported", "error",
    "speed [m/s]", "exported", "error",
)  # fmt: skip
RANGE_HEADER = ("name", "value", "low", "high", "unit", "meaning", "source")
EFFECT_HEADER = ("effect", "what becomes of it")

_NOWHERE = (
    "Slip away from the working point: it is one number each, where soil makes it depend on the command, the load and "
    "the place. The table of drives says what that costs.",
    "Speed that is lost in turns, where soil holds a braked wheel better than a driven one.",
    "Sinkage, ruts, rolling resistance as a force, and soil that differs from place to place.",
    "The integral part, friction and power limit of the speed loop, which are in the delay, the lag and the gains.",
    "The ramps, the dead band and the turning limit of the commands: shape the commands before you send them.",
    "Noise that is not white, and quantisation of the sensors.",
)

_OWN = {
    MUJOCO: (
        "The rise of friction with slip, which on soil is gradual: the wheels of the model stick until their friction "
        "is used up, and then slide with all of it.",
        "Torques of motors that lose no speed to the ground: such motors are flywheels in the model (armature).",
        "Time steps longer than the model's 2 ms: contacts and motors are made for it.",
        "Gain and bias of the gyro and the accelerometer, scales of the encoders and the lateness of positions: "
        "MuJoCo's sensors have none. They are numbers of the model (custom/numeric), for whoever reads the sensors. "
        "Position and tilt of the IMU are in the model; of its noise MuJoCo keeps the size and adds none.",
    ),
    GAZEBO: (
        "Delay and lag of the motors: the plugin has neither, only the limits of speed and acceleration.",
        "Gain of the gyro and scales of the encoders: the format has no place for them.",
        "This model was not run in Gazebo. The table of drives is of the differential drive's own formulas with the "
        "commanded track and the rolling radius; friction is that of rigid wheels whose forces balance at the working "
        "point, and a contact solver may make something else of it.",
    ),
}  # fmt: skip

_RANGES = (
    "Whatever two numbers have to do with each other: ranges are of one at a time. Draws of whole robots and soils "
    "are in a calibration's draws.yaml.",
)


def not_carried_over(result: Outcome) -> tuple[str, ...]:
    """Sentences on what another simulator does not get."""
    return (*_OWN.get(result.to, _RANGES), *_NOWHERE, *result.corrected.fixed)


def headline(result: Outcome) -> str:
    """What was exported and how well it turns."""
    name = result.corrected.found.robot.name
    stepped = "stepped in MuJoCo, it" if result.comparison.stepped else "a differential drive with these numbers"
    drives = result.comparison.drives
    return (
        f"{name} ({result.corrected.source}) for {result.to}: {stepped} turns as the corrected simulator within "
        f"{_largest_errors([drives[k] for k in (LEFT_TURN, RIGHT_TURN)])} at the working point, and within "
        f"{_largest_errors(drives)} in all drives."
    )


def _largest_errors(drives: Sequence[Compared]) -> str:
    yaw = max(abs(row.yaw_error or 0.0) for row in drives)
    speed = max(abs(row.speed_error or 0.0) for row in drives)
    return f"{100.0 * yaw:.1f} % (speed {100.0 * speed:.1f} %)"


def compared_rows(compared: Sequence[Compared]) -> list[tuple[str, ...]]:
    """Rows under :data:`COMPARED_HEADER`."""
    return [
        (
            row.drive, short(row.right), short(row.left), f"{row.yaw_rate:z.3f}", f"{row.other_yaw_rate:z.3f}",
            _percent(row.yaw_error), f"{row.speed:z.3f}", f"{row.other_speed:z.3f}", _percent(row.speed_error),
        )
        for row in compared
    ]  # fmt: skip


def _percent(share: float | None) -> str:
    """A signed share in percent; "-" for none."""
    return "-" if share is None else f"{100.0 * share:+.1f} %"


def range_rows(ranges: Mapping[str, Range]) -> list[tuple[str, ...]]:
    """Rows under :data:`RANGE_HEADER`; a fixed number has no range."""
    return [
        (
            name, short(item.value),
            *(("-", "-") if item.distribution == "fixed" else (short(item.low), short(item.high))),
            item.unit, item.meaning, item.source,
        )
        for name, item in ranges.items()
    ]  # fmt: skip


def effect_rows(result: Outcome) -> list[tuple[str, str]]:
    """Rows under :data:`EFFECT_HEADER`."""
    return [(effect.name, what_becomes_of(effect)) for effect in result.corrected.found.effects]


def step_sentence(result: Outcome) -> str:
    """How well a step of the wheel speed agrees, or why that is not known."""
    error = result.comparison.step_error
    if error is not None:
        return f"The wheel speed after a step straight ahead is off by {100.0 * error:.1f} % of its end (rms)."
    if result.to == MUJOCO:
        return (
            f"{MUJOCO_FILE} was not stepped, since the package 'mujoco' is not installed (extra mujoco): the table is "
            "of a differential drive's formulas with the commanded track and the rolling radius."
        )
    return ""


def range_sentence(result: Outcome) -> str:
    """Where low and high come from."""
    return (
        f"Low and high hold {SHARE} % of {result.draws} draws (seed {result.seed}) from {result.corrected.spread}. "
        "A number without them is fixed: nothing says how uncertain it is."
    )


def export_text(result: Outcome) -> str:
    """What the command prints."""
    ranges = [row[:5] for row in range_rows(result.ranges)]
    return "\n\n".join(
        text
        for text in (
            headline(result),
            format_table(COMPARED_HEADER, compared_rows(result.comparison.drives)),
            step_sentence(result),
            format_table(RANGE_HEADER[:5], ranges),
            range_sentence(result),
            "Does not carry over:\n" + "\n".join(f"- {line}" for line in not_carried_over(result)),
        )
        if text
    )
