"""From a diagnosis to a better turn: controllers tuned on the corrected simulator.

``corrected.py`` (what the recordings say) -> ``turns.py`` (turns in the corrected simulator, sizes drawn from their
intervals) -> ``teaching.py`` (feed-forward) and the search for gains -> ``run.py`` (what is kept, before and after).
"""
