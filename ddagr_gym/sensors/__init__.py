"""Sensors: what the robot's instruments read of the true motion (physics.md section 7)."""
