# SPDX-License-Identifier: BSD-3-Clause
"""A stand-in for a force sensor that speaks RDT, as a process of its own.

python rdt_server.py [HOST PORT]

Prints a line of JSON with its ports on HOST (127.0.0.1): `rdt` (UDP, PORT or any),
`http`, where its page netftapi2.xml is, and `counts` (UDP): six int32, big-endian,
there are its `counts` from then on. Each line of standard input is a JSON object of
settings (`SETTINGS`) and is answered by one with what it did until then; end of input
ends it. A stream goes to whoever asked last, and begins with record 1. It knows nothing
of what receives it, and imports nothing but Python's own library.
"""

from __future__ import annotations

import json
import random
import selectors
import socket
import struct
import sys
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

SETTINGS = {
    "rate": 1000.0,  # Hz
    "counts": [0, 0, 0, 0, 0, 0],
    "noise": 500,  # counts, standard deviation
    "clock": None,  # s of time.monotonic(): fx is the time since, us
    "status": 0,
    "loss": 0.0,  # share of records
    "repeat": 0.0,
    "reorder": 0.0,  # of records that come after the next one
    "garbage": 0.0,  # of records before which something else comes
    "silent": False,
    "hung": False,  # the sample counter and values stand still
    "frozen": False,  # the values alone
    "reboot": False,  # once: the stream ends, counters begin anew
    "xml": """<?xml version="1.0" encoding="UTF-8"?>
<netft>
<runstat>0x00000000</runstat>
<cfgnam>Default</cfgnam>
<cfgfu>2</cfgfu><scfgfu>N</scfgfu>
<cfgtu>3</cfgtu><scfgtu>N-m</scfgtu>
<cfgcpf>1000000</cfgcpf>
<cfgcpt>1000000</cfgcpt>
<comrdte>Enabled</comrdte>
<comrdtrate>1000</comrdtrate>
</netft>
""",
}
REQUEST = struct.Struct(">HHI")
RECORD = struct.Struct(">IIIiiiiii")
COUNTS = struct.Struct(">6i")
STOP, STREAM = 0, 2


class Sensor:
    """What it is set to, and how far it is."""

    def __init__(self, udp: socket.socket) -> None:
        self.udp = udp
        self.set = dict(SETTINGS)
        self.random = random.Random(1)
        self.client = None
        self.sequence = 0
        self.sample = 70_000
        self.values = [0] * 6
        self.held_back: bytes | None = None
        self.did = {"sent": 0, "lost": 0, "streams": 0, "stops": 0, "others": 0}

    def hear(self) -> None:
        """Take a request."""
        data, address = self.udp.recvfrom(64)
        header, command, _ = REQUEST.unpack(data) if len(data) == 8 else (0, 0, 0)
        if header == 0x1234 and command == STREAM:
            self.client, self.sequence, self.held_back = address, 0, None
            self.did["streams"] += 1
        elif header == 0x1234 and command == STOP:
            self.client = None
            self.did["stops"] += 1
        else:
            self.did["others"] += 1

    def feed(self, counts: socket.socket) -> None:
        """Take what it is to measure."""
        self.set["counts"] = COUNTS.unpack(counts.recv(COUNTS.size))

    def obey(self, line: str) -> dict[str, int]:
        """Take settings."""
        self.set.update(json.loads(line))
        if self.set["reboot"]:
            self.set["reboot"] = False
            self.client, self.sequence, self.sample = None, 0, 0
        return dict(self.did)

    def measure(self) -> None:
        """Take a sample, and send it."""
        if not self.set["hung"]:
            self.sample = (self.sample + 7) % 2**32
            if not self.set["frozen"]:
                noise = self.set["noise"]
                self.values = [
                    max(-(2**31), min(2**31 - 1, round(self.random.gauss(c, noise))))
                    for c in self.set["counts"]
                ]
        if self.set["clock"] is not None:
            self.values[0] = round(1e6 * (time.monotonic() - self.set["clock"]))
        if self.client is None or self.set["silent"]:
            return
        self.sequence = (self.sequence + 1) % 2**32
        record = RECORD.pack(
            self.sequence, self.sample, self.set["status"], *self.values
        )
        chance = self.random.random
        if chance() < self.set["garbage"]:
            size = self.random.choice([0, 1, 35, 37, 1000])
            self.udp.sendto(self.random.randbytes(size), self.client)
        if chance() < self.set["loss"]:
            self.did["lost"] += 1
        elif chance() < self.set["reorder"] and self.held_back is None:
            self.held_back = record
        else:
            for _ in range(1 + (chance() < self.set["repeat"])):
                self.udp.sendto(record, self.client)
            if self.held_back is not None:
                self.udp.sendto(self.held_back, self.client)
                self.held_back = None
        self.did["sent"] += 1


def serve_page(sensor: Sensor, host: str) -> ThreadingHTTPServer:
    class Page(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            found = self.path == "/netftapi2.xml"
            self.send_response(200 if found else 404)
            self.end_headers()
            if found:
                self.wfile.write(sensor.set["xml"].encode())

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer((host, 0), Page)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server


def main() -> None:
    udp, counts = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
    host, port = sys.argv[1:] or ("127.0.0.1", "0")
    udp.bind((host, int(port)))
    counts.bind((host, 0))
    sensor = Sensor(udp)
    page = serve_page(sensor, host)
    ports = {
        "rdt": udp.getsockname()[1],
        "http": page.server_address[1],
        "counts": counts.getsockname()[1],
    }
    print(json.dumps(ports), flush=True)

    selector = selectors.DefaultSelector()
    selector.register(udp, selectors.EVENT_READ, "request")
    selector.register(counts, selectors.EVENT_READ, "counts")
    selector.register(sys.stdin, selectors.EVENT_READ, "settings")
    due = time.monotonic()
    while True:
        for key, _ in selector.select(max(0.0, due - time.monotonic())):
            if key.data == "request":
                sensor.hear()
            elif key.data == "counts":
                sensor.feed(counts)
            else:
                line = sys.stdin.readline()
                if not line:
                    return
                print(json.dumps(sensor.obey(line)), flush=True)
        if time.monotonic() >= due:
            sensor.measure()
            # What a busy machine made late is not made up for.
            due = max(due + 1 / sensor.set["rate"], time.monotonic() - 0.01)


if __name__ == "__main__":
    main()
