"""How drives are judged: metrics (pure functions), runs over scenarios, and their statistics."""
