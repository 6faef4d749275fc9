"""All forms by name, and the pairs that are drawn as double effects."""

from __future__ import annotations

from . import (
    forms_drive,
    forms_drivetrain,
    forms_ground,
    forms_outside,
    forms_outside_sensor,
    forms_robot,
    forms_sensor,
)
from .change import REGISTRY, Form
from .sizes import LEAST_MEANINGFUL

FORM_MODULES = (
    forms_drive, forms_robot, forms_ground, forms_sensor, forms_outside, forms_outside_sensor, forms_drivetrain
)  # fmt: skip
"""Importing these fills the registry."""

LIBRARY_FORMS: dict[str, list[Form]] = {
    name: [form for form in REGISTRY if form.name == name and form.tag != "outside" and not form.later]
    for name in LEAST_MEANINGFUL
}
"""Forms that the development set, the sealed set and the sets of pairs are drawn from."""

DRIVETRAIN = ("command_delay", "motor_lag", "motor_droop", "motor_saturation", "command_deadband")
"""Effects between command and wheel."""

DRIVETRAIN_FORMS: dict[str, list[Form]] = {
    name: [form for form in REGISTRY if form.name == name and form.later] for name in DRIVETRAIN
}
"""Their forms that came later: drawn in the ninth set only, so that the draws of older sets stay as they are."""

OUTSIDE_FORMS: list[Form] = [form for form in REGISTRY if form.tag == "outside"]

OPEN_PAIRS = (
    ("slope", "command_delay"),
    ("payload", "gyro_bias"),
    ("towed_drag", "motor_lag"),
    ("soil_split", "gyro_scale"),
    ("centre_of_mass_offset", "sensor_hold"),
    ("wheel_radius_mismatch", "accelerometer_bias"),
    ("soil_patch", "command_delay"),
    ("viscous_drag", "imu_lever_arm"),
    ("slope", "gyro_scale"),
    ("motor_saturation", "accelerometer_sign"),
)
"""Pairs that act in different places and leave different traces; the first ten make the development set."""

RESERVED_PAIRS = (
    ("towed_drag", "gyro_bias"),
    ("motor_droop", "slope"),
    ("soil_patch", "imu_misalignment"),
    ("motor_saturation", "centre_of_mass_offset"),
    ("wheel_radius_mismatch", "sensor_hold"),
    ("command_deadband", "accelerometer_bias"),
    ("soil_split", "motor_lag"),
    ("slope", "pose_latency"),
    ("soil_change", "gyro_sign"),
    ("lateral_bulldozing", "command_delay"),
)
"""Pairs kept for the sealed sets."""

DRIVETRAIN_PAIRS = (
    ("command_delay", "motor_saturation"),
    ("motor_lag", "payload"),
    ("motor_droop", "gyro_bias"),
    ("motor_saturation", "gyro_scale"),
    ("command_deadband", "imu_misalignment"),
)
"""Further pairs of the ninth set; robots have a dead time and a limit at once."""


def least_size(form: Form) -> float:
    """Unit in which a form's size is counted."""
    return LEAST_MEANINGFUL[form.name][0] if form.name in LEAST_MEANINGFUL else 1.0


def form_rows() -> list[str]:
    """Markdown table row of every form: library effects, their later forms, effects outside the library."""
    known = [form for forms in (*LIBRARY_FORMS.values(), *DRIVETRAIN_FORMS.values()) for form in forms]
    return [_row(form) for form in (*known, *OUTSIDE_FORMS)]


def _row(form: Form) -> str:
    """Markdown table row of a form."""
    span = f"{form.low:g}-{form.high:g}" if form.high > 0 else "no size"
    notes = [note for note, on in (("needs pose", form.needs_pose), ("sealed only", form.reserved)) if on]
    notes += [f"or `{name}`" for name in form.also]
    equation = form.equation.replace("|", "\\|")
    return f"| `{form.name}` | {form.variant} | {form.tag} | {span} | {equation} | {', '.join(notes)} |"


def size_rows() -> list[str]:
    """Markdown table row of every least meaningful size."""
    return [f"| `{name}` | {size:.3g} {unit} | {reason} |" for name, (size, unit, reason) in LEAST_MEANINGFUL.items()]


if __name__ == "__main__":
    print("\n".join([*size_rows(), "", *form_rows()]))
