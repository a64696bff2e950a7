# SPDX-License-Identifier: BSD-3-Clause
"""A bad network between two processes on this machine: relays UDP datagrams.

python udp_relay.py HOST:PORT

Prints a line of JSON with its `port` on 127.0.0.1. What comes there goes on to
HOST:PORT, from a socket of its own for each sender, and what comes back from there
goes back. Each line of standard input is a JSON object of settings (`SETTINGS`, for
both directions) and is answered by one with what it did until then; end of input
ends it. It knows nothing of what it relays, and imports nothing but Python's own
library.
"""

from __future__ import annotations

import contextlib
import heapq
import itertools
import json
import random
import selectors
import socket
import sys
import time

SETTINGS = {
    "cut": False,  # nothing gets through
    "loss": 0.0,  # share of datagrams
    "delay": 0.0,  # s, each way
    "jitter": 0.0,  # s, more than that at most; none overtakes another for it
    "duplicate": 0.0,  # share of datagrams that come twice
    "reorder": 0.0,  # share that comes `late` later, behind others
    "late": 0.005,  # s
    "corrupt": 0.0,  # share of which a byte is another
}
LONGEST = 65536
#: Datagrams of a socket in a row, after which it looks at what is due.
MOST_IN_A_ROW = 64


class Way:
    """From one socket to another, in one direction."""

    def __init__(self, relay: Relay, into: socket.socket, to: object) -> None:
        self._relay, self._into, self._to = relay, into, to
        self._last = 0.0

    def take(self, data: bytes) -> None:
        """Have a datagram go on, if it does and when."""
        relay = self._relay
        settings, chance, did = relay.set, relay.random.random, relay.did
        did["taken"] += 1
        if settings["cut"] or chance() < settings["loss"]:
            did["lost"] += 1
            return
        if data and chance() < settings["corrupt"]:
            changed = bytearray(data)
            changed[relay.random.randrange(len(data))] ^= relay.random.randint(1, 255)
            data = bytes(changed)
            did["corrupted"] += 1
        now = time.monotonic()
        due = now + settings["delay"] + chance() * settings["jitter"]
        if chance() < settings["reorder"]:
            due += settings["late"]
            did["reordered"] += 1
        else:
            due = self._last = max(due, self._last)
        copies = 1 + (chance() < settings["duplicate"])
        did["duplicated"] += copies - 1
        for _ in range(copies):
            if due <= now:
                self.send(data)
            else:
                relay.wait(due, self, data)

    def send(self, data: bytes) -> None:
        # Nobody is there, or it is jammed: it is lost, as on a network.
        with contextlib.suppress(OSError):
            if self._to is None:
                self._into.send(data)
            else:
                self._into.sendto(data, self._to)
            self._relay.did["sent"] += 1


class Relay:
    """What it is set to, who is there, and what is under way."""

    def __init__(self, target: tuple[str, int]) -> None:
        self.set = dict(SETTINGS)
        self.random = random.Random(1)
        self.did = dict.fromkeys(
            ("taken", "sent", "lost", "corrupted", "duplicated", "reordered"), 0
        )
        self._target = target
        self._front = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._front.bind(("127.0.0.1", 0))
        self._front.setblocking(False)
        self.port = self._front.getsockname()[1]
        self._ways: dict[object, Way] = {}
        self._due: list[tuple[float, int, Way, bytes]] = []
        self._number = itertools.count()
        # select() knows microseconds, where epoll knows milliseconds.
        self._selector = selectors.SelectSelector()
        self._selector.register(self._front, selectors.EVENT_READ, None)

    def wait(self, due: float, way: Way, data: bytes) -> None:
        heapq.heappush(self._due, (due, next(self._number), way, data))

    def run(self) -> None:
        self._selector.register(sys.stdin, selectors.EVENT_READ, None)
        while True:
            wait = max(0.0, self._due[0][0] - time.monotonic()) if self._due else None
            for key, _ in self._selector.select(wait):
                if key.fileobj is self._front:
                    self._hear()
                elif key.fileobj is sys.stdin:
                    line = sys.stdin.readline()
                    if not line:
                        return
                    self.set.update(json.loads(line))
                    print(json.dumps(self.did), flush=True)
                else:
                    self._hear_back(key.fileobj, key.data)
            while self._due and self._due[0][0] <= time.monotonic():
                _, _, way, data = heapq.heappop(self._due)
                way.send(data)

    def _hear(self) -> None:
        with contextlib.suppress(OSError):
            for _ in range(MOST_IN_A_ROW):
                data, client = self._front.recvfrom(LONGEST)
                if client not in self._ways:
                    self._ways[client] = self._add(client)
                self._ways[client].take(data)

    def _hear_back(self, back: socket.socket, way: Way) -> None:
        with contextlib.suppress(OSError):
            for _ in range(MOST_IN_A_ROW):
                way.take(back.recv(LONGEST))

    def _add(self, client: object) -> Way:
        back = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        back.connect(self._target)
        back.setblocking(False)
        self._selector.register(
            back, selectors.EVENT_READ, Way(self, self._front, client)
        )
        return Way(self, back, None)


def main() -> None:
    host, _, port = sys.argv[1].rpartition(":")
    relay = Relay((host, int(port)))
    print(json.dumps({"port": relay.port}), flush=True)
    relay.run()


if __name__ == "__main__":
    main()
