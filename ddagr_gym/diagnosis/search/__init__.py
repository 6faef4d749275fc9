"""Which effects are named: the scan of the library, joint refits, and the stepwise search."""
