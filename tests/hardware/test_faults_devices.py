# SPDX-License-Identifier: BSD-3-Clause
"""What goes wrong with device and sensor, and what happens within how long.

Both are read by their drivers, from stand-ins that know nothing of us: Force
Dimension's SDK in the haptic side's process, and a force sensor that speaks RDT.
"""

import contextlib
import socket
from pathlib import Path

import numpy as np
import pytest
from pressing_hand import PRESSING, SLIDING
from settings_process import SettingsProcess

import dual_proxy as dp

try:
    from rig import PRESS, TRAVEL, Rig, SideProcess
except ImportError as error:
    pytest.skip(str(error), allow_module_level=True)

SERVER = Path(__file__).parents[1] / "drivers" / "rdt_server.py"
#: Of an RDT record, for one N or N m.
COUNTS = 1e6
#: m, that the scenario's path goes down.
DEPTH = 0.04


@contextlib.contextmanager
def haptic_side(folder, port, *device, scenario=PRESS):
    options = (*device, "--connect", f"127.0.0.1:{port}", "--insecure")
    process = SideProcess("haptic", folder, *options, scenario=scenario)
    process.start()
    try:
        yield process
    finally:
        process.kill()


def hand_path(since, depth):
    """Of the stand-in: from `since`, m of the robot, to `depth`, then to and fro."""
    scenario = dp.load_scenario(PRESS)
    path = scenario.handle_path()
    down = (path.calc(1.0)[0] - path.calc(0.0)[0]) / DEPTH
    aside = np.array([4 * SLIDING / scenario.map.scale, 0, 0])
    begin = (depth - since) / PRESSING
    places = [(0, since * down)] if begin > 0 else []
    places += [(begin + 4 * i, depth * down + (i % 2) * aside) for i in range(10)]
    return ";".join(" ".join(f"{x:.6f}" for x in (t, *p)) for t, p in places)


def test_a_device_is_unplugged_and_plugged_in_again(port, sdk_folder, tmp_path):
    with haptic_side(
        tmp_path, port, "--device", "omega", "--sdk", sdk_folder
    ) as haptic:
        rig = Rig(port, scenario=PRESS)
        marks = {}
        depth = 0.0

        def press():
            nonlocal depth
            depth += DEPTH
            haptic.tell(f"path {hand_path(depth - DEPTH, depth)}")

        def story(rig):
            yield rig.contact(press)
            marks["unplugged"] = rig.mark()
            haptic.tell("plugged 0")
            yield rig.hold("asked")
            marks["held"] = rig.mark()
            yield rig.passed(1)
            marks["plugged"] = rig.mark()
            haptic.tell(f"path {hand_path(depth, depth)}")
            haptic.tell("plugged 1")
            yield rig.follow()
            marks["follows"] = rig.mark()
            yield rig.passed(0.5)
            marks["end"] = rig.mark()
            yield rig.moved(0.002)

        assert rig.run(story)
        assert haptic.says("no longer answers")
    before = rig.force_before(marks["unplugged"])
    most = rig.most_force(marks["unplugged"], marks["end"])
    went = rig.travelled(marks["unplugged"], marks["follows"])
    print(
        f"device unplugged: holds after "
        f"{rig.took(marks['unplugged'], marks['held']):.0f} ms, follows "
        f"{rig.took(marks['plugged'], marks['follows']):.0f} ms after it is there; "
        f"{1e3 * went:.2f} mm by itself; {before:.1f} N before, {most:.1f} N at most"
    )
    assert went < TRAVEL
    assert most < 1.5 * before


class WristSensor:
    """An RdtSensor, whose stand-in measures what the arm's wrist does."""

    def __init__(self):
        self.server = SettingsProcess(SERVER)
        ports = self.server.ports
        self._to = ("127.0.0.1", ports["counts"])
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._sensor = dp.RdtSensor(
            dp.RdtSensorParams(
                host="127.0.0.1", port=ports["rdt"], reports="arm_on_tool"
            )
        )
        self.arm = None

    def open(self):
        self._feed()
        self._sensor.open()

    def read(self):
        self._feed()
        return self._sensor.read()

    def _feed(self):
        counts = np.round(COUNTS * np.array(self.arm.wrench().value)).astype(">i4")
        self._socket.sendto(counts.tobytes(), self._to)

    def close(self):
        self._sensor.close()
        self._socket.close()
        self.server.close()

    @property
    def counts(self):
        return self._sensor.counts


def test_a_sensor_that_freezes_hangs_and_loses_records(port, tmp_path):
    sensor = WristSensor()
    marks = {}
    faults = {
        "values freeze": {"frozen": True},
        "all of it hangs": {"hung": True},
        "records lost, twice and out of order": {
            "loss": 0.1,
            "repeat": 0.1,
            "reorder": 0.1,
            "garbage": 0.05,
        },
    }
    with haptic_side(tmp_path, port, "--device", "simulated") as haptic:
        rig = Rig(port, sensor, scenario=PRESS)

        def story(rig):
            for fault, settings in faults.items():
                yield rig.contact(haptic.press)
                begin = rig.mark()
                sensor.server.set(**settings)
                yield rig.passed(1)
                back = rig.mark()
                sensor.server.set(**dict.fromkeys(settings, 0))
                yield rig.follow()
                follows = rig.mark()
                yield rig.passed(0.5)
                marks[fault] = (begin, back, follows, rig.mark())

        assert rig.run(story)
    for fault, (begin, back, follows, end) in marks.items():
        held = [i for i in range(begin, back) if rig.holds[i] == "no_sensor"]
        text = "goes on"
        if held:
            text = (
                f"holds after {rig.took(begin, held[0]):.0f} ms, follows "
                f"{rig.took(back, follows):.0f} ms after it"
            )
        before, most = rig.force_before(begin), rig.most_force(begin, end)
        if "lost" in fault:
            went = rig.strayed(begin, end)
        else:
            assert held
            went = rig.travelled(begin, follows)
        print(
            f"force sensor: {fault}: {text}; {1e3 * went:.2f} mm by itself; "
            f"{before:.1f} N before, {most:.1f} N at most"
        )
        assert went < TRAVEL
        assert most < 1.5 * before
