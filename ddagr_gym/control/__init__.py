"""References of a row turn and the controllers that follow them; nothing here knows the true soil or motion."""
