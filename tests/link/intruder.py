# SPDX-License-Identifier: BSD-3-Clause
"""Somebody who can reach the robot side and speaks Zenoh, without our rules.

python intruder.py HOST:PORT [KEYS]: ten thousand messages a second without keys, or
with those of a folder, in turn the lines of its standard input, as hexadecimal, until
it is killed.
"""

import json
import sys
import time
from pathlib import Path

import zenoh


class Intruder:
    def __init__(self, address, folder=None):
        protocol = "udp" if folder is None else "quic"
        end = "?rel=0" if folder else ""
        settings = {
            "mode": "peer",
            "listen/endpoints": [],
            "connect/endpoints": [f"{protocol}/{address}{end}"],
            "scouting/multicast/enabled": False,
            "scouting/gossip/enabled": False,
        }
        if folder is not None:
            tls = {"root_ca_certificate": str(folder / "ca.pem")}
            if (folder / "key.pem").exists():
                tls["connect_certificate"] = str(folder / "certificate.pem")
                tls["connect_private_key"] = str(folder / "key.pem")
                tls["enable_mtls"] = True
            settings["transport/link/tls"] = tls
        config = zenoh.Config()
        for name, value in settings.items():
            config.insert_json5(name, json.dumps(value))
        self.session = zenoh.open(config)
        self.publisher = self.session.declare_publisher(
            "dual_proxy/to_robot",
            congestion_control=zenoh.CongestionControl.DROP,
            express=True,
            reliability=zenoh.Reliability.BEST_EFFORT,
        )

    def put(self, data):
        self.publisher.put(data)


def flood(lines, address, folder=None):
    intruder = Intruder(address, folder and Path(folder))
    start = time.monotonic()
    sent = 0
    while True:
        while sent < 1e4 * (time.monotonic() - start):
            intruder.put(lines[sent % len(lines)])
            sent += 1
        time.sleep(0.0005)


if __name__ == "__main__":
    flood([bytes.fromhex(line) for line in sys.stdin], *sys.argv[1:])
