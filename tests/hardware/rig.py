# SPDX-License-Identifier: BSD-3-Clause
"""A side here, the other in a process of its own, and stories of what goes wrong.

Arm and hand are simulated in real time, and the hand moves on only while the robot
follows. Machines that run tests are busy: times are printed, and what is asserted has
room.
"""

import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
from pressing_hand import SLIDING, PressingHand

import dual_proxy as dp
from dual_proxy.hardware.arms import SimulatedPanda
from dual_proxy.hardware.events import Events
from dual_proxy.hardware.haptic_side import HapticSideProcess
from dual_proxy.hardware.robot_side import RobotSideProcess
from dual_proxy.link.agreement import describe_side
from dual_proxy.link.message_link import MessageLink

HERE = Path(__file__).parent
#: A scenario whose hand presses when it is told, and slides at HAND_SPEED, m/s.
PRESS = HERE / "press.yaml"
HAND_SPEED = 1.2 * SLIDING  # With what is behind it, and catches up.

# m: what counts as travelling by itself.
TRAVEL = 0.002
# s: for which a busy machine may hold a process up.
BUSY = 0.4
# s: how long a test waits for what is to come, at most.
PATIENCE = 40.0


class SideProcess:
    """`dual-proxy robot-side` or `haptic-side`, and what it says."""

    def __init__(self, side, folder, *options, scenario="plane"):
        self._side = side
        self._folder = folder
        self._options = [f"{side}-side", str(scenario), *map(str, options)]
        self.logs = []
        self.said = []

    def start(self, clock=0.0):
        self.logs.append(self._folder / f"{self._side}{len(self.logs)}.mcap")
        command = [sys.executable, HERE / "side_main.py", str(clock), *self._options]
        self.process = subprocess.Popen(
            [*command, "--log", self.logs[-1]],
            stdin=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self.process.stderr:
            self.said.append((time.monotonic(), line.rstrip()))

    def says(self, text, since=0.0):
        """Return when it first said so, time.monotonic(); 0: it did not."""
        return next((t for t, line in self.said if t > since and text in line), 0.0)

    def tell(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def press(self):
        self.tell("press")

    def signal(self, number):
        self.process.send_signal(number)

    def kill(self):
        self.process.kill()
        self.process.wait()
        self._reader.join(5)
        self.process.stdin.close()
        self.process.stderr.close()


class Story:
    """Runs a side here, and calls a story each cycle: what waits, step by step."""

    #: Cycles for which there has to be a force, N, that is contact.
    _STEADY = 500
    #: s: between cycles, of a machine that is busy; for how long it may be.
    _STALL = 0.025
    _CALM = 8.0
    _CONTACT = 2.0

    def _run(self, story, side, link):
        steps = story(self)
        wait = next(steps)
        begin = time.monotonic()

        def on_cycle(now, *_):
            nonlocal wait
            self._note(now)
            if now - begin > PATIENCE:
                side.stop()
            elif wait():
                try:
                    wait = next(steps)
                except StopIteration:
                    side.stop()

        side.on_cycle = on_cycle
        with link:
            ended = side.run()
        # The story came to its end, in time.
        assert next(steps, None) is None, [e.text for e in side.events.all]
        return ended

    def contact(self, press=None):
        """It follows and slides in contact, with a steady force; `press` has the hand
        press further, where it does not. And what a machine that was just busy did
        to the arm is over."""
        pressed = -np.inf
        begin = time.monotonic()

        def wait():
            nonlocal pressed
            now = time.monotonic()
            newest = self.forces[-self._STEADY :]
            if len(newest) < self._STEADY or not self.follow()():
                return False
            busy = max(np.diff(self.times[-self._STEADY :])) > self._STALL
            if busy and now < begin + self._CALM:
                return False
            least, most = min(newest), max(newest)
            if press is None:
                return least > self._CONTACT
            if most < self._CONTACT and now > pressed + 3:
                pressed = now
                press()
            return least > self._CONTACT and most < 1.15 * least and self._slides()

        return wait

    def passed(self, seconds):
        end = time.monotonic() + seconds
        return lambda: time.monotonic() >= end

    def mark(self):
        return len(self.times)

    def took(self, begin, end):
        """ms between two marks."""
        return 1e3 * (self.times[end] - self.times[begin])

    def force_before(self, mark):
        """N: in the last 0.3 s."""
        return max(self.forces[mark - 300 : mark])

    def most_force(self, begin, end=None):
        return max(self.forces[begin:end])


class Rig(Story):
    """The robot side, and what the arm did."""

    def __init__(self, port, sensor=None, log=None, scenario="plane", keys=None):
        self.scenario = dp.load_scenario(scenario)
        self.arm = SimulatedPanda(self.scenario, patience=BUSY)
        self.sensor = sensor
        if sensor is not None:
            sensor.arm = self.arm
        access = {"insecure": True} if keys is None else {"keys": keys}
        self.link = MessageLink(
            "robot",
            listen=f"127.0.0.1:{port}",
            made_of=describe_side(self.scenario),
            **access,
        )
        self.side = RobotSideProcess(
            self.scenario,
            self.arm,
            self.link,
            sensor=sensor,
            confirm=lambda _: True,
            events=Events("robot", tell=lambda _: None),
            log=log,
        )
        self.times, self.places, self.forces, self.holds = [], [], [], []

    def run(self, story):
        return self._run(story, self.side, self.link)

    def _note(self, now):
        self.times.append(now)
        self.places.append(self.arm.state.pose.p)
        self.forces.append(np.linalg.norm(self.arm.state.contact_truth[:3]))
        self.holds.append(self.side.state.side.hold)

    def _slides(self):
        """As fast as the hand: it neither sticks nor catches up."""
        for lag, tolerance in ((self._STEADY, 0.3), (self._STEADY // 5, 0.6)):
            hand = SLIDING * (self.times[-1] - self.times[-lag])
            if abs(self.travelled(-lag, None) - hand) > tolerance * hand:
                return False
        return True

    # What a story waits for.

    def hold(self, *why):
        return lambda: self.holds[-1] in why

    def follow(self):
        return lambda: self.holds[-1] == "none"

    def moved(self, distance):
        """The arm goes so far, m, from where it is now."""
        start = self.places[-1]
        return lambda: np.linalg.norm(self.places[-1] - start) > distance

    # What it did between two marks.

    def travelled(self, begin, end):
        places = np.array(self.places[begin:end])
        return float(np.linalg.norm(places - places[0], axis=1).max())

    def strayed(self, begin, end):
        """m: how much farther it went within 10 ms to 0.5 s than the hand slides."""
        times, places = (
            np.array(self.times[begin:end]),
            np.array(self.places[begin:end]),
        )
        farthest = 0.0
        for lag in (10, 50, 200, 500):
            went = np.linalg.norm(places[lag:] - places[:-lag], axis=1)
            allowed = HAND_SPEED * (times[lag:] - times[:-lag])
            farthest = max(farthest, float((went - allowed).max(initial=0.0)))
        return farthest

    def held_share(self, begin, end):
        """Of cycles in which it did not follow."""
        return float(np.mean(np.array(self.holds[begin:end]) != "none"))


class HapticRig(Story):
    """The haptic side with a simulated hand, and what the hand felt."""

    def __init__(self, port, scenario):
        loaded = dp.load_scenario(scenario)
        self.link = MessageLink(
            "haptic",
            connect=f"127.0.0.1:{port}",
            insecure=True,
            made_of=describe_side(loaded),
        )
        self.hand = PressingHand(loaded, self.is_followed)
        self.side = HapticSideProcess(
            loaded,
            self.hand,
            self.link,
            events=Events("haptic", tell=lambda _: None),
        )
        self.times, self.forces, self.follows = [], [], []

    def is_followed(self):
        return self.link.follows(time.monotonic())

    def run(self, story):
        return self._run(story, self.side, self.link)

    def _note(self, now):
        self.times.append(now)
        self.forces.append(np.linalg.norm(self.side.state.device_wrench[:3]))
        self.follows.append(self.is_followed())

    def _slides(self):
        return True

    # What a story waits for.

    def follow(self):
        return lambda: self.follows[-1]

    def alone(self):
        return lambda: not self.follows[-1]

    def let_go(self):
        """No force on the hand."""
        return lambda: self.forces[-1] == 0
