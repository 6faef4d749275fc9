"""All forms by name, and the pairs that are drawn as double effects."""

from __future__ import annotations

from . import forms_drive, forms_ground, forms_outside, forms_outside_sensor, forms_robot, forms_sensor
from .change import REGISTRY, Form
from .sizes import LEAST_MEANINGFUL

FORM_MODULES = (forms_drive, forms_robot, forms_ground, forms_sensor, forms_outside, forms_outside_sensor)
"""Importing these fills the registry."""

LIBRARY_FORMS: dict[str, list[Form]] = {
    name: [form for form in REGISTRY if form.name == name and form.tag != "outside"] for name in LEAST_MEANINGFUL
}
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
"""Pairs kept for the sealed set."""


def least_size(form: Form) -> float:
    """Unit in which a form's size is counted."""
    return LEAST_MEANINGFUL[form.name][0] if form.name in LEAST_MEANINGFUL else 1.0


def form_rows() -> list[str]:
    """Markdown table row of every form, library effects first."""
    rows = []
    for form in (*(form for forms in LIBRARY_FORMS.values() for form in forms), *OUTSIDE_FORMS):
        span = f"{form.low:g}-{form.high:g}" if form.high > 0 else "no size"
        notes = ", ".join(note for note, on in (("needs pose", form.needs_pose), ("sealed only", form.reserved)) if on)
        equation = form.equation.replace("|", "\\|")
        rows.append(f"| `{form.name}` | {form.variant} | {form.tag} | {span} | {equation} | {notes} |")
    return rows


def size_rows() -> list[str]:
    """Markdown table row of every least meaningful size."""
    return [f"| `{name}` | {size:.3g} {unit} | {reason} |" for name, (size, unit, reason) in LEAST_MEANINGFUL.items()]


if __name__ == "__main__":
    print("\n".join([*size_rows(), "", *form_rows()]))
