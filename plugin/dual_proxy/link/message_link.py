# SPDX-License-Identifier: BSD-3-Clause
"""A side's end of a link to another process: messages in, messages out.

with MessageLink("robot", listen="0.0.0.0:7447", keys=Path("robot")) as link:
    while True:
        now = time.monotonic()
        if (message := link.receive(now)) is not None:
            newest = message
        ...
        link.send(now, state.message)
"""

from __future__ import annotations

import math
import secrets
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dual_proxy._core import (
    ForceMessage,
    LinkEnd,
    LinkEndParams,
    LinkFrame,
    LinkMonitorParams,
    Message,
    PoseMessage,
    decode_frame,
    describe_wire_error,
)
from dual_proxy.link.agreement import Agreement, Value
from dual_proxy.link.transport import Transport

__all__ = ["PATIENCE", "MessageLink"]

#: s without the other side until `trouble` says so: before 2 are over.
PATIENCE = 1.9
# s between two looks at what is wrong.
_LOOK = 0.5


class MessageLink:
    """Exchanges a side's messages with the other side's process.

    What it gives is of one live sender, whose certificate is the other side's, in
    order, newest only, with times by this process's clock; `LinkEnd` says how. Whether
    the content may be acted on is for the side's own checks, as in a simulation.

    `time` is always the same clock's, in s, read now: `time.monotonic()`. Every call
    returns at once; one of `receive` looks at 16 messages at most.
    """

    def __init__(
        self,
        side: str,
        *,
        listen: str | None = None,
        connect: str | None = None,
        keys: Path | None = None,
        insecure: bool = False,
        monitor: LinkMonitorParams | None = None,
        params: LinkEndParams | None = None,
        made_of: Mapping[str, Value] | None = None,
    ) -> None:
        """As a Transport; `monitor` is the side's, of which `timeout` and `max_age`
        count here, too. `made_of` is what the other side has to be made of, too, by
        `describe_side`: nothing is taken of one that differs or does not tell.

        Raises LinkError.
        """
        self._transport = Transport(
            side, listen=listen, connect=connect, keys=keys, insecure=insecure
        )
        self._end = LinkEnd(
            "to_haptic" if side == "robot" else "to_robot",
            monitor or LinkMonitorParams(),
            params or LinkEndParams(),
        )
        self._session = secrets.randbits(64)
        self._state = self._end.make_state(self._session)
        self._agreement = Agreement(self._session, made_of) if made_of else None
        self._side = side
        self._other = "haptic" if side == "robot" else "robot"
        self._alone_since: float | None = None
        self._looked = -1.0e300
        self._trouble = ""
        self._said = ""
        self.reasons = ""
        """Why there is trouble; "": there is none."""
        self._came: dict[str, int] = {}
        self._unproven = b""
        self._untold = (0, 0.0)
        self._others = 0
        self._crowded_since: float | None = None

    def __enter__(self) -> MessageLink:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def send(
        self,
        time: float,
        message: Message | PoseMessage | ForceMessage,
        flags: int = 0,
    ) -> None:
        """Offer the newest message, every period; it is sent when there is a reason.

        `flags` are of LinkFrame: CLUTCH, HOLDING, FAULT.
        """
        data = self._end.send(time, message, flags, self._state)
        if data is not None:
            self._transport.send(data)
        if self._agreement:
            told = self._agreement.tell(time, self._state.peer)
            if told is not None:
                self._transport.send_beside(told)

    def receive(self, time: float) -> Message | None:
        """Return the newest message if one came since the last call.

        It may be one that came before, which LinkMonitor takes for what it is.
        """
        accepted = False
        for data in self._transport.receive():
            verdict = self._end.receive(time, data, self._state)
            accepted |= verdict == "accepted"
            if verdict == "unproven":
                self._unproven = data
        if self._agreement:
            told = self._transport.receive_beside()
            if told is not None:
                self._agreement.take(told, self._state.peer)
        if not accepted or not self._agrees():
            return None
        message = self._state.message
        return message if message.sequence >= 0 else None

    @property
    def flags(self) -> int:
        """What the other side says of itself: of LinkFrame CLUTCH, HOLDING, FAULT."""
        return self._state.flags if self._agrees() else 0

    def connected(self, time: float) -> bool:
        """Return whether the other side has been heard within the link's timeout, and
        is made of the same."""
        return self._end.is_connected(time, self._state) and self._agrees()

    def follows(self, time: float) -> bool:
        """Return whether the other side is there, as `connected`, and does not hold."""
        return self.connected(time) and not self.flags & LinkFrame.HOLDING

    def trouble(self, time: float) -> str:
        """Return what is wrong, in one line, with likely reasons: after 2 s without
        the other side, or with two of them; at once if it is made of something else.
        Nothing: "".

        May be asked in every period: it looks twice a second. `reasons` is then the
        same without what counts seconds.
        """
        if self._end.is_connected(time, self._state):
            self._alone_since = None
            self._said = self.reasons = self._look_at_peer(time)
        else:
            self._said = self._look_for_peer(time)
        return self._said

    def _look_at_peer(self, time: float) -> str:
        """Return what is wrong with a side that is heard."""
        peer = self._state.peer
        if self._agreement:
            difference = self._agreement.difference(peer)
            if difference is None:
                if self._untold[0] != peer:
                    self._untold = (peer, time)
                if time - self._untold[1] < PATIENCE:
                    return self._said
                return (
                    f"the {self._other} side does not tell what it is made of: it is "
                    "another version of dual-proxy"
                )
            if difference:
                return (
                    f"the {self._other} side has {difference}: give both the same "
                    "scenario"
                )
        if time - self._looked >= _LOOK:
            self._looked = time
            others = self._state.verdicts["other_session"]
            if others == self._others:
                self._crowded_since = None
            elif self._crowded_since is None:
                self._crowded_since = time
            self._others = others
        if self._crowded_since is None or time - self._crowded_since < PATIENCE:
            return ""
        return f"a second {self._other} side is there: only the first one is heard"

    def _look_for_peer(self, time: float) -> str:
        """Return why no side is heard."""
        if self._alone_since is None:
            # The timeout that it took to notice counts.
            self._alone_since = time
            if math.isfinite(self._state.heard_time):
                self._alone_since = self._state.heard_time
            self._looked = -1.0e300
            self._came = self._counts()
        if time - self._looked >= _LOOK:
            self._looked = time
            # Also before it is said: it asks, and has its answer the next time.
            self._trouble = self._explain()
        waited = time - self._alone_since
        if waited < PATIENCE:
            return self._said
        self.reasons = self._trouble
        return (
            f"no {self._other} side for {waited:.0f} s, "
            f"{self._transport.address_text()}: {self._trouble}"
        )

    def statistics(self) -> dict[str, Any]:
        """Return counters, and what is known of the other's clock and the delay."""
        state = self._state
        clock = state.clock
        return {
            "peers": self._transport.peers(),
            "sent": state.sent,
            "lost": state.lost,
            "malformed_beside": self._agreement.malformed if self._agreement else 0,
            **state.verdicts,
            **{f"malformed_{name}": n for name, n in state.malformed.items()},
            "clock_estimated": clock.estimated,
            "clock_offset_s": clock.offset,
            "clock_jumps": clock.jumps,
            "round_trip_s": clock.round_trip,
        }

    def close(self) -> None:
        """Close the connection; may be called again."""
        self._transport.close()

    def _counts(self) -> dict[str, int]:
        state = self._state
        return {**state.verdicts, **state.malformed}

    def _agrees(self) -> bool:
        if not self._agreement:
            return True
        return self._agreement.difference(self._state.peer) == ""

    def _explain(self) -> str:
        if not self._transport.peers():
            return self._transport.why_alone()
        if self._transport.is_same_side():
            return (
                f"connected, but to a {self._side} side: the same side is started "
                f"twice, and no {self._other} side"
            )
        came = {
            name: count - self._came.get(name, 0)
            for name, count in self._counts().items()
        }
        malformed = [name for name in self._state.malformed if came[name] > 0]
        if malformed:
            worst = max(malformed, key=lambda name: came[name])
            return f"connected, but the bytes that come {describe_wire_error(worst)}"
        if came["unproven"] > 0:
            frame = decode_frame(self._unproven, f"to_{self._side}")
            if frame.echo_session not in (0, self._session):
                return (
                    f"connected, but another {self._side} side is heard there already"
                )
        for name, text in (
            ("other_session", "a second sender, while the first has not been silent"),
            ("stale", "it hears nothing from here, or what comes is long under way"),
            ("unproven", "it hears nothing from here"),
            ("untimed", "its clock is being learned"),
            ("replayed", "only what came before comes again"),
        ):
            if came[name] > 0:
                return f"connected, but {text}"
        return (
            "connected, but nothing comes: its loop does not run, or it is another "
            "version of dual-proxy"
        )
