"""The effect library: physics that the nominal model leaves out, by the names of the verdict.

A sample of the simulator runs through these points; an effect is attached to one or more of them::

    commands -> set_points -> motors -> loads -> soil -> [ wheel_forces -> body_forces ] -> readings
                                                         several times per integrator step

==============  ====================================  ==============================================================
point           what an effect may change there       effects
==============  ====================================  ==============================================================
commands        COMMAND                               command_deadband, command_gain, encoder_scale (in the loop)
set_points      MOTOR_TARGET (after limits and ramp)  command_delay
motors          MOTOR_TARGET, MOTOR_RATE, DRIVETRAIN, motor_lag, motor_droop, motor_saturation
                LOAD_CARRIED
loads           MASS ... SLOPE, WHEEL (restored at    slope, payload, centre_of_mass_offset, wheel_radius_mismatch,
                each sample), TOWED                   towed_drag (the load on its rope)
soil            SOIL (restored at each sample)        soil_change, soil_split, soil_patch, slip_sinkage, multipass
                FELT_DEPTH (restored), HEAPED         soil_patch; lateral_bulldozing (the soil beside the wheels)
wheel_forces    EXTRA_* of each wheel                 lateral_bulldozing
body_forces     BODY_FORCE                            towed_drag, viscous_drag
readings        READING                               gyro_*, accelerometer_*, imu_*, encoder_scale, pose_latency,
                                                      sensor_hold
==============  ====================================  ==============================================================

Every effect is one file with one frozen dataclass: fields made by ``size()`` say how big it is and do nothing at their
``neutral`` value; fields made by ``shape()`` say how or where it acts. Metadata of a field: unit, low, high, least
(nobody cares below that distance from neutral), neutral, step (for finite differences). ``Effect.probes`` gives small
effects that span what a kind can do. Readings follow sizes smoothly from neutral on, except where ``differentiable`` is
False. Sensor effects act on the reading, after noise and quantisation.

Every module in this folder that defines an :class:`Effect` is found by itself; other packages add theirs through the
entry point group ``ddagr_gym.effects``.
"""

from ddagr_gym.physics.effects.base import GROUPS, DriveExtent, Effect, build_effect, effect_table
from ddagr_gym.physics.effects.files import EffectsFile, load_effects, load_intervals, read_effects_file, save_effects
from ddagr_gym.physics.effects.registry import ENTRY_POINT_GROUP, effect_kind, effect_kinds, parse_effect

__all__ = [
    "ENTRY_POINT_GROUP",
    "GROUPS",
    "DriveExtent",
    "Effect",
    "EffectsFile",
    "build_effect",
    "effect_kind",
    "effect_kinds",
    "effect_table",
    "load_effects",
    "load_intervals",
    "parse_effect",
    "read_effects_file",
    "save_effects",
]
