# SPDX-License-Identifier: BSD-3-Clause
"""What `dual-proxy robot-side` and `dual-proxy haptic-side` make of their options."""

from __future__ import annotations

import argparse
import datetime
import os
import time
from pathlib import Path
from typing import Any

from dual_proxy._core import (
    DriverError,
    ForceTorqueAdapterParams,
    FrankaLoadParams,
    FrankaRobotSideParams,
    LinkFrame,
    OmegaDevice,
    OmegaDeviceParams,
    RdtSensor,
)
from dual_proxy.hardware.arms import FrankaArm, PandaArm, SimulatedPanda
from dual_proxy.hardware.devices import SimulatedHand
from dual_proxy.hardware.grippers import (
    FRANKA_MODULE,
    PANDA_MODULE,
    FrankaGripper,
    SimulatedGripper,
)
from dual_proxy.hardware.haptic_side import HapticSideProcess
from dual_proxy.hardware.options import OMEGA, PANDA, REPLAY, SIMULATED
from dual_proxy.hardware.replayed import ReplayedHand, ReplayedSensor
from dual_proxy.hardware.robot_side import RobotSideProcess
from dual_proxy.hardware.sensors import make_rdt_sensor, rdt_host
from dual_proxy.link.message_link import MessageLink
from dual_proxy.scenario import Scenario, ScenarioError
from dual_proxy.settings import parse_yaml

__all__ = ["make_haptic_side", "make_robot_side"]


def make_robot_side(
    options: argparse.Namespace, scenario: Scenario
) -> RobotSideProcess:
    """Return what is to be run. Raises ScenarioError, LinkError, DriverError."""
    adapter = _read_tool(options.tool) if options.tool else None
    own = options.sensor == "own"
    tool_mass = adapter.tool_mass if adapter else scenario.scene.tool_mass
    arm: Any
    gripper: Any
    push_force = None
    if options.arm == SIMULATED:
        arm, gripper = SimulatedPanda(scenario), SimulatedGripper()
    elif options.sensor.startswith(REPLAY):
        raise ScenarioError(
            f"--sensor: expected {options.sensor} with --arm {SIMULATED} only: a real "
            "arm would not feel what it touches"
        )
    else:
        original = options.arm.startswith(PANDA)
        host = options.arm.removeprefix(PANDA)
        # Its centre of mass in the flange's frame: S is there, along the same axes.
        load = FrankaLoadParams(mass=tool_mass, com=scenario.sensor.tool_com)
        try:
            params = FrankaRobotSideParams(host=host, real_time=False, load=load)
        except ValueError as error:
            raise ScenarioError(f"--arm: {error}") from None
        arm = PandaArm(params) if original else FrankaArm(params)
        gripper = FrankaGripper(host, PANDA_MODULE if original else FRANKA_MODULE)
        if not options.yes:
            push_force = params.push_force
        if own:
            # libfranka has taken the tool's weight out of its estimate.
            adapter = ForceTorqueAdapterParams(tare=True)
    return RobotSideProcess(
        scenario,
        arm,
        _make_link("robot", options, scenario),
        sensor=None if own else _make_sensor(options.sensor),
        adapter=adapter,
        tool_mass=tool_mass,
        push_force=push_force,
        gripper=gripper if options.gripper == "own" else None,
        confirm=(lambda _: True) if options.yes else _ask,
        log=options.log or _log_path("robot"),
    )


def make_haptic_side(
    options: argparse.Namespace, scenario: Scenario
) -> HapticSideProcess:
    """Return what is to be run. Raises ScenarioError, LinkError, DriverError."""
    kind = options.device
    device: Any = None
    if kind.startswith(REPLAY):
        device = ReplayedHand(_replay_path("--device", kind))
    elif kind not in (OMEGA, SIMULATED):
        raise ScenarioError(
            f"--device: expected {OMEGA}, {SIMULATED} or {REPLAY}LOG, got {kind!r}"
        )
    link = _make_link("haptic", options, scenario)
    if kind == SIMULATED:

        def may_move() -> bool:
            return link.connected(time.monotonic()) and not (
                link.flags & LinkFrame.HOLDING
            )

        device = SimulatedHand(scenario, may_move)
    elif kind == OMEGA:
        device = OmegaDevice(
            OmegaDeviceParams(
                library=options.sdk,
                homing=options.homing,
                clutch="none" if options.button == "none" else "button",
            )
        )
    return HapticSideProcess(
        scenario,
        device,
        link,
        button_grips=options.button == "gripper",
        log=options.log or _log_path("haptic"),
    )


def _make_link(
    side: str, options: argparse.Namespace, scenario: Scenario
) -> MessageLink:
    return MessageLink(
        side,
        listen=options.listen,
        connect=options.connect,
        keys=options.keys,
        insecure=options.insecure,
        monitor=scenario.link.monitor,
    )


def _log_path(side: str) -> Path:
    """Where a run is logged that nobody gave a place: no two share one."""
    now = datetime.datetime.now()
    return Path(f"out/hardware/{now:%Y-%m-%d-%H%M%S}-{side}-{os.getpid()}.mcap")


def _replay_path(option: str, text: str) -> Path:
    path = text.removeprefix(REPLAY)
    if not path:
        raise ScenarioError(f"{option}: expected {REPLAY}LOG, got {text!r}")
    return Path(path)


def _make_sensor(text: str) -> RdtSensor | ReplayedSensor:
    if text.startswith(REPLAY):
        return ReplayedSensor(_replay_path("--sensor", text))
    return make_rdt_sensor(rdt_host(text, f"own, rdt:HOST[:PORT] or {REPLAY}LOG"))


def _read_tool(path: Path) -> ForceTorqueAdapterParams:
    try:
        fields = parse_yaml(path.read_text(encoding="utf-8"), str(path))
        return ForceTorqueAdapterParams(**fields)
    except OSError as error:
        raise DriverError(f"--tool: {path}: {error.strerror}") from None
    except (TypeError, ValueError) as error:
        raise ScenarioError(f"--tool: {path}: {error}") from None


def _ask(question: str) -> bool:
    try:
        answer = input(f"{question} [yes/no] ")
    except EOFError:
        return False
    return answer.strip().lower() == "yes"
