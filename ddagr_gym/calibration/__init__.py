"""Calibration: one robot's parameters from its ordinary drives, and how far they may be trusted.

    drives -> input_requirements -> calibration_data -> joint_fit -> part_selection -> drive_scatter
           -> forecasts, residual_tables -> result -> files

The robot's parameters are shared by all drives, the soil by those on one ground, biases belong to a drive. Which parts
of the robot are fitted is decided by forecasts of drives that were left out, never by how well the fitted ones agree.
"""
