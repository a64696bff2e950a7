# SPDX-License-Identifier: BSD-3-Clause
"""The bad network of other tests does what it is set to."""

import socket
import time
from pathlib import Path

import numpy as np
import pytest
from settings_process import SettingsProcess

RELAY = Path(__file__).with_name("udp_relay.py")
COUNT = 400


class Ends:
    """Who sends, and who is behind the relay."""

    def __init__(self):
        self.here, self.there = (
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2)
        )
        self.there.bind(("127.0.0.1", 0))
        for end in (self.here, self.there):
            end.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
            end.settimeout(0.3)
        self.relay = SettingsProcess(RELAY, f"127.0.0.1:{self.there.getsockname()[1]}")
        self.here.connect(("127.0.0.1", self.relay.ports["port"]))

    def send(self, count=COUNT):
        """Return the numbers that came, and how long they were under way, s."""
        numbers, took = [], []
        for number in range(count):
            self.here.send(f"{number} {time.monotonic()!r}".encode().ljust(60))
            if number % 20 == 0:
                time.sleep(0.002)
        try:
            while True:
                data, self.front = self.there.recvfrom(100)
                now = time.monotonic()
                number, sent = data.split()
                numbers.append(int(number))
                took.append(now - float(sent))
        except TimeoutError:
            return numbers, took

    def close(self):
        self.here.close()
        self.there.close()
        self.relay.close()


@pytest.fixture
def ends():
    ends = Ends()
    yield ends
    ends.close()


def test_a_relay_without_settings_changes_nothing(ends):
    numbers, took = ends.send()
    assert numbers == list(range(COUNT))
    print(
        f"under way for {1e6 * np.median(took):.0f} us, {1e6 * max(took):.0f} us worst"
    )
    ends.there.sendto(b"back", ends.front)
    assert ends.here.recv(100) == b"back"


def test_a_relay_does_what_it_is_set_to(ends):
    ends.relay.set(cut=True)
    assert ends.send(20) == ([], [])
    ends.relay.set(cut=False, delay=0.05)
    numbers, took = ends.send()
    assert numbers == list(range(COUNT))
    assert min(took) >= 0.05
    print(
        f"delay of 50 ms: {1e3 * np.median(took):.2f} ms, {1e3 * max(took):.2f} worst"
    )
    ends.relay.set(jitter=0.02)
    numbers, took = ends.send()
    assert numbers == list(range(COUNT))
    assert np.ptp(took) > 0.005
    ends.relay.set(delay=0, jitter=0, loss=0.1)
    numbers, _ = ends.send()
    assert 0.8 * COUNT < len(numbers) < 0.98 * COUNT
    ends.relay.set(loss=0, duplicate=0.1)
    numbers, _ = ends.send()
    assert 1.02 * COUNT < len(numbers) < 1.2 * COUNT
    ends.relay.set(duplicate=0, reorder=0.1)
    numbers, _ = ends.send()
    assert sorted(numbers) == list(range(COUNT)) != numbers
    ends.relay.set(reorder=0, corrupt=1.0)
    ends.here.send(b"1" * 50)
    data = ends.there.recv(100)
    assert sum(byte != ord("1") for byte in data) == 1
    did = ends.relay.set()
    assert did["taken"] + did["duplicated"] == did["sent"] + did["lost"]
