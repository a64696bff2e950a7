# SPDX-License-Identifier: BSD-3-Clause
"""One side of a link in a process of its own, until its standard input ends.

python link_side.py SIDE listen|connect HOST:PORT KEYS|-

Messages have their sequence as position, in mm. Prints a line of JSON every 50 ms.
"""

import json
import sys
import threading
import time
from pathlib import Path

import dual_proxy as dp
from dual_proxy.link.message_link import MessageLink

PERIOD = 0.002


def main() -> None:
    side, how, address, keys = sys.argv[1:]
    access = {"insecure": True} if keys == "-" else {"keys": Path(keys)}
    end = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), end.set()), daemon=True).start()
    received: list[int] = []
    worst_age = 0.0
    with MessageLink(side, **{how: address}, **access) as link:
        start = time.monotonic()
        tick = 0
        while not end.is_set():
            now = time.monotonic()
            message = link.receive(now)
            if message is not None:
                received.append(message.sequence)
                worst_age = max(worst_age, now - message.send_time)
            link.send(
                time.monotonic(),
                dp.PoseMessage(
                    sequence=tick, send_time=now, pose=dp.Pose([1e-3 * tick, 0, 0])
                ),
                dp.LinkFrame.CLUTCH,
            )
            trouble = link.trouble(now)
            if tick % 25 == 0:
                line = {
                    "time": now - start,
                    "connected": link.connected(now),
                    "received": received,
                    "worst_age": worst_age,
                    "trouble": trouble,
                    "statistics": link.statistics(),
                }
                print(json.dumps(line), flush=True)
                received = []
                worst_age = 0.0
            tick += 1
            time.sleep(PERIOD)


main()
