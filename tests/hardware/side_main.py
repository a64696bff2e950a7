# SPDX-License-Identifier: BSD-3-Clause
"""`dual-proxy`, to which things happen, as lines of standard input say them.

python side_main.py CLOCK ARGUMENTS...

  press          the simulated hand presses further
  clock S        its clock, which never goes back, jumps by S seconds
  path TEXT      where the hand of Force Dimension's stand-in goes from now on
  plugged 0|1    whether that is plugged in

CLOCK is the first jump, s: 0 leaves the clock alone. Ends with its standard input.
"""

import ctypes
import os
import sys
import threading
import time
from pathlib import Path

from pressing_hand import PressingHand

from dual_proxy.cli import main
from dual_proxy.hardware import commands


class Clock:
    def __init__(self):
        self.monotonic = time.monotonic
        self.ahead = 0.0

    def jump(self, seconds):
        self.ahead += seconds
        time.monotonic = lambda: self.monotonic() + self.ahead


class Hand(PressingHand):
    the_one = None

    def __init__(self, *arguments):
        super().__init__(*arguments)
        Hand.the_one = self


def stand_in():
    folder = Path(sys.argv[sys.argv.index("--sdk") + 1])
    return ctypes.CDLL(next(folder.glob("lib/release/*/libdrd.so.*")))


def obey(clock):
    for line in sys.stdin:
        what, _, text = line.strip().partition(" ")
        if what == "press" and Hand.the_one is not None:
            Hand.the_one.press()
        elif what == "clock":
            clock.jump(float(text))
        elif what == "path":
            stand_in().standInSetPath(text.encode())
        elif what == "plugged":
            stand_in().standInUnplugAfter(ctypes.c_long(-int(text)))
    os._exit(0)  # Whoever started it is gone.


if __name__ == "__main__":
    if sys.argv[3].endswith("press.yaml"):
        commands.SimulatedHand = Hand
    clock = Clock()
    if float(sys.argv[1]):
        clock.jump(float(sys.argv[1]))
    threading.Thread(target=obey, args=(clock,), daemon=True).start()
    sys.exit(main(sys.argv[2:]))
