"""The parts of ``benchmarks/speed.py``: workloads, contestants and what is read off their races."""
