# SPDX-License-Identifier: BSD-3-Clause
"""The log of a side: all that came in and went out, so that it can be played back.

An MCAP file, without chunks and written at once, so that what was logged is there
whatever ends the process; Foxglove opens it (`mcap recover` closes one that was cut).

| channel | each | encoding |
| --- | --- | --- |
| /cycle | period | little-endian float64, named in the schema |
| /message | message that came | the frame of docs/link.md |
| /event | event | JSON |
| /state | 20 ms | JSON: what a person looks at |

and a metadata record `side` with the scenario and all else that the side is made of.
"""

from __future__ import annotations

import contextlib
import json
import time
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dual_proxy._core import DriverError, LinkFrame, decode_frame, encode_frame
from dual_proxy.hardware.events import Event

__all__ = ["LoggedCycle", "SideLog", "message_digest", "read_side_log"]

_STATE_PERIOD = 0.02


def message_digest(message: Any) -> float:
    """Return the CRC-32 of a message's bytes: of what a side sent a log has only
    this, by which one that is played back is known to send the same."""
    frame = LinkFrame()
    frame.session = 1
    frame.message = message
    return float(zlib.crc32(encode_frame(frame)))


class SideLog:
    """Writes a side's log.

    Parameters
    ----------
    path : of a file that is not there yet.
    side : "robot" or "haptic".
    config : what the side is made of, text by name.
    columns : names of the numbers of a cycle.

    Raises
    ------
    DriverError
        If the file is there, or cannot be written.
    """

    def __init__(
        self, path: Path, side: str, config: dict[str, str], columns: Sequence[str]
    ) -> None:
        from mcap.writer import CompressionType, Writer

        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("xb")
        except OSError as error:
            raise DriverError(f"log {path}: {error.strerror}") from None
        self.path = path
        self.fault = ""
        """Why nothing is written any more; "": it is."""
        self._writer = Writer(
            self._file, use_chunking=False, compression=CompressionType.NONE
        )
        self._writer.start("dual-proxy", "drake-dual-proxy")
        self._writer.add_metadata("side", {"side": side, **config})
        add = self._writer.register_schema
        self._cycles = self._writer.register_channel(
            "/cycle",
            "float64",
            add("Cycle", "dual_proxy.columns", json.dumps(list(columns)).encode()),
        )
        self._messages = self._writer.register_channel(
            "/message", "dual_proxy.frame", add("Frame", "dual_proxy.frame", b"")
        )
        any_object = b'{"type": "object"}'
        self._events = self._writer.register_channel(
            "/event", "json", add("Event", "jsonschema", any_object)
        )
        self._states = self._writer.register_channel(
            "/state", "json", add("State", "jsonschema", any_object)
        )
        self._state_due = -1.0e300
        # Of readings by time.monotonic(), on the clock on the wall.
        self._epoch = time.time() - time.monotonic()
        self._frame = LinkFrame()
        self._frame.direction = _direction(side)
        self._frame.session = 1  # Of a frame that is one; which does not matter.

    def cycle(self, now: float, values: Sequence[Any]) -> None:
        """Write a period's numbers, in the order of the columns."""
        self._add(self._cycles, now, np.concatenate(values).tobytes())

    def message(self, now: float, message: Any) -> None:
        """Write a message that came, before the cycle that takes it."""
        self._frame.message = message
        self._add(self._messages, now, encode_frame(self._frame))

    def event(self, event: Event) -> None:
        """Write what has happened."""
        data = {"time": event.time, "kind": event.kind, "text": event.text}
        self._add(self._events, time.monotonic(), json.dumps(data).encode())

    def wants_state(self, now: float) -> bool:
        """Return whether `state` is due."""
        return now >= self._state_due

    def state(self, now: float, values: dict[str, Any]) -> None:
        """Write what a person looks at: numbers, lists of them and texts by name."""
        self._state_due = now + _STATE_PERIOD
        self._add(self._states, now, json.dumps(values).encode())

    def close(self) -> None:
        """Write the file's end."""
        if self._file.closed:
            return
        with contextlib.suppress(OSError):  # What could be written is there.
            if not self.fault:
                self._writer.finish()  # type: ignore[no-untyped-call]
            self._file.close()

    def _add(self, channel: int, now: float, data: bytes) -> None:
        if self.fault:
            return
        stamp = int(1e9 * (now + self._epoch))
        try:
            self._writer.add_message(channel, stamp, data, stamp)
            # At once: a process that is killed loses nothing.
            self._file.flush()
        except OSError as error:
            self.fault = f"log {self.path}: {error.strerror}"


class LoggedCycle(NamedTuple):
    """A period of a log.

    Attributes
    ----------
    values : its numbers, by the columns of the log.
    message : that came before it since the period before, or None.
    kinds : of the events between the period before and it.
    """

    values: NDArray[np.float64]
    message: Any
    kinds: list[str]


def read_side_log(
    path: Path, columns: Mapping[str, Sequence[str]]
) -> tuple[dict[str, str], Iterator[LoggedCycle]]:
    """Return what the side was made of, `side` among it, and its periods in order. The
    end of a file that was cut is where it was cut.

    Parameters
    ----------
    columns : of a cycle, for each side whose log it may be.

    Raises
    ------
    DriverError
        If the file cannot be read, or is no log of such a side with its columns.
    """
    records = _records(path)
    for record in records:
        if type(record).__name__ == "Metadata" and record.name == "side":
            config = dict(record.metadata)
            side = config["side"]
            if side in columns:
                return config, _cycles(records, path, _direction(side), columns[side])
            break
    raise DriverError(f"{path}: expected the log of a {' or '.join(columns)} side")


class _Whole:
    """A file of which what is cut is not there."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file

    def read(self, size: int = -1) -> bytes:
        data = self._file.read(size)
        if len(data) < size:
            raise EOFError
        return data


def _records(path: Path) -> Iterator[Any]:
    from mcap.exceptions import McapError
    from mcap.stream_reader import StreamReader

    try:
        with path.open("rb") as file:
            try:
                yield from StreamReader(_Whole(file)).records  # type: ignore[arg-type]
            except (McapError, EOFError):  # It was cut here.
                return
    except OSError as error:
        raise DriverError(f"{path}: {error.strerror}") from None


def _direction(side: str) -> str:
    return "to_robot" if side == "robot" else "to_haptic"


def _cycles(
    records: Iterator[Any], path: Path, direction: str, columns: Sequence[str]
) -> Iterator[LoggedCycle]:
    topics: dict[int, str] = {}
    message = None
    kinds: list[str] = []
    for record in records:
        name = type(record).__name__
        if name == "Schema" and record.name == "Cycle":
            if json.loads(record.data) != list(columns):
                raise DriverError(f"{path}: expected a cycle of {', '.join(columns)}")
        elif name == "Channel":
            topics[record.id] = record.topic
        elif name == "Message":
            topic = topics[record.channel_id]
            if topic == "/event":
                kinds.append(json.loads(record.data)["kind"])
            elif topic == "/message":
                message = decode_frame(record.data, direction).message
            elif topic == "/cycle":
                yield LoggedCycle(np.frombuffer(record.data, "<f8"), message, kinds)
                message, kinds = None, []
