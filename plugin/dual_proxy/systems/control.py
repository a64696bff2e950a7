# SPDX-License-Identifier: BSD-3-Clause
"""Faces of the local controllers, and the arm's kinematics that they need."""

from __future__ import annotations

from dual_proxy import _core
from dual_proxy.panda import PandaModel
from dual_proxy.systems._face import Face, arm_of


class ArmKinematics(Face):
    """Pose and twist of the tool point from the arm's state; no memory.

    @ports

    In the base frame B.

    Parameters
    ----------
    model : PandaModel, the arm; by default with the project's own tool.
    """

    def __init__(self, model: PandaModel | None = None) -> None:
        super().__init__(
            _core._make_ArmKinematics(arm_of(PandaModel() if model is None else model))
        )


class OperationalSpaceController(Face):
    """Unified force/motion control of the arm, eq. (10) to (17).

    @ports

    In the base frame B. All inputs but `robot_state` are zero if they are not
    connected. Steps every `params.period`, with feedthrough.

    Parameters
    ----------
    params : OperationalSpaceControllerParams.
    model : PandaModel, the arm; by default with the project's own tool.
    """

    def __init__(
        self,
        params: _core.OperationalSpaceControllerParams | None = None,
        model: PandaModel | None = None,
    ) -> None:
        super().__init__(
            _core._make_OperationalSpaceController(
                _core.OperationalSpaceControllerParams() if params is None else params,
                arm_of(PandaModel() if model is None else model),
            )
        )


class HapticController(Face):
    """The device's controller: eq. (18), a force loop, or a hold on the proxy.

    @ports

    In the device's frame D; inputs that are not connected are zero. Steps every
    `params.period`, with feedthrough.

    Parameters
    ----------
    params : HapticControllerParams; its `method` decides which inputs count.
    """

    def __init__(self, params: _core.HapticControllerParams | None = None) -> None:
        super().__init__(
            _core._make_HapticController(
                _core.HapticControllerParams() if params is None else params
            )
        )
