# SPDX-License-Identifier: BSD-3-Clause
"""A simulated hand that slides to and fro, and presses further when it is told."""

import numpy as np

from dual_proxy.hardware.devices import SimulatedHand

# m/s and m of the robot: how it presses, slides, and how far.
PRESSING = 0.03
SLIDING = 0.005
FARTHEST = 0.05


class PressingHand(SimulatedHand):
    """Moves along the scenario's path when it is told to press: all of it each time."""

    def __init__(self, scenario, *may_move):
        super().__init__(scenario, *may_move)
        self._path = _Path(scenario.handle_path(), scenario.map.scale)

    def press(self):
        self._path.goal += 1.0


class _Path:
    """As OperatorPath; times only grow."""

    def __init__(self, path, scale):
        self.calc_rotation, self.params = path.calc_rotation, path.params
        self._start = path.calc(0.0)[0]
        self._press = path.calc(1.0)[0] - self._start
        self._slide = np.array([1.0 / scale, 0, 0])
        self._rate = PRESSING / (scale * np.linalg.norm(self._press))
        self._time = self._depth = self._place = 0.0
        self._speed = SLIDING
        self.goal = 0.0

    def calc(self, time):
        step, self._time = time - self._time, time
        moves = float(step > 0)
        before = self._depth
        self._depth = min(self.goal, before + self._rate * step)
        pressing = self._rate if self._depth > before else 0.0
        self._place += self._speed * step
        if abs(self._place) > FARTHEST:
            self._speed = -np.copysign(SLIDING, self._place)
        return (
            self._start + self._depth * self._press + self._place * self._slide,
            moves * (pressing * self._press + self._speed * self._slide),
        )
