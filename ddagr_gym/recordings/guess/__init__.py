"""A proposal for the topic map of a bag: what each topic could be, and what the data say of it.

contents (what the bag holds) -> candidates (by type, frame and name) -> choose (with trials: recordings of candidates,
judged by the checks) -> propose (the map, what is ambiguous, what is missing and what that costs)
"""
