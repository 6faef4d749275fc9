"""Readings that belong to other channels, and the lines of a map that put them right."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ddagr_gym.recordings.schema import Recording

Takes = Mapping[str, tuple[str, float]]
"""By channel that has the wrong readings, the channel that has its readings now, and their sign."""

_WHEELS = {"encoder_right", "encoder_left"}


def map_lines(takes: Takes) -> str:
    """What to write into a map, one sentence.

    Args:
        takes: at least one channel.
    """
    lines = []
    for name, (source, sign) in takes.items():
        entries = [f"column: that of {source}"] if source != name else []
        entries += ["sign: -1"] if sign < 0 else []
        lines.append(f"{name}: {{{', '.join(entries)}}}")
    against = "columns and signs against those of now"
    return f"In the column map write {', '.join(lines)} ({against}){_in_topics(takes)}."


def _in_topics(takes: Takes) -> str:
    """The same in a topic map, which has signs by channel and patterns of wheels' names; "" where it has no such."""
    moved = {name for name, (source, _) in takes.items() if source != name}
    signs = [f"{name}: -1" for name, (_, sign) in takes.items() if sign < 0]
    parts = ["exchange the patterns right and left of the wheels"] if moved == _WHEELS else []
    parts += [f"write signs: {{{', '.join(signs)}}}"] if signs else []
    return f"; in a topic map {' and '.join(parts)}" if parts and moved <= _WHEELS else ""


def with_channels(recording: Recording, takes: Takes) -> Recording:
    """Recording whose readings are where they belong.

    Args:
        recording: as its map had it; a channel that it lacks stays lacking.
        takes: what is wrong with the map.
    """
    moved = {name: sign * recording[source] for name, (source, sign) in takes.items() if recording.has(source)}
    kept = {name: values for name, values in recording.channels.items() if name not in takes}
    held = recording.meta.held
    periods = {name: held[takes.get(name, (name, 1.0))[0]] for name in _held_after(recording, takes)}
    return replace(recording, channels={**kept, **moved}, meta=replace(recording.meta, held=periods))


def _held_after(recording: Recording, takes: Takes) -> list[str]:
    """Channels that repeat their readings once these are where they belong."""
    held = recording.meta.held
    names = dict.fromkeys([*held, *takes])
    return [name for name in names if takes.get(name, (name, 1.0))[0] in held]
