# SPDX-License-Identifier: BSD-3-Clause
"""A side's log played back through the same side."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dual_proxy._core import DriverError, ForceTorqueAdapterParams, PoseMessage
from dual_proxy.hardware.haptic_side import (
    HAPTIC_COLUMNS,
    handle_of,
    make_side,
    update_side,
)
from dual_proxy.hardware.robot_side import (
    ROBOT_COLUMNS,
    make_cycle,
    make_seeds,
    wrench_of,
)
from dual_proxy.hardware.side_log import LoggedCycle, message_digest, read_side_log
from dual_proxy.panda import PandaModel
from dual_proxy.scenario import Scenario
from dual_proxy.settings import parse_yaml
from dual_proxy.text import one_line

__all__ = ["Replayed", "replay_side"]

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Replayed:
    """What became of a log that was played back.

    Attributes
    ----------
    side : "robot" or "haptic", whose log it is.
    cycles : played.
    different : of them, those in which the torque (on the haptic side the wrench) or
        the message is not what was logged, bit for bit.
    largest : N m (N, N m), the largest difference of torques or wrenches.
    seconds : from the first to the last.
    """

    side: str
    cycles: int
    different: int
    largest: float
    seconds: float


def replay_side(path: Path) -> Replayed:
    """Play the log of a robot or haptic side back through the same side.

    Raises
    ------
    DriverError
        If the file cannot be read, or is another log.
    """
    try:
        replayed = _replay(path)
    except (KeyError, TypeError, ValueError, struct.error) as error:
        raise DriverError(f"{path}: it is damaged: {one_line(error, 200)}") from None
    if replayed.cycles == 0:
        raise DriverError(f"{path}: expected cycles to play back, got none")
    return replayed


def _replay(path: Path) -> Replayed:
    columns = {"robot": ROBOT_COLUMNS, "haptic": HAPTIC_COLUMNS}
    config, cycles = read_side_log(path, columns)
    text = parse_yaml(config["scenario"], str(path))
    (name,) = text
    scenario = Scenario.from_mapping(name, text[name])
    side = config["side"]
    room: _Robot | _Haptic = (
        _Robot(scenario, config, path) if side == "robot" else _Haptic(scenario)
    )
    message: Any = PoseMessage()
    count = different = 0
    largest = 0.0
    first = last = 0.0
    for logged in cycles:
        last = float(logged.values[0])
        if count == 0:
            first = last
        if logged.message is not None:
            message = logged.message
        command = room.update(last, message, logged)
        # The last columns of either side: what it commanded, and what it sent.
        expected = logged.values[-1 - len(command) :]
        result = np.append(command, message_digest(room.state.message))
        count += 1
        if result.tobytes() != expected.tobytes():
            different += 1
            most = float(np.abs(command - expected[:-1]).max())
            largest = max(largest, most)
    return Replayed(side, count, different, largest, last - first)


class _Robot:
    def __init__(self, scenario: Scenario, config: dict[str, str], path: Path) -> None:
        adapter = ForceTorqueAdapterParams(**parse_yaml(config["adapter"], str(path)))
        model = PandaModel(float(config["tool_mass"]), scenario.scene.gravity)
        self._cycle = make_cycle(scenario, adapter, model)
        self._seeds = make_seeds(scenario)
        self.state = self._cycle.make_state(*self._seeds)

    def update(self, now: float, message: Any, logged: LoggedCycle) -> Vector:
        """Return the torque of the period."""
        values, state = logged.values, self.state
        wrench = wrench_of(values)
        if "recovered" in logged.kinds:
            self._cycle.restart(state, *self._seeds)
        self._cycle.update(
            now,
            values[1:8],
            values[8:15],
            message,
            state,
            sensor_time=wrench.time,
            sensor_valid=wrench.valid,
            measured=wrench.value,
            received_torque=values[15:22],
            hold=bool(values[24]),
            distrust_sensor=bool(values[25]),
        )
        return np.asarray(state.torque)


class _Haptic:
    def __init__(self, scenario: Scenario) -> None:
        self._side = make_side(scenario)
        self.state = self._side.make_state()

    def update(self, now: float, message: Any, logged: LoggedCycle) -> Vector:
        """Return the wrench of the period."""
        good, engaged = map(bool, logged.values[3:5])
        wrench = update_side(
            self._side,
            now,
            message,
            handle_of(logged.values),
            self.state,
            good=good,
            engaged=engaged,
        )
        return np.asarray(wrench)
