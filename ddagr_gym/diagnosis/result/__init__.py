"""The answer of a diagnosis: findings with intervals, equivalents, verdict, sentences, JSON."""
