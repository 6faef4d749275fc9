"""The functions of ``import ddagr_gym``, one module each, and their shared helpers.

    given (paths, tables, recordings, names) -> inputs, nominal -> the package's own work -> a typed result

A result is a frozen dataclass with ``__str__`` (what the command of that name prints), ``_repr_html_`` (headline and
table in a notebook), ``to_json(path)`` where the command writes JSON, and ``report(folder)`` where it writes a page or
figures. Heavy libraries are imported when a function runs.
"""
