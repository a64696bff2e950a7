# SPDX-License-Identifier: BSD-3-Clause
"""Grippers that follow the hand: Franka's over a double of pylibfranka in the process
that the driver starts, and a robot side with one. Times are printed, and what is
asserted has room for a busy machine."""

import json
import math
import time
from dataclasses import replace
from types import SimpleNamespace

import pytest

import dual_proxy as dp
from dual_proxy.cli import main
from dual_proxy.hardware.arms import SimulatedPanda
from dual_proxy.hardware.devices import SimulatedHand
from dual_proxy.hardware.events import Events, cycle_text
from dual_proxy.hardware.grippers import FrankaGripper, SimulatedGripper
from dual_proxy.hardware.haptic_side import HapticSideProcess
from dual_proxy.hardware.robot_side import RobotSideProcess

# s: how long a test waits for what is to come, at most.
PATIENCE = 30.0

# As HAND says: {"object": m, "blocks": s, once, "raises": text, "absent": text}.
PYLIBFRANKA = """
import json, os, time
from types import SimpleNamespace

hand = json.loads(os.environ["HAND"])

class CommandException(Exception):
    pass

class Gripper:
    def __init__(self, host):
        if "absent" in hand:
            raise RuntimeError(hand["absent"])
        self._width = 0.08

    def read_once(self):
        time.sleep(0.001)
        return SimpleNamespace(width=self._width, max_width=0.08)

    def _note(self, *call):
        with open(hand["calls"], "a") as file:
            file.write(json.dumps([time.monotonic(), *call]) + "\\n")

    def move(self, width, speed):
        self._note("move", width)
        if "raises" in hand:
            raise CommandException(hand["raises"])
        time.sleep(hand.pop("blocks", 0.0))
        self._width = max(width, hand.get("object", 0.0))
        self._note("moved", self._width)
        return True

    def grasp(self, width, speed, force, inner, outer):
        self._note("grasp", width)
        return True
"""


class Hand:
    """A FrankaGripper whose hand is the double's."""

    def __init__(self, folder, monkeypatch, **behaviour):
        (folder / "pylibfranka.py").write_text(PYLIBFRANKA, encoding="utf-8")
        self._calls = folder / "calls"
        behaviour["calls"] = str(self._calls)
        monkeypatch.setenv("HAND", json.dumps(behaviour))
        monkeypatch.setenv("PYTHONPATH", str(folder), prepend=":")
        self.gripper = FrankaGripper("arm")
        self.news = []

    def calls(self):
        if not self._calls.exists():
            return []
        lines = self._calls.read_text(encoding="utf-8").splitlines()
        return [json.loads(line) for line in lines]

    def kinds(self):
        return [call[1] for call in self.calls()]

    def wait(self, until):
        end = time.monotonic() + PATIENCE
        while not until():
            assert time.monotonic() < end, (self.calls(), self.news)
            self.news += self.gripper.news()
            time.sleep(0.002)

    def wait_until_ready(self):
        self.gripper.open()
        self.wait(lambda: self.gripper.width == 0.08)


@pytest.fixture
def make_hand(tmp_path, monkeypatch):
    hands = []

    def make(**behaviour):
        hands.append(Hand(tmp_path, monkeypatch, **behaviour))
        return hands[-1]

    yield make
    for hand in hands:
        hand.gripper.close()


def test_fingers_go_where_they_are_told_and_hold_what_they_meet(make_hand):
    hand = make_hand(object=0.03)
    hand.wait_until_ready()
    assert hand.news == ["ready, 80 mm open"]
    hand.gripper.command(math.nan)
    hand.gripper.command(0.08)
    hand.gripper.command(0.05)
    hand.wait(lambda: hand.gripper.width == 0.05)
    hand.gripper.command(0.01)
    hand.wait(lambda: "grasp" in hand.kinds())
    hand.gripper.command(0.06)
    hand.wait(lambda: hand.gripper.width == 0.06)
    assert [call[1:] for call in hand.calls() if call[1] != "moved"] == [
        ["move", 0.05],
        ["move", 0.01],
        ["grasp", 0.03],
        ["move", 0.06],
    ]
    assert "it holds something, 30 mm wide" in hand.news


def test_one_that_refuses_or_is_not_there_is_told_and_disturbs_nobody(make_hand):
    hand = make_hand(raises="libfranka gripper: not homed\nsecond line")
    hand.wait_until_ready()
    hand.gripper.command(0.08)
    hand.gripper.command(0.02)
    hand.wait(lambda: len(hand.news) == 2)
    assert "fault: libfranka gripper: not homed" in hand.news[1]
    assert "\n" not in hand.news[1]
    hand.gripper.close()

    absent = make_hand(absent="libfranka gripper: Connection error")
    absent.gripper.open()
    absent.wait(lambda: len(absent.news) == 2)
    assert absent.news == [
        "fault: libfranka gripper: Connection error",
        "it is no more commanded",
    ]
    for i in range(10000):
        absent.gripper.command(1e-6 * i)
        assert absent.gripper.news() == []
    assert math.isnan(absent.gripper.width)


class OwnLink:
    """A haptic side that is always there, with its handle at home."""

    def __init__(self):
        self.opening = math.nan
        self.flags, self.reasons = 0, ""
        self._message = dp.PoseMessage()

    def receive(self, now):
        message = dp.PoseMessage()
        message.sequence = self._message.sequence + 1
        message.send_time = now
        message.gripper_opening = self.opening
        self._message = message
        return message

    def send(self, now, message, flags):
        pass

    def trouble(self, now):
        return ""


def make_side(gripper, link, confirm=lambda _: True):
    scenario = dp.load_scenario("plane")
    return RobotSideProcess(
        scenario,
        SimulatedPanda(scenario, patience=0.4),
        link,
        gripper=gripper,
        confirm=confirm,
        events=Events("robot", tell=lambda _: None),
    )


def test_the_arm_does_not_wait_for_fingers_that_are_stuck(make_hand):
    """The hand closes; the gripper takes 2 s for the move. Cycles go on."""
    hand = make_hand(blocks=2.0)
    hand.wait_until_ready()
    hand.gripper.open = lambda: None
    link = OwnLink()
    side = make_side(hand.gripper, link)
    during = []
    followed = 0

    def on_cycle(now, *_):
        nonlocal followed
        followed += side.state.side.hold == "none"
        if followed == 500:
            # So far nobody knew where the operator's gripper is.
            assert hand.calls() == []
            link.opening = 0.005
        elif followed > 500 and followed % 20 == 0:
            kinds = hand.kinds()
            if "moved" in kinds:
                side.stop()
            elif "move" in kinds:
                during.append(now)

    side.on_cycle = on_cycle
    assert side.run(PATIENCE)
    calls = {call[1]: call for call in hand.calls()[:2]}
    took = calls["moved"][0] - calls["move"][0]
    assert took >= 2
    cycles = 20 * len(during)
    print(f"{cycles} cycles in a move of {took:.2f} s;", cycle_text(side.work))
    assert cycles > 1000
    assert side.events.count("fault") == 0


def test_fingers_follow_the_hand_once_somebody_has_confirmed():
    """A simulated one, with the operator's gripper closing and opening."""
    gripper = SimulatedGripper()
    link = OwnLink()
    link.opening = 0.01
    refused = make_side(gripper, link, confirm=lambda _: False)
    assert refused.run(1) is False
    assert gripper.width == 0.08
    side = make_side(gripper, link)
    widths = []
    begin = time.monotonic()

    def on_cycle(now, *_):
        widths.append(gripper.width)
        if min(widths) < 0.031:
            link.opening = 0.02
        opened = widths[-1] > 0.059 and link.opening == 0.02
        if opened or now - begin > PATIENCE:
            side.stop()

    side.on_cycle = on_cycle
    assert side.run(PATIENCE)
    assert min(widths) == pytest.approx(0.03, abs=1e-3)
    assert widths[-1] == pytest.approx(0.06, abs=2e-3)


class Device:
    """A device with a button and a gripper."""

    def __init__(self, scenario):
        self._hand = SimulatedHand(scenario)
        self.pressed = False
        self.fault = ""

    def open(self):
        self._hand.open()

    def read(self):
        handle = self._hand.read()
        return replace(handle, clutch=self.pressed, gripper_opening=0.017)

    def write(self, wrench, gripper_force=0.0):
        self._hand.write(wrench)

    def close(self):
        self._hand.close()


# As a link to a robot side that is there, and follows.
FOLLOWING = SimpleNamespace(
    flags=0,
    reasons="",
    send=lambda *_: None,
    receive=lambda _: None,
    follows=lambda _: True,
    trouble=lambda _: "",
)


@pytest.mark.parametrize("grips", [False, True])
def test_the_button_may_be_the_gripper(grips):
    scenario = dp.load_scenario("plane")
    device = Device(scenario)
    side = HapticSideProcess(
        scenario,
        device,
        FOLLOWING,
        button_grips=grips,
        events=Events("haptic", tell=lambda _: None),
    )
    openings = {False: [], True: []}

    def on_cycle(*_):
        openings[device.pressed].append(side.state.message.gripper_opening)
        device.pressed = len(openings[False]) > 50

    side.on_cycle = on_cycle
    assert side.run(0.5)
    expected = {False: 0.1, True: 0.0} if grips else {False: 0.017, True: 0.017}
    for pressed, value in expected.items():
        assert set(openings[pressed]) == {value}
    assert side.events.count("clutch") == (0 if grips else 1)


def test_command_line_says_which_there_are(capsys):
    base = ["robot-side", "plane", "--listen", "127.0.0.1:7447", "--insecure"]
    assert main([*base, "--arm", "simulated", "--gripper", "x"]) == 2
    assert "--gripper: invalid choice: 'x'" in capsys.readouterr().err
