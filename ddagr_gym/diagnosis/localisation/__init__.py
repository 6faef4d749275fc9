"""Where the mismatch is: channels, stretches of time, operating conditions, places, and the missing force."""
