# SPDX-License-Identifier: BSD-3-Clause
"""The bare engine: a scenario simulated without Drake.

The loop is the very same compiled code as in a Drake diagram; the plant is the
project's own arm (`SimulatedArm`), whose contacts are implicit, or a point mass
(`PointRobot`). Drake gives an arm its numbers and start; a point mass needs none
of it.
"""

from __future__ import annotations

from typing import Any

import pandas as pd

from dual_proxy import _core
from dual_proxy.log import make_frame
from dual_proxy.scenario import Scenario

__all__ = ["BareStation"]


class BareStation:
    """Simulates a scenario and logs it, as `Station` does.

    Parameters
    ----------
    scenario : what to simulate.
    duration : of the run, s; there is no room for more.
    rest : if given, the run is watched, that long before its end, s, to be at
        rest, and not logged.

    Raises
    ------
    ScenarioError
        If the scenario needs Drake.
    ValueError
        If no posture of the arm reaches the start.
    OSError
        If there is no space for the log.
    """

    def __init__(
        self, scenario: Scenario, duration: float, rest: float | None = None
    ) -> None:
        self._engine: Any
        if scenario.robot == "point_mass":
            self._engine = _core._make_point_mass_engine(scenario, duration, rest)
            return
        # pydrake is imported only where there is an arm.
        from dual_proxy.station import start_posture

        model, q_start = start_posture(scenario)
        self._engine = _core._make_arm_engine(
            scenario, model.arm_params, q_start, duration, rest
        )

    def advance_to(self, time: float) -> None:
        """Simulates up to `time`, s."""
        self._engine.advance_to(time)

    def log_frame(self) -> pd.DataFrame:
        """Returns the log so far; see `dual_proxy.log.SIGNALS`. Read-only."""
        store = self._engine.log
        rows = store.values
        layout = self._engine.layout
        return make_frame(
            store.time, {name: rows[:, where] for name, where in layout.items()}
        )

    def time_cycles(self, time: float) -> tuple[Any, int]:
        """Simulates up to `time`, s; returns how long each call of the loop took,
        (n,), s, and how many pages were first touched in them."""
        result: tuple[Any, int] = self._engine.time_cycles(time)
        return result

    def watched(self) -> list[tuple[Any, ...]]:
        """Returns what was watched so far; see `dual_proxy.watch`."""
        result: list[tuple[Any, ...]] = self._engine.watched()
        return result
