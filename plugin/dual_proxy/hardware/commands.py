# SPDX-License-Identifier: BSD-3-Clause
"""What `dual-proxy robot-side` and `dual-proxy haptic-side` make of their options."""

from __future__ import annotations

import argparse
import datetime
import os
import time
from pathlib import Path
from typing import Any

import numpy as np

from dual_proxy._core import (
    ForceTorqueAdapterParams,
    FrankaLoadParams,
    OmegaDevice,
    OmegaDeviceParams,
    RdtSensor,
    make_hardware_defaults,
)
from dual_proxy.hardware.arms import PandaArm, SimulatedPanda, make_franka_arm
from dual_proxy.hardware.devices import SimulatedHand
from dual_proxy.hardware.grippers import (
    FRANKA_MODULE,
    PANDA_MODULE,
    FrankaGripper,
    SimulatedGripper,
)
from dual_proxy.hardware.haptic_side import HapticSideProcess
from dual_proxy.hardware.options import OMEGA, REPLAY, SIMULATED
from dual_proxy.hardware.replayed import ReplayedHand, ReplayedSensor
from dual_proxy.hardware.robot_side import RobotSideProcess
from dual_proxy.hardware.sensors import make_rdt_sensor, rdt_host
from dual_proxy.link.agreement import describe_side
from dual_proxy.link.message_link import MessageLink
from dual_proxy.scenario import Scenario, ScenarioError
from dual_proxy.settings import parse_yaml

#: kg, of a tool.
_LEAST_TOOL, _MOST_TOOL = 1e-3, 3.0

__all__ = ["make_haptic_side", "make_robot_side"]


def make_robot_side(
    options: argparse.Namespace, scenario: Scenario
) -> RobotSideProcess:
    """Return what is to be run. Raises ScenarioError, LinkError, DriverError."""
    _check_scheme(scenario)
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
        # Its centre of mass in the flange's frame: S is there, along the same axes.
        com = adapter.tool_com if adapter else scenario.sensor.tool_com
        load = FrankaLoadParams(mass=tool_mass, com=com)
        arm = make_franka_arm(options.arm, load=load)
        original = isinstance(arm, PandaArm)
        gripper = FrankaGripper(
            arm.params.host, PANDA_MODULE if original else FRANKA_MODULE
        )
        if not options.yes:
            push_force = arm.params.push_force
        if own:
            # libfranka has taken the tool's weight out of its estimate.
            adapter = ForceTorqueAdapterParams(tare=True)
    sensor = None if own else _make_sensor(options.sensor)
    log = _log(options, "robot")
    return RobotSideProcess(
        scenario,
        arm,
        _make_link("robot", options, scenario),
        sensor=sensor,
        adapter=adapter,
        tool_mass=tool_mass,
        push_force=push_force,
        gripper=gripper if options.gripper == "own" else None,
        confirm=(lambda _: True) if options.yes else _ask,
        log=log,
    )


def make_haptic_side(
    options: argparse.Namespace, scenario: Scenario
) -> HapticSideProcess:
    """Return what is to be run. Raises ScenarioError, LinkError, DriverError."""
    _check_scheme(scenario)
    kind = options.device
    device: Any = None
    if kind.startswith(REPLAY):
        device = ReplayedHand(_replay_path("--device", kind))
    elif kind not in (OMEGA, SIMULATED):
        raise ScenarioError(
            f"--device: expected {OMEGA}, {SIMULATED} or {REPLAY}LOG, got {kind!r}"
        )
    if kind != OMEGA and (options.homing or options.sdk):
        raise ScenarioError(f"--homing, --sdk: expected with --device {OMEGA} only")
    log = _log(options, "haptic")
    link = _make_link("haptic", options, scenario)
    if kind == SIMULATED:
        device = SimulatedHand(scenario, lambda: link.follows(time.monotonic()))
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
        log=log,
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
        made_of=describe_side(scenario),
    )


def _log(options: argparse.Namespace, side: str) -> Path:
    """Where a run is logged; one that nobody gave a place shares it with no other."""
    if options.log is not None:
        if options.log.exists():
            raise ScenarioError(f"--log: {options.log}: File exists")
        return Path(options.log)
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
    if path.exists() and not path.is_file():
        raise ScenarioError(f"--tool: {path}: expected a file")
    try:
        fields = parse_yaml(path.read_text(encoding="utf-8"), str(path))
        if not isinstance(fields, dict):
            raise TypeError("expected `field: value` in each line")
        tool = ForceTorqueAdapterParams(**fields)
    except OSError as error:
        raise ScenarioError(f"--tool: {path}: {error.strerror}") from None
    except (TypeError, ValueError) as error:
        raise ScenarioError(f"--tool: {path}: {error}") from None
    if not _LEAST_TOOL <= tool.tool_mass <= _MOST_TOOL:
        raise ScenarioError(
            f"--tool: {path}: field `tool_mass` expected kg in [{_LEAST_TOOL:g}, "
            f"{_MOST_TOOL:g}], got {tool.tool_mass:g}"
        )
    if np.abs(tool.tool_com).max() > 1:
        raise ScenarioError(
            f"--tool: {path}: field `tool_com` expected m in [-1, 1], got "
            f"{tool.tool_com.tolist()}"
        )
    return tool


def _check_scheme(scenario: Scenario) -> None:
    """Raise ScenarioError where a real arm cannot have the scenario's scheme."""
    if _reclutches(scenario, scenario.scheme):
        return
    fit = [scheme for scheme in scenario.SCHEMES if _reclutches(scenario, scheme)]
    raise ScenarioError(
        f"scheme: expected one of {', '.join(fit)} on hardware, got "
        f"{scenario.scheme}, whose robot goes to where the hand is"
    )


def _reclutches(scenario: Scenario, scheme: str) -> bool:
    params = make_hardware_defaults(scenario.robot_side_params())
    params.scheme = scheme
    try:
        params.validate()
    except ValueError:
        return False
    return True


def _ask(question: str) -> bool:
    try:
        answer = input(f"{question} [yes/no] ").strip().lower()
    except EOFError:
        print()
        return False
    if answer not in ("yes", "no"):
        print("It starts with `yes` only.")
    return answer == "yes"
