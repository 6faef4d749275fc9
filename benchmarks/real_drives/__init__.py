"""Forecasts of real drives that were left out of a calibration, beside simpler and more flexible models."""
