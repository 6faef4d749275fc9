"""Recordings of drives: one schema, readers for what people have, and checks before anything is concluded.

    load_recording(path, map, robot) -> Recording -> check_recording(recording, rng) -> CheckReport

Columns, units, frames and the meaning of NaN are defined in :mod:`ddagr_gym.recordings.schema`.
"""
