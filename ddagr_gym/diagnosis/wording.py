"""Effects in plain words: what is missing and how big it is."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from ddagr_gym.diagnosis.answer.amounts import DEGREES, Amount, Amounts, fixed, number, quantity, unit_in_words
from ddagr_gym.diagnosis.answer.channel_faults import CHANNEL_FAULT_TITLES
from ddagr_gym.diagnosis.answer.drivetrain import PART_TITLES
from ddagr_gym.physics.effects.registry import effect_kinds

CHANNEL_NAMES = {
    "specific_force_x": "forward specific force", "specific_force_y": "specific force to the left",
    "yaw_rate": "yaw rate", "encoder_right": "right encoder", "encoder_left": "left encoder",
    "pose_x": "position x", "pose_y": "position y", "pose_yaw": "heading",
    "local_strength": "soil strength by window", "local_stiffness": "soil stiffness by window",
    "local_split": "soil left/right by window", "local_accelerometer_x": "accelerometer x by window",
    "local_accelerometer_y": "accelerometer y by window", "local_gyro": "gyro by window",
}  # fmt: skip
"""Channels, and what a window may take over of them, for people."""

_UNEVEN_BANKS = 0.3
"""Share by which the banks' delays differ from their mean before both are reported (ours)."""

_ASIDE = 0.05
"""Distance of a hitch from the middle that is reported [m] (ours)."""

_TAKEN_BACK = 0.1
"""Rate at which an integral part takes a loss back, below which it is not reported [1/s] (ours: half the least)."""

_UNBOUNDED = 1e5
"""Onsets and limits beyond it mean always, and none."""


def _towards(amount: Amount, words: tuple[str, str], factor: float, unit: str) -> str:
    """Size and one of two directions, by the sign."""
    return f"{quantity(amount.scaled(factor), unit)} {words[0] if amount.value >= 0.0 else words[1]}"


def _factor(amount: Amount, words: tuple[str, str]) -> str:
    """A factor as percent more or less."""
    return f"{quantity(amount.scaled(100.0, -100.0), '%')} {words[0] if amount.value >= 1.0 else words[1]}"


def _is_large(amount: Amount, neutral: float, least: float) -> bool:
    return abs(amount.value - neutral) >= least


def _pair(a: Amounts, names: tuple[str, str], parts: tuple[str, str], least: float, neutral: float = 0.0) -> str:
    """Both parts of a sentence, or the one that is large enough to matter."""
    large = [text for name, text in zip(names, parts, strict=True) if _is_large(a[name], neutral, least)]
    return " and ".join(large or [parts[0]])


def _compass(amount: Amount, flip: bool = False) -> str:
    """A direction beyond -180 and up to 180 degrees, or the opposite one."""
    degrees = amount.scaled(DEGREES)
    turns = 360.0 * math.ceil((degrees.value + 180.0 * flip - 180.0) / 360.0) - 180.0 * flip
    turned = degrees.scaled(1.0, -turns)
    return f"{'−' if turned.value < 0.0 else ''}{quantity(turned, 'degrees')}"


def _line(amount: Amount) -> str:
    """Direction of a line, which has no front end: beyond -90 and up to 90 degrees from the x axis."""
    degrees = amount.scaled(DEGREES)
    turned = degrees.scaled(1.0, -180.0 * math.ceil((degrees.value - 90.0) / 180.0))
    return f"{'−' if turned.value < 0.0 else ''}{quantity(turned, 'degrees')} from the x axis"


def _slope(a: Amounts) -> str:
    angle = quantity(a["angle"].scaled(DEGREES), "degrees")
    towards = _compass(a["direction"], a["angle"].value < 0.0)
    return f"the ground slopes {angle}, rising towards {towards} from the x axis"


def _soil(a: Amounts) -> str:
    strength = _factor(a["strength"], ("stronger", "weaker"))
    stiffness = _factor(a["stiffness"], ("stiffer", "softer"))
    return _pair(a, ("strength", "stiffness"), (strength, stiffness), 0.02, 1.0)


def _soil_change(a: Amounts) -> str:
    onset = a.get("onset")
    since = f" from {quantity(onset, 's')} on" if onset is not None and abs(onset.value) < _UNBOUNDED else ""
    return f"the soil is {_soil(a)} than the model's{since}"


def _soil_patch(a: Amounts) -> str:
    place = f"({fixed(a['centre_x'].value, 2)}, {fixed(a['centre_y'].value, 2)}) m"
    if "half_length" not in a or a["half_length"].value == 0.0:
        return f"the soil is {_soil(a)} within {quantity(a['radius'], 'm')} of {place}"
    width = quantity(a["radius"].scaled(2.0), "m")
    return f"the soil is {_soil(a)} in a band {width} wide that runs at {_line(a['bearing'])} through {place}"


def _encoder_scale(a: Amounts) -> str:
    parts = [
        f"the {bank} encoder reads {quantity(a[bank].scaled(100.0, -100.0), '%')} "
        f"too {'much' if a[bank].value >= 1.0 else 'little'}"
        for bank in ("right", "left")
    ]
    looped = ", and the speed loop believes it" if "loop" in a and a["loop"].value > 0.5 else ""
    return _pair(a, ("right", "left"), (parts[0], parts[1]), 0.002, 1.0) + looped


def _droop(a: Amounts) -> str:
    of = "of both banks" if "shared" in a and a["shared"].value > 0.25 else "of axle torque"
    if "power" in a and a["power"].value > 0.5:
        of = "of both banks at 0.7 rad/s, in proportion to power and speed as with a weak battery"
    lost = f"the motors slow down under load, by {quantity(a['droop'].scaled(1e3), 'mrad/s')} per N m {of}"
    if "recovery" not in a or a["recovery"].value < _TAKEN_BACK:
        return lost
    return f"{lost}, until an integral part takes it back, at {quantity(a['recovery'], '1/s')}"


def _payload(a: Amounts) -> str:
    change = "heavier" if a["mass"].value >= 0.0 else "lighter"
    along = _towards(a["x"], ("forward", "back"), 1.0, "m")
    across = _towards(a["y"], ("left", "right"), 1.0, "m")
    middle = math.hypot(a["x"].value, a["y"].value) < 0.05
    where = "above the centre" if middle else f"{along} and {across} of the centre"
    return f"the robot is {quantity(a['mass'], 'kg')} {change}, {where}"


def _centre_of_mass(a: Amounts) -> str:
    along = _towards(a["x"], ("forward", "back"), 100.0, "cm")
    across = _towards(a["y"], ("to the left", "to the right"), 100.0, "cm")
    return f"the centre of mass lies {_pair(a, ('x', 'y'), (along, across), 0.005)} of where the model has it"


def _accelerometer_bias(a: Amounts) -> str:
    along, across = quantity(a["x"], "m/s²", signed=True), quantity(a["y"], "m/s²", signed=True)
    parts = (f"{along} forward", f"{across} to the left")
    return f"the accelerometer is off by {_pair(a, ('x', 'y'), parts, 0.01)}"


def _accelerometer_sign(a: Amounts) -> str:
    axes = [word for name, word in (("flip_x", "forward"), ("flip_y", "sideways")) if a[name].value >= 0.5]
    return f"the accelerometer's {' and '.join(axes) or 'forward'} axis is reversed"


def _lever_arm(a: Amounts) -> str:
    along = _towards(a["x"], ("forward", "back"), 1.0, "m")
    across = _towards(a["y"], ("to the left", "to the right"), 1.0, "m")
    return f"the IMU sits {_pair(a, ('x', 'y'), (along, across), 0.03)} of where the model has it"


def _tilt(a: Amounts) -> str:
    roll = _towards(a["roll"], ("left side up", "right side up"), DEGREES, "degrees")
    pitch = _towards(a["pitch"], ("nose down", "nose up"), DEGREES, "degrees")
    return f"the IMU is tilted {_pair(a, ('roll', 'pitch'), (roll, pitch), 0.003)}"


def _saturation(a: Amounts) -> str:
    parts = []
    if a["speed_limit"].value < 1e3:
        parts.append(f"turn no faster than {quantity(a['speed_limit'], 'rad/s')}")
    if a["acceleration_limit"].value < _UNBOUNDED:
        parts.append(f"change their speed by no more than {quantity(a['acceleration_limit'], 'rad/s²')}")
    if "turning_limit" in a and a["turning_limit"].value < 1e3:
        most = quantity(a["turning_limit"], "rad/s")
        parts.append(f"differ from their mean by no more than {most}, a limit of the turning")
    if "torque_limit" in a and a["torque_limit"].value < _UNBOUNDED:
        parts.append(f"have no more torque than {quantity(a['torque_limit'], 'N m')} each, a limit of the torque")
    if "power_limit" in a and a["power_limit"].value < _UNBOUNDED:
        parts.append(f"have no more power than {quantity(a['power_limit'], 'W')} each, a limit of the power")
    return f"the banks {' and '.join(parts)}" if parts else "the banks have a limit that was not reached"


def _of_turning(a: Amounts) -> bool:
    return "turning" in a and a["turning"].value > 0.5


def _lag(a: Amounts) -> str:
    if _of_turning(a):
        return f"the robot's turning answers {quantity(a['lag'], 's')} more slowly, its speed as it should"
    slower = a["lag"].value >= 0.0
    share = a["second_pole"].value if slower and "second_pole" in a else 0.0
    pole = " (mostly by a second pole)" if share >= 0.5 else ""
    rising = ", mostly while they speed up" if "slowing" in a and a["slowing"].value < 0.5 else ""
    return f"the motors answer {quantity(a['lag'], 's')} {'more slowly' if slower else 'faster'}{pole}{rising}"


def _deadband(a: Amounts) -> str:
    loss = " and larger ones lose as much" if a["loss"].value >= 0.5 else ""
    if _of_turning(a):
        return f"turns of less than {quantity(a['width'], 'rad/s')} about the banks' mean are not made{loss}"
    return f"commands below {quantity(a['width'], 'rad/s')} move nothing{loss}"


def _bulldozing(a: Amounts) -> str:
    heaped = " once they have heaped it up" if "way" in a and a["way"].value > 0.0 else ""
    return f"wheels that slide sideways push soil ({quantity(a['scale'])} times the theoretical pressure{heaped})"


def _hold(a: Amounts) -> str:
    sensors = [name for name in ("accelerometer", "gyro", "encoders", "pose") if name in a and a[name].value >= 0.5]
    return f"readings are repeated for {quantity(a['duration'], 's')} ({', '.join(sensors) or 'some sensors'})"


def _split(a: Amounts) -> str:
    return f"the soil on the left is {_soil(a)} than on the right"


def _delay(a: Amounts) -> str:
    text = f"commands act {quantity(a['delay'], 's')} late"
    uneven = a["imbalance"].value if "imbalance" in a else 0.0
    if abs(uneven) < _UNEVEN_BANKS:
        return text
    right, left = (a["delay"].value * (1.0 + sign * uneven) for sign in (1.0, -1.0))
    return f"{text} on average, by {right:.2g} s on the right and {left:.2g} s on the left"


def _gain(a: Amounts) -> str:
    parts = [
        f"the {bank} wheels turn {quantity(a[bank].scaled(100.0, -100.0), '%')} "
        f"{'faster' if a[bank].value >= 1.0 else 'slower'} than the model's for the same command"
        for bank in ("right", "left")
    ]
    return _pair(a, ("right", "left"), (parts[0], parts[1]), 0.002, 1.0)


def _towed_drag(a: Amounts) -> str:
    place = f"{quantity(a['hitch_distance'], 'm')} behind the centre"
    side = a["hitch_side"].value if "hitch_side" in a else 0.0
    if abs(side) >= _ASIDE:
        place += f" and {abs(side):.2g} m to the {'left' if side > 0.0 else 'right'}"
    rope = a["rope"].value if "rope" in a else 0.0
    load = f", on a rope of {rope:.1g} m" if rope >= _ASIDE else ""
    return f"something pulls back with {quantity(a['force'], 'N')}, {place}{load}"


def _radius(a: Amounts) -> str:
    sides = ("right", "left") if a["difference"].value >= 0.0 else ("left", "right")
    return f"the {sides[0]} wheels are {quantity(a['difference'].scaled(100.0), '%')} larger than the {sides[1]} ones"


def _multipass(a: Amounts) -> str:
    word = "stiffer" if a["stiffening"].value >= 0.0 else "softer"
    return f"in the ruts of the front wheels the soil is {quantity(a['stiffening'].scaled(100.0), '%')} {word}"


def _wheels(kind: str, exchanged: bool) -> Callable[[Amounts], str]:
    """Sentence on encoders or commands that are other ones than the map says."""

    def sentence(a: Amounts) -> str:
        backwards = [bank for bank in ("right", "left") if a[bank].value < 0.0]
        if not exchanged:
            which = f"the {backwards[0]} {kind}s" if len(backwards) == 1 else f"the {kind}s"
            return f"{which} count backwards"
        also = f", and what is in the {' and '.join(backwards)} counts backwards" if backwards else ""
        return f"the {kind}s of the right and the left side are exchanged{also}"

    return sentence


def _upside_down(a: Amounts) -> str:
    cosine = math.cos(a["yaw"].value)
    how = "rolled over" if cosine > 0.5 else "pitched over" if cosine < -0.5 else "and turned by 90 degrees"
    return f"the IMU is upside down ({how})"


SENTENCES: Mapping[str, Callable[[Amounts], str]] = {
    "accelerometer_bias": _accelerometer_bias,
    "accelerometer_sign": _accelerometer_sign,
    "centre_of_mass_offset": _centre_of_mass,
    "command_deadband": _deadband,
    "command_delay": _delay,
    "command_gain": _gain,
    "encoder_scale": _encoder_scale,
    "gyro_bias": lambda a: (
        f"the gyro is off by {quantity(a['bias'].scaled(DEGREES), 'degrees/s', signed=True)} (positive to the left)"
    ),
    "gyro_scale": lambda a: (
        f"the gyro reads {quantity(a['scale'].scaled(100.0, -100.0), '%')} "
        f"too {'much' if a['scale'].value >= 1.0 else 'little'}"
    ),
    "gyro_sign": lambda a: "the gyro's sign is reversed",
    "imu_lever_arm": _lever_arm,
    "imu_misalignment": lambda a: (
        f"the IMU is turned {_towards(a['yaw'], ('to the left', 'to the right'), DEGREES, 'degrees')}"
    ),
    "imu_tilt": _tilt,
    "lateral_bulldozing": _bulldozing,
    "motor_droop": _droop,
    "motor_lag": _lag,
    "motor_saturation": _saturation,
    "multipass": _multipass,
    "payload": _payload,
    "pose_latency": lambda a: f"poses come {quantity(a['latency'], 's')} late",
    "sensor_hold": _hold,
    "slip_sinkage": lambda a: (
        f"wheels that slip sink deeper (the sinkage exponent grows by {quantity(a['growth'])} from slip 0 to 1)"
    ),
    "slope": _slope,
    "soil_change": _soil_change,
    "soil_patch": _soil_patch,
    "soil_split": _split,
    "towed_drag": _towed_drag,
    "viscous_drag": lambda a: f"something holds the robot back with {quantity(a['coefficient'], 'N')} per m/s",
    "wheel_radius_mismatch": _radius,
    "encoders_exchanged": _wheels("encoder", exchanged=True),
    "encoders_reversed": _wheels("encoder", exchanged=False),
    "commands_exchanged": _wheels("command", exchanged=True),
    "commands_reversed": _wheels("command", exchanged=False),
    "imu_upside_down": _upside_down,
    "heading_reversed": lambda a: "the pose's heading turns the wrong way",
    "path_mirrored": lambda a: "the pose's path is mirrored",
}
"""One clause per effect of the library and per fault of channels, from its amounts."""


def describe(name: str, parameters: Amounts) -> str:
    """An effect with its sizes as a clause: lower case, no full stop.

    Effects of other packages, and those with parameters left out, are described by their title and all sizes given.

    Args:
        name: of the effect.
        parameters: by field.
    """
    try:
        return SENTENCES[name](parameters)
    except KeyError:
        units = {key: unit_in_words(item.unit) for key, item in parameters.items()}
    if name in PART_TITLES:
        return f"{PART_TITLES[name]} ({', '.join(quantity(item, units[key]) for key, item in parameters.items())})"
    sizes = [f"{key.replace('_', ' ')} {quantity(item, units[key], signed=True)}" for key, item in parameters.items()]
    return f"{in_sentence(name)} ({', '.join(sizes)})" if sizes else in_sentence(name)


def title(name: str) -> str:
    """An effect's title; the name itself, spelt out, for one that is not installed here."""
    kind = effect_kinds().get(name)
    if kind is not None:
        return kind.title
    words = {**PART_TITLES, **CHANNEL_FAULT_TITLES}.get(name, name.replace("_", " "))
    return words[:1].upper() + words[1:]


def in_sentence(name: str) -> str:
    """An effect's title inside a sentence: in lower case but for abbreviations."""
    words = title(name).split()
    return " ".join(word if word.isupper() else word.lower() for word in words)


EVERYWHERE = "everywhere"

_BACKWARDS = 0.02
"""Speed at which a range ends that means driving backwards [m/s] (ours)."""

_STEADY = 0.01
"""Change of commands below which they count as held [rad/s] (ours)."""

_RANGES: dict[str, tuple[str, str]] = {
    "speed": ("at speeds", "m/s"),
    "slip": ("at slips", ""),
    "turning": ("while turning at", "rad/s"),
    "yaw_rate": ("at yaw rates", "rad/s (positive to the left)"),
    "command": ("at commands", "rad/s"),
    "command_change": ("while commands change by", "rad/s"),
    "time": ("at times", "s"),
}


def range_in_words(name: str, low: float | None, high: float | None) -> str:
    """A range of an operating condition, such as "at speeds above 0.6 m/s".

    Args:
        name: of the operating condition.
        low: None where it is open.
        high: the same.
    """
    if name == "heading" and low is not None and high is not None:
        ends = [f"{math.degrees(end):.0f}".replace("-", "−") for end in (low, high)]
        return f"while heading between {ends[0]} and {ends[1]} degrees"
    if name == "speed" and low is None and high is not None and abs(high) < _BACKWARDS:
        return "while driving backwards"
    if name == "command_change" and low is None and high is not None and high < _STEADY:
        return "while commands are held"
    words, unit = _RANGES[name]
    after = f" {unit}" if unit else ""
    if low is None and high is None:
        return EVERYWHERE
    if low is None:
        return f"{words} below {number(high or 0.0)}{after}"
    if high is None:
        return f"{words} above {number(low)}{after}"
    return f"{words} between {number(low)} and {number(high)}{after}"
