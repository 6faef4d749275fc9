"""Drives with what models predict of them and what was found, for the viewers of other projects.

:mod:`~ddagr_gym.viewers.drive_traces` has the numbers and :mod:`~ddagr_gym.viewers.annotations` the findings, for any
viewer; :mod:`~ddagr_gym.viewers.mcap_file` writes them for Foxglove and PlotJuggler,
:mod:`~ddagr_gym.viewers.rerun_file` for Rerun.
"""
