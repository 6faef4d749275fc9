"""The version, apart from the package door so that reading it registers nothing."""

__version__ = "0.2.0"
