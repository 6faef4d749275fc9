"""Skid-steer field robots on soft soil: simulator, Gymnasium environments, recordings, diagnosis.

Importing the package registers the environments; :func:`gymnasium.make` then knows ``DDAGR-Turn-v0``.

Conventions, everywhere in the package:

===============  =======================================================================================
units            SI and radians; percentages and degrees appear in printed tables only
frames           REP 103: world x, y horizontal; body x forward, y left, z up; yaw counter-clockwise
wheels           1 front right, 2 front left, 3 rear right, 4 rear left
banks            ordered (right, left); a positive speed drives the robot forward
forces           those of the soil on the wheel
slip ratio       positive when the wheel spins faster than it travels, negative when it is braked
specific force   raw accelerometer: +9.81 m/s^2 on z when the robot stands level
time             seconds from the start of the drive, one row per sensor sample
missing samples  NaN: the channel has no new sample in that row
randomness       only from a :class:`numpy.random.Generator` that the caller passes in
truth            columns that no sensor reads carry the prefix ``true_``
===============  =======================================================================================

Columns of a drive: ``t``; ``command_right``, ``command_left``, ``encoder_right``, ``encoder_left`` [rad/s];
``specific_force_x``, ``specific_force_y``, ``specific_force_z`` [m/s^2]; ``yaw_rate`` [rad/s]; optional ``roll``,
``pitch`` [rad], ``pose_x``, ``pose_y`` [m], ``pose_yaw`` [rad], ``current_right``, ``current_left`` [A].

Bad input raises :class:`ddagr_gym.errors.InputError`: one sentence with the offending value and the remedy.
"""

from ddagr_gym.envs.registration import register_environments
from ddagr_gym.version import __version__

__all__ = ["__version__", "register_environments"]

register_environments()
