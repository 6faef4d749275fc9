"""Drives in which nothing is missing, from which the gates are made."""
