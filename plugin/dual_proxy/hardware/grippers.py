# SPDX-License-Identifier: BSD-3-Clause
"""Grippers as the robot side's process has them: the arm's own and a simulated one.

Nothing that a gripper does, or that it is not there, is felt by the arm's loop: its
commands return at once, raise nothing, and what there is to say is said by `news`.

pylibfranka waits for the fingers to come to rest, and holds Python's lock all the
while. So FrankaGripper talks to it in a process of its own, this module run as
a program: widths go there as 8 bytes each, of which the newest counts, lines of JSON
come back. It ends when its input does, whatever has ended this process.
"""

from __future__ import annotations

import importlib
import json
import math
import os
import select
import struct
import subprocess
import sys
import time
from typing import Any, Protocol

from dual_proxy._core import FingerMoves, FingerTakeover, FrankaGripperParams
from dual_proxy.text import one_line

__all__ = [
    "FRANKA_MODULE",
    "PANDA_MODULE",
    "FrankaGripper",
    "Gripper",
    "SimulatedGripper",
]

#: Bindings of libfranka: for an FR3, and for the original Panda.
FRANKA_MODULE = "pylibfranka"
PANDA_MODULE = "panda_py.libfranka"

_WIDTH = struct.Struct("<d")
#: s: between two looks at a gripper that has nothing to do.
_PAUSE = 0.02
#: m: whatever the fingers have met is what they are to hold.
_ANY_WIDTH = 0.1
#: s: for which a process is waited for that has a move to end.
_PATIENCE = 3.0


class Gripper(Protocol):
    """What the robot side's loop needs of a gripper. Nothing raises."""

    def open(self) -> None:
        """Begin to make it ready; nothing moves."""

    def command(self, width: float) -> None:
        """Set how far apart the fingers are to be, m, until the next call."""

    def news(self) -> list[str]:
        """Return what has happened since the last call, in a line each."""

    def close(self) -> None:
        """Let go of it: what it holds it goes on holding."""

    @property
    def width(self) -> float:
        """m: how far apart the fingers are; NaN: not known."""


class FrankaGripper:
    """A Franka Hand, by libfranka in a process of its own.

    Nothing moves until the command has once been where the fingers are: what they hold
    at first they go on holding.

    Parameters
    ----------
    host : name or address of its arm.
    module : with libfranka's Gripper, FRANKA_MODULE or PANDA_MODULE.
    """

    def __init__(self, host: str, module: str = FRANKA_MODULE) -> None:
        self._arguments = (host, module)
        self._process: subprocess.Popen[bytes] | None = None
        self._lines = b""
        self._takeover = FingerTakeover()
        self._told = math.nan
        self._news: list[str] = []
        self._width = math.nan
        self._ended = False

    def open(self) -> None:
        """See Gripper."""
        command = [sys.executable, "-m", "dual_proxy.hardware.grippers"]
        try:
            # Ctrl-C is for the arm's process; this one ends after it.
            process = subprocess.Popen(
                [*command, *self._arguments],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                bufsize=0,
                start_new_session=True,
            )
        except OSError as error:
            self._news.append(f"fault: {error}")
            return
        self._process = process
        for pipe in (process.stdin, process.stdout):
            assert pipe is not None
            os.set_blocking(pipe.fileno(), False)

    def command(self, width: float) -> None:
        """See Gripper."""
        counts = self._takeover.update(width, self._width) and math.isfinite(width)
        if self._process is None or not counts or width == self._told:
            return
        assert self._process.stdin is not None
        try:
            # One that does not fit is told again: the loop goes on calling.
            if self._process.stdin.write(_WIDTH.pack(width)):
                self._told = width
        except OSError:  # `news` says that it has ended.
            return

    def news(self) -> list[str]:
        """See Gripper."""
        if self._process is not None and not self._ended:
            self._read(self._process)
        news, self._news = self._news, []
        return news

    def close(self) -> None:
        """See Gripper."""
        process, self._process = self._process, None
        if process is None:
            return
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.close()
        try:
            process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()

    @property
    def width(self) -> float:
        """See Gripper."""
        return self._width

    def _read(self, process: subprocess.Popen[bytes]) -> None:
        assert process.stdout is not None
        data = process.stdout.read(4096)
        if data is None:  # Nothing new.
            return
        if not data:
            self._news.append("it is no more commanded")
            self._ended = True  # It is waited for by `close`, not by the loop.
            return
        *lines, self._lines = (self._lines + data).split(b"\n")
        for line in lines:
            said = json.loads(line)
            self._width = said.get("width", self._width)
            if "text" in said:
                self._news.append(said["text"])


class SimulatedGripper:
    """Fingers that are where they are told to be, as fast as they can.

    Parameters
    ----------
    width : m, at first.
    """

    def __init__(self, width: float = 0.08) -> None:
        self._speed = FrankaGripperParams().speed
        self._width = self._target = width
        self._at = time.monotonic()

    def open(self) -> None:
        """See Gripper."""

    def command(self, width: float) -> None:
        """See Gripper."""
        self._advance()
        if math.isfinite(width):
            self._target = width

    def news(self) -> list[str]:
        """See Gripper."""
        return []

    def close(self) -> None:
        """See Gripper."""

    @property
    def width(self) -> float:
        """See Gripper."""
        self._advance()
        return self._width

    def _advance(self) -> None:
        now = time.monotonic()
        most = self._speed * (now - self._at)
        self._at = now
        self._width += max(-most, min(most, self._target - self._width))


def _say(**values: Any) -> None:
    print(json.dumps(values), flush=True)


def _newest(command: float, timeout: float) -> float | None:
    """Return the last width of those that have come, or `command` if none has; None:
    there will be no more."""
    if not select.select([0], [], [], timeout)[0]:
        return command
    # A pipe takes whole ones and gives whole ones.
    data = os.read(0, 1 << 16)
    return _WIDTH.unpack(data[-_WIDTH.size :])[0] if data else None


def _serve(host: str, module: str) -> None:
    franka = importlib.import_module(module)
    # panda-python has no name for it.
    refused = getattr(franka, "CommandException", RuntimeError)
    gripper = franka.Gripper(host)
    params = FrankaGripperParams()
    moves = FingerMoves(params)
    command = told = math.nan
    pause = 0.0
    while True:
        newest = _newest(command, pause)
        if newest is None:
            return
        command = newest
        state = gripper.read_once()
        if not abs(state.width - told) < 5e-4:
            if math.isnan(told):
                _say(text=f"ready, {1e3 * state.width:.0f} mm open")
            told = state.width
            _say(width=told)
        action = moves.next(command, state.width, state.max_width)
        pause = _PAUSE if action == "none" else 0.0
        try:
            if action == "move":
                gripper.move(moves.target, params.speed)
            elif action == "grasp":
                _say(text=f"it holds something, {1e3 * state.width:.0f} mm wide")
                gripper.grasp(
                    state.width, params.speed, params.force, _ANY_WIDTH, _ANY_WIDTH
                )
        except refused as error:
            moves.refuse()
            _say(text=f"fault: {one_line(error, 300)}")


def _main(host: str, module: str) -> int:
    try:
        _serve(host, module)
    except Exception as error:
        _say(text=f"fault: {one_line(error, 300)}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(_main(*sys.argv[1:]))
