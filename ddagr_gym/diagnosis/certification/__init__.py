"""What the named effects are worth on drives that their sizes were not fitted to."""
