"""The parts of ``benchmarks/ablate_concealed.py``: what each arm says of a case, and the picture of the results."""
