# SPDX-License-Identifier: BSD-3-Clause
"""Arms as the robot side's process has them: real ones and a simulated one.

FrankaArm and SimulatedPanda are asked for a reading and given a torque, period by
period; PandaArm asks by itself. `Arm.run` is the same with all.

All are told torques without the arm's weight, once a period, and stop by themselves
with an `ArmFault` when something is wrong.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from dual_proxy._core import (
    DriverError,
    ExternalWrenchSensor,
    FrankaLoadParams,
    FrankaRobotSideParams,
    SimulatedArm,
)
from dual_proxy.hardware.options import PANDA
from dual_proxy.panda import PandaModel, p_SE_S
from dual_proxy.scenario import Scenario, ScenarioError
from dual_proxy.text import one_line

__all__ = [
    "Arm",
    "ArmFault",
    "ArmReading",
    "Cycles",
    "FrankaArm",
    "PandaArm",
    "PolledArm",
    "SimulatedPanda",
    "Wrench",
    "make_franka_arm",
]

Vector = NDArray[np.float64]
Result = TypeVar("Result")

_NO_WRENCH = np.zeros(6)
#: Hz: libfranka 0.9 filters no torque with it.
_NO_FILTER = 1000.0


class ArmFault(RuntimeError):
    """The arm has stopped by itself, or was not to be reached: in one line, why."""


@dataclass(frozen=True)
class Wrench:
    """What a force/torque sensor measured, as RdtSensor's readings.

    Attributes
    ----------
    time : s, time.monotonic(), at which it was measured.
    valid : whether the sensor is there and reports no fault.
    value : (6,) [force; moment about the sensor's origin], N, N m, in the sensor's
        frame S: of the arm on the tool.
    """

    time: float = -math.inf
    valid: bool = False
    value: Vector = field(default_factory=lambda: _NO_WRENCH)


@dataclass(frozen=True)
class ArmReading:
    """What an arm says of itself in a period.

    Attributes
    ----------
    q, v : (7,), rad, rad/s.
    received_torque : (7,), N m, the one that it got last, without its weight.
    """

    q: Vector
    v: Vector
    received_torque: Vector


#: What is done in a period: it is sent a reading and yields the torque, (7,), N m, and
#: whether the arm is at rest and not to be controlled any more; then it does what has
#: time, and yields None. What it returns in the end `Arm.run` does.
Cycles = Generator[tuple[Vector, bool] | None, ArmReading, bool]


class Arm(Protocol):
    """What the robot side's loop needs of an arm."""

    def open(self) -> None:
        """Connect, and see that it can be moved; move nothing. Raises DriverError."""

    def look(self) -> ArmReading:
        """Return what it says while it is not controlled. Raises ArmFault."""

    def run(self, cycles: Cycles) -> bool:
        """Begin to take torques, and go through a cycle each period. Raises
        ArmFault."""

    def wrench(self) -> Any:
        """Return what its own sensor, or its estimate, says: a Wrench."""

    def recover(self) -> None:
        """Make it ready for `run` after an ArmFault. Raises ArmFault."""

    def close(self) -> None:
        """Let go of it; may be called at any time."""


class PolledArm(Arm, Protocol):
    """One that is asked for its readings."""

    def start(self) -> None:
        """Begin to take torques. Raises ArmFault."""

    def read(self) -> ArmReading:
        """Return the next period's reading, when it has begun. Raises ArmFault."""

    def write(self, torque: Vector, last: bool = False) -> None:
        """Send the torque, (7,), N m, of this period; with `last` the arm is at rest
        and is not controlled from then on. Raises ArmFault."""


def _poll(arm: PolledArm, cycles: Cycles) -> bool:
    arm.start()
    next(cycles)
    while True:
        torque, last = _send(cycles, arm.read())
        arm.write(torque, last)
        try:
            next(cycles)
        except StopIteration as end:
            return bool(end.value)


def _send(cycles: Cycles, reading: ArmReading) -> tuple[Vector, bool]:
    command = cycles.send(reading)
    assert command is not None
    return command


class _LibfrankaArm:
    """What libfranka's bindings have in common.

    `wrench` is libfranka's estimate of the external wrench, as ExternalWrenchSensor
    has it: for an adapter without a tool.

    Parameters
    ----------
    params : FrankaRobotSideParams, of which host, real_time, load and collision count.
    observe : only `look`, also while a person guides it: nothing is set, and any mode
        will do.
    """

    _franka: Any
    _error: type[Exception] = RuntimeError
    _idle: Any

    def __init__(self, params: FrankaRobotSideParams, observe: bool = False) -> None:
        self.params = params
        self._observe = observe
        # Of whose numbers only where E is counts.
        self._sensor = ExternalWrenchSensor(PandaModel(1e-3).arm_params, p_SE_S)
        self._robot: Any = None
        self._control: Any = None
        self._state: Any = None

    def _load(self) -> None:
        """Set the module, its exceptions' base, and the mode Idle."""
        raise NotImplementedError

    def open(self) -> None:
        """See Arm."""
        self._load()
        franka = self._franka
        config, params = franka.RealtimeConfig, self.params
        load, collision = params.load, params.collision
        try:
            self._robot = franka.Robot(
                params.host, config.kEnforce if params.real_time else config.kIgnore
            )
            if not self._observe:
                self._robot.set_collision_behavior(
                    collision.contact_torque.tolist(),
                    collision.collision_torque.tolist(),
                    collision.contact_force.tolist(),
                    collision.collision_force.tolist(),
                )
                self._robot.set_load(
                    load.mass, load.com.tolist(), load.inertia.ravel().tolist()
                )
            self._state = self._robot.read_once()
        except (RuntimeError, self._error) as error:
            self.close()
            raise DriverError(f"arm at {params.host}: {one_line(error, 300)}") from None
        mode = self._state.robot_mode
        if mode != self._idle and not self._observe:
            self.close()
            raise DriverError(
                f"arm at {params.host}: expected mode Idle, got {mode.name}"
                f"{self._errors()}: release the user stop, unlock the joints, "
                "activate FCI in Desk"
            )

    def look(self) -> ArmReading:
        """See Arm."""
        return self._guard(lambda: self._take(self._robot.read_once()))

    def wrench(self) -> Any:
        """See Arm."""
        return self._sensor.read()

    def recover(self) -> None:
        """See Arm."""
        self._control = None
        self._guard(lambda: self._robot.automatic_error_recovery())

    def close(self) -> None:
        """See Arm."""
        control, self._control = self._control, None
        robot, self._robot = self._robot, None
        if robot is not None and control is not None:
            try:
                robot.stop()
            except Exception:  # It has stopped by itself, or is not there.
                return

    def _take(self, state: Any) -> ArmReading:
        self._state = state
        self._sensor.take(
            time.monotonic(), state.K_F_ext_hat_K, state.F_T_EE, state.EE_T_K
        )
        return ArmReading(
            np.array(state.q), np.array(state.dq), np.array(state.tau_J_d)
        )

    def _guard(self, call: Callable[[], Result]) -> Result:
        if self._robot is None:
            raise ArmFault(f"arm at {self.params.host}: it is not open")
        try:
            return call()
        except (RuntimeError, ValueError, self._error) as error:
            raise ArmFault(one_line(error, 300)) from None

    def _errors(self) -> str:
        text = str(self._state.current_errors).strip("[] ")
        return f" ({text})" if text else ""

    def _command(self, torque: Vector, last: bool) -> Any:
        if self._robot is None:
            raise ArmFault(f"arm at {self.params.host}: it is not open")
        if not np.isfinite(torque).all():
            raise ArmFault("a torque that is not finite")
        command = self._franka.Torques(torque.tolist())
        command.motion_finished = last
        return command


class FrankaArm(_LibfrankaArm):
    """An FR3, by pylibfranka; the original Panda speaks to libfranka before 0.10 only.

    Parameters and `wrench`: see _LibfrankaArm.
    """

    def _load(self) -> None:
        try:
            import pylibfranka as franka
        except ImportError as error:
            raise DriverError(
                "an FR3 needs pylibfranka (pip install 'drake-dual-proxy[hardware]'): "
                f"{one_line(error, 200)}"
            ) from None
        self._franka = franka
        self._error = franka.FrankaException
        self._idle = franka.RobotMode.Idle

    def run(self, cycles: Cycles) -> bool:
        """See Arm."""
        return _poll(self, cycles)

    def start(self) -> None:
        """See PolledArm."""

        def begin() -> None:
            self._control = self._robot.start_torque_control()

        self._guard(begin)

    def read(self) -> ArmReading:
        """See PolledArm."""
        return self._guard(lambda: self._take(self._control.readOnce()[0]))

    def write(self, torque: Vector, last: bool = False) -> None:
        """See PolledArm."""
        command = self._command(torque, last)
        self._guard(lambda: self._control.writeOnce(command))
        if last:
            self._control = None


class PandaArm(_LibfrankaArm):
    """The original Panda, by panda-python, which has libfranka 0.9 in it.

    There libfranka calls for each torque. So one that does not come in time makes the
    arm stop, as with FrankaArm: panda-python's own controllers would go on with the
    last. Never tried against an arm.

    Parameters and `wrench`: see _LibfrankaArm.
    """

    def _load(self) -> None:
        try:
            from panda_py import libfranka
        except ImportError as error:
            raise DriverError(
                "an original Panda needs panda-python (pip install panda-python): "
                f"{one_line(error, 200)}"
            ) from None

        self._franka = libfranka
        self._error = RuntimeError  # All of libfranka's come as that.
        self._idle = libfranka.RobotMode.kIdle

    def run(self, cycles: Cycles) -> bool:
        """See Arm."""
        ended = False
        own: list[BaseException] = []

        def step(state: Any, _: Any) -> Any:
            nonlocal ended
            try:
                command = self._command(*_send(cycles, self._take(state)))
                try:
                    next(cycles)
                except StopIteration as end:
                    ended = bool(end.value)
            except BaseException as error:
                own.append(error)
                raise  # libfranka ends the motion.
            return command

        next(cycles)
        try:
            self._guard(lambda: self._robot.control(step, False, _NO_FILTER))
        except ArmFault:
            if own:  # Not the arm's.
                raise own[0] from None
            raise
        return ended


def make_franka_arm(
    text: str, observe: bool = False, load: FrankaLoadParams | None = None
) -> FrankaArm | PandaArm:
    """Return the arm that `--arm` names: HOST, an FR3, or panda:HOST, an original
    Panda, with a load. Raises ScenarioError."""
    host = text.removeprefix(PANDA)
    try:
        params = FrankaRobotSideParams(
            host=host, real_time=False, load=load or FrankaLoadParams()
        )
    except ValueError as error:
        raise ScenarioError(f"--arm: {error}") from None
    return (FrankaArm if host == text else PandaArm)(params, observe)


class SimulatedPanda:
    """The bare engine's arm in its scene, in real time, which behaves as a real one
    does: it carries its weight, and a torque that is not finite, changes too fast, or
    comes too late makes it stop.

    Parameters
    ----------
    scenario : arm, tool, surfaces and where the tool starts.
    delay : periods from a torque's being sent to its acting, 0 to 6.
    patience : s, for how long it waits for a torque; a real arm stops after 20 ms.
    """

    #: N m/s, at which a torque may change.
    _MAX_RATE = 1000.0
    #: Periods.
    _MOST_MISSED = 20

    def __init__(
        self, scenario: Scenario, delay: int = 0, patience: float = 0.03
    ) -> None:
        from dual_proxy.station import start_posture

        self._model, q_start = start_posture(scenario)
        self._plant = SimulatedArm(
            scenario.simulated_arm_params(),
            self._model.arm_params,
            scenario.contact_scene_params(),
        )
        self._state = self._plant.make_state(q_start)
        self._period = float(scenario.control_period)
        self._sent = [np.zeros(7)] * (delay + 1)
        self._patience = patience
        self._due = -math.inf
        self._read_at = -math.inf
        self._fault = "not started"

    def open(self) -> None:
        """See Arm."""
        return

    def look(self) -> ArmReading:
        """See Arm."""
        return self._reading()

    def run(self, cycles: Cycles) -> bool:
        """See Arm."""
        return _poll(self, cycles)

    def start(self) -> None:
        """See PolledArm."""
        self._sent = [np.zeros(7)] * len(self._sent)
        self._due = time.monotonic()
        self._fault = ""

    def read(self) -> ArmReading:
        """See PolledArm."""
        self._due += self._period
        now = time.monotonic()
        if now < self._due:
            time.sleep(self._due - now)
        late = time.monotonic() - self._due
        if late > self._patience:
            self._stop(f"no torque for {1e3 * late:.0f} ms")
        # What was missed meanwhile goes by with the last torque: as long as a real arm
        # goes on. From then on the world waits for a process that was held up.
        missed = int(late / self._period)
        for _ in range(min(missed, self._MOST_MISSED)):
            self._advance()
        self._due += missed * self._period
        return self._reading()

    def write(self, torque: Vector, last: bool = False) -> None:
        """See PolledArm."""
        if self._fault:
            raise ArmFault(self._fault)
        if not np.isfinite(torque).all():
            self._stop("a torque that is not finite")
        change = np.abs(torque - self._sent[0]).max()
        if change > 1.001 * self._MAX_RATE * self._period:
            self._stop(
                f"a torque changed by {change:.3g} N m in a period, "
                f"{self._MAX_RATE * self._period:.3g} are allowed"
            )
        self._sent = [torque, *self._sent[:-1]]
        self._advance()
        if last:
            self._fault = "not started"

    def wrench(self) -> Wrench:
        """See Arm."""
        return Wrench(self._read_at, True, np.array(self._state.reaction))

    def recover(self) -> None:
        """See Arm."""
        # It has come to rest by its brakes.
        self._state = self._plant.make_state(self._state.q)

    def close(self) -> None:
        """See Arm."""
        self._fault = "not started"

    @property
    def state(self) -> Any:
        """The plant's SimulatedArmState: the truth."""
        return self._state

    def _reading(self) -> ArmReading:
        self._read_at = time.monotonic()
        return ArmReading(
            np.array(self._state.q), np.array(self._state.v), self._sent[0]
        )

    def _advance(self) -> None:
        gravity = self._model.calc(self._state.q, self._state.v).gravity
        self._plant.update(self._sent[-1] - gravity, self._state)

    def _stop(self, why: str) -> None:
        self._fault = why
        raise ArmFault(why)
