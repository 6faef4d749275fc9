"""Findings of a diagnosis as events and lines of a log."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

from ddagr_gym.diagnosis.answer.verdict import Diagnosis
from ddagr_gym.viewers.annotations import Annotation
from ddagr_gym.viewers.drive_traces import DriveTraces
from ddagr_gym.viewers.mcap_messages import Message, nanoseconds, timestamp

if TYPE_CHECKING:
    import foxglove
    from foxglove import messages

_NAME = "ddagr diagnose"


class FindingTopics:
    """Topics with what was found: an event for each stretch, and a log.

    Args:
        context: of the writer.
    """

    def __init__(self, context: foxglove.Context) -> None:
        from foxglove.channels import EventChannel, LogChannel

        self._events = EventChannel("/findings/events", context=context)
        self._log = LogChannel("/findings/log", context=context)

    def begin(self, diagnosis: Diagnosis, drive: DriveTraces, number: int, doubted: Sequence[str]) -> Iterator[Message]:
        """The answer in words at the start of a drive, and what its data make doubtful.

        Args:
            diagnosis: the answer.
            drive: that begins.
            number: of it, from 0.
            doubted: sentences on its data.
        """
        from foxglove.messages import LogLevel

        ns = nanoseconds(drive, float(drive.recording.t[0]))
        yield (
            ns,
            0,
            self._line(LogLevel.Info, f"recording {number + 1}, {drive.recording.meta.source}: {diagnosis.sentence}"),
        )
        for sentence in doubted:
            yield ns, 0, self._line(LogLevel.Warning, sentence)

    def stretches(self, drive: DriveTraces, found: Sequence[Annotation]) -> Iterator[Message]:
        """An event and a line for each stretch in which something shows, at its start; another line at its end."""
        from foxglove.messages import LogLevel

        listed: list[Message] = []
        for item in found:
            begin, end = nanoseconds(drive, item.start), nanoseconds(drive, item.end)
            text = f"{item.finding}: {item.text}, {item.stretch}"
            listed += [(begin, 1, self._event(item, begin, end)), (begin, 1, self._line(LogLevel.Warning, text))]
            if item.located:
                listed.append((end, 1, self._line(LogLevel.Info, f"{item.finding} ends at {item.end:.1f} s")))
        yield from sorted(listed, key=lambda message: message[:2])

    def _line(self, level: messages.LogLevel, text: str) -> Callable[[int], None]:
        from foxglove.messages import Log

        return lambda ns: self._log.log(
            Log(timestamp=timestamp(ns), level=level, message=text, name=_NAME), log_time=ns
        )

    def _event(self, item: Annotation, begin: int, end: int) -> Callable[[int], None]:
        from foxglove.messages import Event, KeyValuePair

        said = {
            "finding": item.finding,
            "text": item.text,
            "recording": str(item.drive + 1),
            "start": f"{item.start:.3f} s",
            "end": f"{item.end:.3f} s",
            "located": "yes" if item.located else "no",
            **({} if item.share is None else {"share": f"{item.share:.3f}"}),
        }
        pairs = [KeyValuePair(key=key, value=value) for key, value in said.items()]
        event = Event(start_time=timestamp(begin), end_time=timestamp(end), metadata=pairs)
        return lambda ns: self._events.log(event, log_time=ns)
