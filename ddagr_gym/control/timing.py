"""How often the controllers of a row turn act."""

from ddagr_gym.parameters import Sensors

CONTROL_INTERVAL = 10
"""Sensor samples per action: 12.5 Hz control at 125 Hz sensors."""

CONTROL_PERIOD = CONTROL_INTERVAL * Sensors().period
"""Time between actions at the sensors' nominal rate [s]."""
