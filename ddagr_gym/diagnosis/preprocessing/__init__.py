"""What recordings have to have, and the faults of sensors that show without any model."""
