"""How much evidence an effect needs: thresholds made of drives in which nothing is missing."""
