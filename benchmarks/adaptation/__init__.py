"""Recorded drives in, adapted controllers out, judged by turns in the truth that was recorded.

The truths are the blind benchmark's simulator (``benchmarks/concealed``), which shares no code with the package.
"""
