# SPDX-License-Identifier: BSD-3-Clause
"""Processes of a run over the real protocols, and what it left behind.

simulator.py (FCI, franka-sim) - robot-side - udp_relay.py - haptic-side - SDK
rdt_server.py (its wrist, RDT) -'             (50 ms, 5 % lost)       stand-in
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from free_port import free_port
from numpy.typing import NDArray
from panda_mjcf import write_panda_mjcf
from settings_process import SettingsProcess

import dual_proxy as dp
from dual_proxy.hardware.robot_side import ROBOT_COLUMNS
from dual_proxy.hardware.side_log import read_side_log
from dual_proxy.station import start_posture

HERE = Path(__file__).parent
SIMULATOR = Path(sys.prefix) / "franka-sim"
RDT_HOST, RDT_PORT = "127.0.0.2", 49152  # Sensors know no other port.
STIFFNESS = 30e3  # N/m, of the table.
DELAY, LOSS = 0.05, 0.05
#: Built where CMake finds libfranka's headers and Drake's.
CPP_SIDE = HERE.parents[1] / "build/examples/cpp/franka_robot_side"
#: s; m, in D: where a hand goes.
Path3 = list[tuple[float, float, float, float]]


def need_simulator() -> None:
    """Skip where franka-sim or pylibfranka could not be installed."""
    missing = SIMULATOR / "missing"
    if missing.exists():
        pytest.skip(missing.read_text().strip())
    if not (SIMULATOR / "bin/python").exists():
        pytest.skip("franka-sim is not there: `make test` installs it")
    pytest.importorskip("pylibfranka", reason="pylibfranka is not installed")


class Process:
    """A process of which all that it says goes to a file."""

    def __init__(
        self, folder: Path, name: str, command: list[Any], **options: Any
    ) -> None:
        self._path = folder / f"{name}.log"
        with self._path.open("w") as file:
            self.process = subprocess.Popen(
                [str(part) for part in command],
                stdout=file,
                stderr=file,
                **options,
            )

    def text(self) -> str:
        """Return what it said until now."""
        return self._path.read_text()

    def wait_for(self, text: str, seconds: float = 30) -> None:
        """Wait until it says something."""
        end = time.monotonic() + seconds
        while text not in self.text():
            assert self.process.poll() is None, self.text()
            assert time.monotonic() < end, f"{text!r} is not in {self.text()}"
            time.sleep(0.02)

    def end(self, number: int = signal.SIGTERM, seconds: float = 20) -> int:
        """End it by a signal; return its exit status."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            return self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.wait()


def command(*options: Any) -> list[Any]:
    """Return `dual-proxy` with options."""
    code = "import sys; from dual_proxy.cli import main; sys.exit(main())"
    return [sys.executable, "-c", code, *options]


def path_text(path: Path3) -> str:
    """Return where a hand goes, s and m in D, as the stand-in for the SDK wants it."""
    return ";".join(" ".join(map(str, point)) for point in path)


def pressing_path(seconds: float) -> Path3:
    """Return a hand that presses from 5 s on for so long, and slides."""
    path = [(0.0, 0.0, 0.0, 0.0), (1, 0, 0, 0), (3, 0, 0, -0.022), (5, 0, 0, -0.044)]
    places = [(0.01, 0.0), (0.02, 0.01), (0.0, 0.0)]
    times = np.arange(7.0, 5 + seconds + 2, 2.0)
    path += [(float(t), *places[i % 3], -0.044) for i, t in enumerate(times)]
    return path


def give_priority(process: subprocess.Popen[Any], priority: int) -> None:
    """Give a process, before it starts threads, a core whenever it needs one, as what
    it stands in for has; where we may."""
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(process.pid, os.SCHED_FIFO, os.sched_param(priority))


class FciRig:
    """All processes of a run.

    Attributes
    ----------
    robot, haptic : both sides.
    log : of the robot side.
    time, force, place : after `finish`: s; N, (n, 3), of the tip on the table, the
        truth; m, (n, 3), of the tip.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.log = folder / "robot.mcap"
        self._go = folder / "go"
        self._truth = folder / "truth.npy"
        self._closing = contextlib.ExitStack()
        self._sides: list[Process] = []

    def start(self, name: str, command: list[Any], **options: Any) -> Process:
        """Start a process that ends with the rig."""
        process = Process(self.folder, name, command, **options)
        self._closing.callback(process.end)
        return process

    def _start_helper(self, program: Path, *arguments: str) -> SettingsProcess:
        helper = SettingsProcess(program, *arguments)
        self._closing.callback(helper.close)
        give_priority(helper.process, 40)
        return helper

    def start_arm(self) -> str:
        """Start the arm and its sensor; return the sensor, as robot-side wants it."""
        server = HERE.parent / "drivers/rdt_server.py"
        sensor = self._start_helper(server, RDT_HOST, str(RDT_PORT))
        sensor.set(loss=0.05, reorder=0.02, repeat=0.02, noise=5e3)
        scenario = dp.load_scenario("plane")
        mjcf = self.folder / "panda.xml"
        write_panda_mjcf(scenario, mjcf, STIFFNESS)
        _, q_start = start_posture(scenario)
        program = [SIMULATOR / "bin/python", HERE / "simulator.py", mjcf]
        program.append(",".join(map(repr, q_start.tolist())))
        program += [f"{RDT_HOST}:{sensor.ports['counts']}", self._truth]
        simulator = self.start("simulator", program)
        give_priority(simulator.process, 20)
        simulator.wait_for("ready")
        return f"rdt:{RDT_HOST}:{sensor.ports['http']}"

    def start_sides(self, sensor: str, sdk: Path, path: Path3) -> None:
        """Start both sides, with certificates; have the hand begin when the robot
        follows."""
        keys = self.folder / "keys"
        hosts = ["--robot-host", "127.0.0.1", "--haptic-host", "127.0.0.1"]
        subprocess.run(
            command("keys", keys, *hosts), check=True, stdout=subprocess.DEVNULL
        )
        port = free_port()
        relay = self._start_helper(
            HERE.parent / "hardware/udp_relay.py", f"127.0.0.1:{port}"
        )
        relay.set(delay=DELAY, loss=LOSS)
        self.robot = self.start(
            "robot",
            [
                *command("robot-side", "plane", "--arm", "127.0.0.1"),
                *("--sensor", sensor, "--listen", f"127.0.0.1:{port}"),
                *("--keys", keys / "robot", "--log", self.log, "--yes"),
            ],
        )
        self.robot.wait_for("no link: it holds")
        self.haptic = self.start(
            "haptic",
            [
                *command("haptic-side", "plane", "--device", "omega"),
                *(
                    "--connect",
                    f"127.0.0.1:{relay.ports['port']}",
                    "--keys",
                    keys / "haptic",
                ),
                *("--log", self.folder / "haptic.mcap"),
            ],
            env={
                **os.environ,
                "FDSDK": str(sdk),
                "STAND_IN_PATH": path_text(path),
                "STAND_IN_GO": str(self._go),
            },
        )
        self.robot.wait_for("follow")
        self._go.touch()
        self._sides = [self.robot, self.haptic]

    def run_cpp_side(self, path: Path3, seconds: float) -> None:
        """Run the C++ robot side for so long, with a hand here that takes a path once
        it follows: without relay, by frames over UDP."""
        ports = free_port(), free_port()
        scenario = self.folder / "plane.yaml"
        scenario.write_text(dp.load_scenario("plane").to_yaml())
        numbers = [str(port) for port in ports]
        self.robot = self.start(
            "robot", [CPP_SIDE, scenario, "127.0.0.1", *numbers, "--yes"]
        )
        self._sides = [self.robot]
        path = np.array(path)
        end = dp.LinkEnd("to_robot", dp.LinkMonitorParams(), dp.LinkEndParams())
        state = end.make_state(1)
        following = None
        message = dp.PoseMessage()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
            link.bind(("127.0.0.1", ports[1]))
            link.connect(("127.0.0.1", ports[0]))
            link.setblocking(False)
            begin = due = time.monotonic()
            while (now := time.monotonic()) < begin + seconds:
                with contextlib.suppress(BlockingIOError, ConnectionRefusedError):
                    while True:
                        end.receive(now, link.recv(2048), state)
                if following is None and state.message.sequence >= 0:
                    following = None if state.flags & dp.LinkFrame.HOLDING else now
                if now >= due:
                    due += 0.02
                    t = now - following if following else 0.0
                    place = [np.interp(t, path[:, 0], path[:, i]) for i in (1, 2, 3)]
                    message = dp.PoseMessage(
                        sequence=message.sequence + 1,
                        send_time=now,
                        pose=dp.Pose(p=place),
                    )
                data = end.send(now, message, 0, state)
                if data is not None:
                    with contextlib.suppress(ConnectionRefusedError):
                        link.send(data)
                time.sleep(0.002)

    def finish(self) -> None:
        """End all processes, and read what they left."""
        for side in self._sides:
            assert side.end(signal.SIGINT) == 0, side.text()
        self.end()
        truth = np.load(self._truth)
        self.time = truth[:, 0]
        self.force, self.place = truth[:, 1:4], truth[:, 4:7]

    def end(self) -> None:
        """End all processes."""
        self._closing.close()

    def lost_messages(self) -> float:
        """Return the share of the haptic side's messages that the robot's never got."""
        _, cycles = read_side_log(self.log, {"robot": ROBOT_COLUMNS})
        came = [c.message.sequence for c in cycles if c.message is not None]
        return 1 - len(came) / (came[-1] - came[0] + 1)

    def states(self) -> Iterator[tuple[float, dict[str, Any]]]:
        """Yield channel /state of the robot side's log: s on the wall, and what."""
        from mcap.reader import make_reader

        with self.log.open("rb") as file:
            for _, _, message in make_reader(file).iter_messages("/state"):
                yield 1e-9 * message.log_time, json.loads(message.data)


def ac_rms(force: NDArray[np.float64]) -> float:
    """Return the RMS that is left without a moving average over 0.5 s, N, of a force
    at 1 kHz; spec of `contact_force_ac_N`."""
    window = np.full(500, 1 / 500)
    mean = np.convolve(force, window, "valid")
    return float(np.std(force[250 : 250 + len(mean)] - mean))
