# SPDX-License-Identifier: BSD-3-Clause
"""What happens to a side while it runs, and how long its cycles take."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

from dual_proxy._core import CycleStatistics

__all__ = ["Event", "Events", "cycle_text"]


@dataclass(frozen=True)
class Event:
    """Something that happened: s since the side's start, what kind, and in words."""

    time: float
    kind: str
    text: str


class Events:
    """What happened so far, each told to people when it does."""

    def __init__(self, side: str, tell: Callable[[Event], None] | None = None) -> None:
        self._start = time.monotonic()
        self._side = side
        self._tell = tell or self._print
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
        print(
            f"{event.time:8.2f} s  {self._side}: {event.kind}: {event.text}",
            file=sys.stderr,
            flush=True,
        )


def cycle_text(cycles: CycleStatistics) -> str:
    """Return median, 99.9 % and maximum of how long cycles took, us, in one line."""
    median, most = 1e6 * cycles.quantile(0.5), 1e6 * cycles.quantile(0.999)
    return (
        f"{cycles.count} cycles: median {median:.0f} us, 99.9 % {most:.0f} us, "
        f"maximum {1e6 * cycles.max:.0f} us"
    )
