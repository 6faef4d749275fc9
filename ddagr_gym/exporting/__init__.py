"""A corrected simulator for other projects' simulators: what carries over, measured, and written in their formats.

    corrected (robot, soil, effects, draws) -> working_point (our simulator, steady drives) -> carried_over (numbers)
    -> friction (sliding friction that turns alike), ranges (draws) -> mujoco_model, gazebo_model, randomisation

:mod:`~ddagr_gym.exporting.mujoco_drives` steps a MuJoCo model for the comparison; only that module knows MuJoCo.
"""
