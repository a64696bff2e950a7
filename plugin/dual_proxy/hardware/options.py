# SPDX-License-Identifier: BSD-3-Clause
"""What `dual-proxy robot-side` and `dual-proxy haptic-side` are told."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

__all__ = [
    "OMEGA",
    "PANDA",
    "REPLAY",
    "SIMULATED",
    "add_haptic_side",
    "add_record_poses",
    "add_robot_side",
]

OMEGA = "omega"
SIMULATED = "simulated"
#: Before the path of a log.
REPLAY = "replay:"
#: Before the host of an original Panda.
PANDA = "panda:"


def add_robot_side(command: argparse.ArgumentParser) -> None:
    """Add the options of `robot-side` to those of a scenario."""
    _add_link(command)
    add = command.add_argument
    add(
        "--arm",
        required=True,
        metavar="HOST",
        help="an FR3's name or address, for pylibfranka; panda:HOST, an original "
        "Panda's, for panda-python; or simulated",
    )
    add(
        "--sensor",
        default="own",
        metavar="SENSOR",
        help="own: the arm's own, or its estimate (default); rdt:HOST[:PORT]: a "
        "sensor that speaks RDT, as ATI's Net F/T, with its web page at PORT (80); "
        "replay:LOG: of a robot-side's log, for a "
        "simulated arm",
    )
    add(
        "--tool",
        type=Path,
        metavar="YAML",
        help="of dual-proxy calibrate-tool: fields of ForceTorqueAdapterParams",
    )
    add(
        "--gripper",
        choices=("none", "own"),
        default="none",
        help="own: the arm's own follows that of the device, or its button (default: "
        "none)",
    )
    add(
        "--yes",
        action="store_true",
        help="start without asking and without a push; for tests: nobody has looked",
    )


def add_haptic_side(command: argparse.ArgumentParser) -> None:
    """Add the options of `haptic-side` to those of a scenario."""
    _add_link(command)
    add = command.add_argument
    add(
        "--device",
        required=True,
        metavar="DEVICE",
        help="omega: what Force Dimension's SDK knows; simulated: the scenario's "
        "operator; replay:LOG: the hand of a haptic-side's log",
    )
    add(
        "--sdk",
        default="",
        metavar="PATH",
        help="of the SDK's folder or library (default: FDSDK, or where it is usual)",
    )
    add(
        "--button",
        choices=("clutch", "gripper", "none"),
        default="clutch",
        help="what the device's button is, which on one with a gripper is the gripper "
        "closed: the clutch (default), or what closes the robot's gripper; none: the "
        "robot's gripper follows the device's all the way",
    )
    add(
        "--homing",
        action="store_true",
        help="let a device that is not homed home itself: the handle moves",
    )


def add_record_poses(command: argparse.ArgumentParser) -> None:
    """Add the options of `record-poses`."""
    add = command.add_argument
    add(
        "--arm",
        required=True,
        metavar="HOST",
        help="an FR3's name or address, for pylibfranka (panda:HOST: an original "
        "Panda's, for panda-python), guided by hand; or simulated, hand and all",
    )
    add(
        "--sensor",
        required=True,
        metavar="SENSOR",
        help="rdt:HOST[:PORT]: a sensor that speaks RDT, as ATI's Net F/T; own: of the "
        "simulated arm",
    )
    add("--out", type=Path, required=True, metavar="CSV", help="new file of samples")
    add(
        "--poses",
        type=int,
        metavar="N",
        help="after which it ends (default: by Ctrl-C; six or more)",
    )


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not 0 < seconds < math.inf:
        raise argparse.ArgumentTypeError(f"expected seconds > 0, got {text!r}")
    return seconds


def _add_link(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    where = command.add_mutually_exclusive_group(required=True)
    where.add_argument(
        "--listen", metavar="HOST:PORT", help="wait here for the other side"
    )
    where.add_argument(
        "--connect", metavar="HOST:PORT", help="where the other side listens"
    )
    trust = command.add_mutually_exclusive_group(required=True)
    trust.add_argument(
        "--keys",
        type=Path,
        metavar="DIR",
        help="this side's folder of dual-proxy keys: both sides prove who they are",
    )
    trust.add_argument(
        "--insecure",
        action="store_true",
        help="no keys; on this machine alone, for tests",
    )
    add("--duration", type=_seconds, metavar="SEC", help="end after that time")
    add(
        "--log",
        type=Path,
        metavar="MCAP",
        help="new file of all that comes in and goes out (default: a new one in "
        "out/hardware)",
    )
