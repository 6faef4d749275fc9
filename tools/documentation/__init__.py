"""How the documentation site is made: mathematics, docstrings, generated pages and pages that are run."""
