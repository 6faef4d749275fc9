"""The physics against the world outside: measured wheels, and another simulator.

Each module is pure: it reads a CSV of ``reference/`` and returns the reference beside this model's prediction.
``ddagr validate`` runs them, prints the tables and writes figures.
"""
