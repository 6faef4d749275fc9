"""The version, apart from the package door so that reading it registers nothing."""

__version__ = "0.3.0"
