"""The speed benchmark runs on tiny sizes and measures what it says; no time is asserted."""

import json

import numpy as np
import pytest

from benchmarks import speed
from benchmarks.speeds import kernel_time, memory


def test_kernel_in_c_gives_the_same_forces_and_leaves_the_process_alone():
    found = kernel_time.against_c(repeats=1, evaluations=256)
    if "skipped" in found:
        pytest.skip(str(found["skipped"]))
    # a library linked with -ffast-math would have switched off subnormal numbers for all later tests
    assert np.float64(2.0**-1022) * np.float64(0.5) > 0.0


def test_memory_is_flat_over_resets():
    found = memory.over_resets(resets=200, warm_up=100)
    if "skipped" in found:
        pytest.skip(str(found["skipped"]))
    assert found["growth_mebibytes"] < 5.0


def test_everything_is_measured_and_written(tmp_path, monkeypatch):
    tiny = speed.Effort(repeats=1, steps=5, batches=(1, 2), evaluations=256, states=4, samples=30, resets=20)
    monkeypatch.setattr(speed.Effort, "quick", classmethod(lambda cls: tiny))
    speed.main(["--quick", "--output", str(tmp_path)])
    result = json.loads((tmp_path / "speed.json").read_text())
    assert (tmp_path / "speed.png").stat().st_size > 10_000
    assert {"machine"} <= set(result)
    assert len(result) >= 5
