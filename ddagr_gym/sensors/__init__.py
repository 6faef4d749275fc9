"""Sensors: what the robot's instruments read of the true motion (theory: wheel model, section 7)."""
