"""The filter on soils that it does not know and on real drives: ``./ddagr study filter``."""
