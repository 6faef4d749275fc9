"""Parts of a robot that a calibration may add to its data sheet, and the parameters of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

from ddagr_gym.diagnosis.answer.drivetrain import HARD, PART_DRIVES, PART_TITLES
from ddagr_gym.identification.parameters import LIMITS, ModelParameter, robot_parameters
from ddagr_gym.parameters import Drivetrain, Robot
from ddagr_gym.physics import layout

GYRO_SCALE_DEVIATION = 0.03
"""Prior of the gyro's scale [-]: data sheets of low-cost gyros promise 3 %."""

DOUBTED_DEVIATION = 0.1
"""Prior of a bank's factor where readings make it suspicious [-] (ours): a gear or a tyre exchanged, a motor controller
with another gain, and within reach a count doubled."""

DELAY_DEVIATION = 0.3
"""Prior of the dead time between command and wheels [s] (ours): 0.2 to 0.43 s on a Husky and a Warthog."""

FILTER_DEVIATION = 0.3
"""Prior of the time constant of a filter of the commands [s] (ours): as long as a dead time may be."""

INTEGRAL_DEVIATION = 5.0
"""Prior of the loop's integral rate [1/s^2] (ours): 0.7 to 4.5 1/s^2 on a Warthog."""

VISCOUS_DEVIATION = 0.5
"""Prior of the friction per speed [1/s] (ours): 0.3 1/s on a Warthog."""

IMBALANCE_DEVIATION = 0.1
"""Prior of the difference of the banks' limits [-] (ours): 0.11 on a Warthog."""

TIME_TO_FULL_SPEED = 0.5
"""In which a robot's motors reach its highest speed [s], which sets the scale of its limits (ours)."""

INTEGRAL_SHARE = 1.0 / 3.0
"""Of the largest acceleration, that the integral part asks for at most (ours): 11.5 of 31 rad/s^2 on a Warthog."""

FRICTION_TIME = 10.0
"""In which Coulomb friction alone would stop a bank from its highest speed [s], which sets its scale (ours)."""

TURNING_SHARE = 0.5
"""Of the highest speed, by which commands let a bank differ from the mean of both at most (ours): 0.55 on a Warthog."""

STEADY_SHARE = 1.0 / 3.0
"""Of the highest speed, at which the power limit takes over from the torque limit (ours)."""

LIMIT_DEVIATION = 1.0
"""Prior of a limit, as the deviation of its logarithm (ours): a factor of three either way."""

NO_LOAD_DEVIATION = 0.3
"""The same of the speed at which the torque limit is used up (ours); it cannot be far from the highest speed."""

FIRST_SHARE = 0.2
"""Of its prior deviation, at which the fit of a part that may be nothing starts (ours): its effect is then there."""


@dataclass(frozen=True)
class Part:
    """One part of a robot that drives may support or not.

    Attributes:
        name: identifier.
        title: in tables.
        parameters: names of its parameters.
        helps: drive from which they can be identified, for a reader.
        needs: names of parts without any of which it does nothing; empty where it needs none.
        usual: whether nearly every robot has it: it stays unless forecasts without it are as good.
        on_data_sheet: whether a data sheet states its values: these hold until all else is fitted.
    """

    name: str
    title: str
    parameters: tuple[str, ...]
    helps: str
    needs: tuple[str, ...] = ()
    usual: bool = False
    on_data_sheet: bool = False


def _of_drivetrain(name: str, parameters: tuple[str, ...], needs: tuple[str, ...] = (), usual: bool = False) -> Part:
    return Part(name, PART_TITLES[name], parameters, PART_DRIVES[name], needs, usual)


OF_BANKS = {"encoder_scale": layout.ENCODER_SCALE, "command_gain": layout.COMMAND_GAIN}
"""Parts that are a factor for each bank, with the entry of a simulator's row that is the right one's. A fit has them
only where readings make them suspicious."""


def factors_of_banks(part: str) -> tuple[str, str]:
    """Names of the parameters of the right and the left bank, of one of :data:`OF_BANKS`."""
    return f"{part}_right", f"{part}_left"


SCALES = ("gyro_scale", *(name for part in OF_BANKS for name in factors_of_banks(part)))
"""Factors on readings and commands, which have no place in a robot."""

PARTS = (
    Part(
        "gyro_scale",
        "scale of the gyro",
        ("gyro_scale",),
        "a drive with poses in which the robot turns by several revolutions to both sides",
        on_data_sheet=True,
    ),
    Part(
        "inertia",
        "mass and yaw inertia",
        ("mass", "yaw_inertia"),
        f"quick reversals of turning: {HARD}",
        on_data_sheet=True,
    ),
    Part(
        "geometry",
        "wheels and their places",
        ("half_wheelbase", "half_track", "half_width", "outer_radius"),
        "slow straight pieces and slow arcs to both sides on firm ground, with poses",
        on_data_sheet=True,
    ),
    Part(
        "encoder_scale",
        "scales of the encoders",
        factors_of_banks("encoder_scale"),
        "straight pieces and arcs to both sides at several speeds, with poses",
    ),
    Part(
        "command_gain",
        "gains of the banks' commands",
        factors_of_banks("command_gain"),
        "commands held for seconds, slow and fast, of both banks in both directions",
    ),
    _of_drivetrain("no_load_speed", ("no_load_speed",)),
    _of_drivetrain("torque_limit", ("acceleration_limit",)),
    _of_drivetrain("friction", ("viscous_rate", "coulomb_friction")),
    _of_drivetrain("integral_limit", ("integral_limit",), ("integral",)),
    _of_drivetrain("limit_imbalance", ("limit_imbalance",), ("torque_limit", "no_load_speed", "power_limit")),
    _of_drivetrain("command_ramp", ("command_ramp",)),
    _of_drivetrain("command_filter", ("command_filter",)),
    _of_drivetrain("mean_ramp", ("mean_ramp",)),
    _of_drivetrain("turning_ramp", ("turning_ramp",)),
    _of_drivetrain("power_limit", ("power_limit",)),
    _of_drivetrain("turning_limit", ("turning_limit",)),
    _of_drivetrain("speed_limit", ("maximum_wheel_speed",)),
    _of_drivetrain("integral", ("integral_rate",)),
    _of_drivetrain("load", ("load_compliance",)),
    _of_drivetrain("speed_loop", ("motor_rate",)),
    _of_drivetrain("command_delay", ("command_delay",), usual=True),
)
"""In the order in which they are tried: what the fewest robots need comes first."""

DATA_SHEET_PARTS = frozenset(part.name for part in PARTS if part.on_data_sheet)
"""Names of the parts whose values a data sheet states."""


def idle_parts(left_out: frozenset[str], robot: Robot) -> frozenset[str]:
    """Parts that do nothing, because a robot has none of those that they act through.

    Args:
        left_out: names of parts that its drives do not support.
        robot: of the data sheet, which may state such a part itself.
    """
    stated = {part_of(name).name for name in LIMITS if is_stated(robot, name)}
    stated |= {"integral"} if robot.drivetrain.integral_rate > 0.0 else set()
    absent = left_out - stated
    return frozenset(part.name for part in PARTS if part.needs and set(part.needs) <= absent) - left_out


def part_named(name: str) -> Part:
    """Part of a name."""
    return next(part for part in PARTS if part.name == name)


def part_of(parameter: str) -> Part:
    """Part that a shared parameter belongs to."""
    return next(part for part in PARTS if parameter in part.parameters)


def is_stated(robot: Robot, name: str) -> bool:
    """Whether a robot's drivetrain has a limit."""
    default = next(item.default for item in fields(Drivetrain) if item.name == name)
    return bool(getattr(robot.drivetrain, name) < default)


def complete_robot(robot: Robot) -> Robot:
    """A robot with every part: limits of a likely size where it states none, and how far each may be off.

    What its data sheet states, values and deviations, stays.
    """
    top = robot.maximum_wheel_speed
    strongest = top / TIME_TO_FULL_SPEED
    likely = {
        "turning_limit": TURNING_SHARE * top,
        "mean_ramp": strongest,
        "turning_ramp": TURNING_SHARE * strongest,
        "command_ramp": strongest,
        "integral_limit": INTEGRAL_SHARE * strongest,
        "acceleration_limit": strongest,
        "no_load_speed": top,
        "power_limit": STEADY_SHARE * strongest * top,
    }
    limits = {name: value for name, value in likely.items() if not is_stated(robot, name)}
    drivetrain = replace(robot.drivetrain, **limits)
    deviations = {
        "command_delay": DELAY_DEVIATION,
        "command_filter": FILTER_DEVIATION,
        "integral_rate": INTEGRAL_DEVIATION,
        # at most as heavy as if each bank had to turn half of the robot's mass at its rim
        "load_compliance": 2.0 / (robot.mass * robot.outer_radius**2),
        "viscous_rate": VISCOUS_DEVIATION,
        "coulomb_friction": top / FRICTION_TIME,
        "limit_imbalance": IMBALANCE_DEVIATION,
        **{
            name: getattr(drivetrain, name) * (NO_LOAD_DEVIATION if name == "no_load_speed" else LIMIT_DEVIATION)
            for name in likely
        },
    }
    return replace(robot, drivetrain=drivetrain, standard_deviations={**deviations, **robot.standard_deviations})


def shared_parameters(robot: Robot, doubted: Sequence[str] = ()) -> tuple[ModelParameter, ...]:
    """Every parameter of the parts of a complete robot that it states as uncertain, and factors beside the robot.

    Args:
        robot: with every part.
        doubted: those of :data:`OF_BANKS` that are in doubt.
    """
    scale = ModelParameter("gyro_scale", "-", (layout.GYRO_SCALE,), True, GYRO_SCALE_DEVIATION, 0.01, -0.3, 0.3)
    known = {name for part in PARTS for name in part.parameters}
    of_banks = (
        ModelParameter(name, "-", (OF_BANKS[part] + bank,), True, DOUBTED_DEVIATION, 0.01, -1.0, 1.0)
        for part in doubted
        for bank, name in enumerate(factors_of_banks(part))
    )
    return (*(p for p in robot_parameters(robot) if p.name in known), scale, *of_banks)


def first_values(parameters: tuple[ModelParameter, ...]) -> dict[str, float]:
    """Values at which a fit of all parts starts: what may be nothing is there, the rest as the data sheet has it."""
    return {p.name: FIRST_SHARE * p.prior for p in parameters if not p.factor and p.low == 0.0 and p.scope is None}


@dataclass(frozen=True)
class RobotModel:
    """A robot and what of it may move: some parts are fitted, the others are as the data sheet has them.

    Attributes:
        robot: in which limits of the parts that are left out are not there.
        parameters: of all parts, of the soils, and factors on readings and commands; held ones have a prior of 0.
    """

    robot: Robot
    parameters: tuple[ModelParameter, ...]

    def without(self, parts: frozenset[str], data_sheet: Robot) -> RobotModel:
        """The same without some parts."""
        names = frozenset(name for part in PARTS if part.name in parts for name in part.parameters)
        return self.held(names, data_sheet)

    def held(self, names: frozenset[str], data_sheet: Robot) -> RobotModel:
        """The same with some parameters as the data sheet has them."""
        gone = {name: getattr(data_sheet.drivetrain, name) for name in names & LIMITS}
        robot = replace(self.robot, drivetrain=replace(self.robot.drivetrain, **gone))
        return RobotModel(robot, tuple(replace(p, prior=0.0) if p.name in names else p for p in self.parameters))

    @property
    def free(self) -> frozenset[str]:
        """Names of the parameters that a fit moves."""
        return frozenset(p.name for p in self.parameters if p.prior > 0.0)
