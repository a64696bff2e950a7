# SPDX-License-Identifier: BSD-3-Clause
"""What the processes of both sides have: events, the link to the other, a log."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dual_proxy._core import CycleStatistics, PoseMessage
from dual_proxy.hardware.events import Events
from dual_proxy.hardware.side_log import SideLog
from dual_proxy.link import SIDES

if TYPE_CHECKING:
    from dual_proxy.link.message_link import MessageLink

__all__ = ["SideProcess"]

#: s: reasons for trouble that change are told no more often.
_RETELL = 2.0


class SideProcess:
    """A side in a process of its own; what it does in a period is its subclass's.

    Parameters
    ----------
    side : "robot" or "haptic".
    link : to the other side, or None.
    events : what is told, by default on standard error.
    log : new MCAP file, or None.
    config, columns : of that file; see SideLog.
    """

    def __init__(
        self,
        side: str,
        link: MessageLink | None,
        events: Events | None,
        log: Path | None,
        config: dict[str, str],
        columns: Sequence[str],
    ) -> None:
        self.events = events or Events(side)
        self.work = CycleStatistics()
        (self._other,) = (other for other in SIDES if other != side)
        self._link = link
        self._message: Any = PoseMessage()
        self._reasons = ""
        self._told = -math.inf
        self._stop = False
        self._log: SideLog | None = None
        self._log_fault = ""
        self._make_log: Callable[[], SideLog] | None = None
        if log is not None:
            self._make_log = lambda: SideLog(log, side, config, columns)

    def stop(self) -> None:
        """Have `run` come to rest and end; for signal handlers and other threads."""
        self._stop = True

    def close(self) -> None:
        """Close the link; all else `run` has closed."""
        if self._link is not None:
            self._link.close()

    def _receive(self, now: float) -> int:
        """Take the newest message, if one came; return the other side's flags."""
        if self._link is None:
            return 0
        newest = self._link.receive(now)
        if newest is not None:
            self._message = newest
            if self._log is not None:
                self._log.message(now, newest)
        return self._link.flags

    def _send(self, now: float, message: Any, flags: int) -> None:
        """Offer the newest message, and tell when trouble begins, when its reasons are
        others, and when it ends."""
        if self._link is None:
            return
        self._link.send(now, message, flags)
        trouble, reasons = self._link.trouble(now), self._link.reasons
        if reasons == self._reasons:
            return
        if reasons and self._reasons and now < self._told + _RETELL:
            return
        self._reasons, self._told = reasons, now
        self.events.add("link", trouble or f"the {self._other} side is there")

    def _open_log(self) -> None:
        """Begin to log, once all else is ready: what failed before leaves no file."""
        if self._make_log is not None:
            self._log = self._make_log()
            self.events.also(self._log.event)
            self.events.add("log", str(self._log.path))

    def _watch_log(self) -> None:
        """Come to rest and end where it cannot be written any more."""
        if self._log is not None and self._log.fault != self._log_fault:
            self._log_fault = self._log.fault
            self.events.add("fault", f"{self._log_fault}: no run without a log")
            self.stop()

    def _close_log(self) -> None:
        if self._log is not None:
            self._log.close()
