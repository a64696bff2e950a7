# SPDX-License-Identifier: BSD-3-Clause
"""Everything but the robot as one system: the fast way to run a scenario."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from dual_proxy import _core
from dual_proxy.panda import PandaModel
from dual_proxy.systems._face import Face, arm_of


class TeleopLoop(Face):
    """Both sides, the link, the simulated sensor, device and operator.

    @ports

    In the base frame B unless said. Steps every control period; the outputs are
    those of the last step. Before the first the torque holds the arm at
    `q_start`. The same bits as RobotSide, HapticSide and two
    CommunicationChannels, in a fraction of the time: a call from Drake into
    Python costs more than the algorithms.

    Parameters
    ----------
    scenario : Scenario, what to run; not changed.
    model : PandaModel, the arm with the scenario's tool.
    sensor_joint : `PandaScene.sensor_joint`.
    q_start : (7,) rad, where the arm will be when the run starts.
    """

    _often_read = ("signals", "torque")

    def __init__(
        self,
        scenario: Any,
        model: PandaModel,
        sensor_joint: int,
        q_start: ArrayLike | None = None,
    ) -> None:
        super().__init__(
            _core._make_TeleopLoop(scenario, arm_of(model), sensor_joint, q_start)
        )
