# SPDX-License-Identifier: BSD-3-Clause
"""What happens to a side while it runs, and how long its cycles take."""

from __future__ import annotations

import select
import sys
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import TextIO

from dual_proxy._core import CycleStatistics

__all__ = ["Event", "Events", "cycle_text"]


@dataclass(frozen=True)
class Event:
    """Something that happened: s since the side's start, what kind, and in words."""

    time: float
    kind: str
    text: str


class Events:
    """What happened so far, each told to people when it does.

    On standard error it is told when that takes it without waiting, the last _WAITING
    of it: a terminal that was stopped, or a pipe that nobody reads, holds up no loop.
    """

    _WAITING = 1000

    def __init__(self, side: str, tell: Callable[[Event], None] | None = None) -> None:
        self._start = time.monotonic()
        self._side = side
        self._tell = tell or self._print
        self._waiting: deque[str] = deque(maxlen=self._WAITING)
        self._also: list[Callable[[Event], None]] = []
        self.all: list[Event] = []

    def also(self, tell: Callable[[Event], None]) -> None:
        """Have somebody else told, too."""
        self._also.append(tell)

    def add(self, kind: str, text: str) -> None:
        """Note something that has just happened."""
        event = Event(time.monotonic() - self._start, kind, text)
        self.all.append(event)
        for tell in (self._tell, *self._also):
            tell(event)

    def count(self, kind: str) -> int:
        """Return how often something of a kind happened."""
        return sum(event.kind == kind for event in self.all)

    def _print(self, event: Event) -> None:
        self._waiting.append(
            f"{event.time:8.2f} s  {self._side}: {event.kind}: {event.text}"
        )
        while self._waiting and _takes(sys.stderr):
            print(self._waiting.popleft(), file=sys.stderr, flush=True)


def _takes(stream: TextIO) -> bool:
    """Return whether a stream takes a line without waiting."""
    try:
        return bool(select.select([], [stream.fileno()], [], 0)[1])
    except (AttributeError, OSError, ValueError):  # Closed, or none of the system's.
        return True


def cycle_text(cycles: CycleStatistics) -> str:
    """Return median, 99.9 % and maximum of how long cycles took, us, in one line."""
    median, most = 1e6 * cycles.quantile(0.5), 1e6 * cycles.quantile(0.999)
    return (
        f"{cycles.count} cycles: median {median:.0f} us, 99.9 % {most:.0f} us, "
        f"maximum {1e6 * cycles.max:.0f} us"
    )
