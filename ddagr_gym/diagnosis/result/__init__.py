"""From a search to the answer: findings with intervals, equivalents, verdict, sentences, JSON."""
