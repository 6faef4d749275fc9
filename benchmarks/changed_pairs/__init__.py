"""Pairs of simulated drives, before and after something changed, and what ``ddagr diagnose --before`` says of them."""
