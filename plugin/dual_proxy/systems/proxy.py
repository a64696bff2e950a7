# SPDX-License-Identifier: BSD-3-Clause
"""Faces of the dual proxy: its robot side and its haptic side."""

from __future__ import annotations

from dual_proxy import _core
from dual_proxy.systems._face import Face

#: Elements of every `link_status` port: status (0 waiting, 1 connected, 2
#: lost), age of the message in use (s), messages received, dropped (stale or
#: out of order), sequence numbers skipped, latency spikes, times lost.
LINK_STATUS_FIELDS = (
    "status",
    "age",
    "received",
    "dropped",
    "gaps",
    "spikes",
    "losses",
)


class RobotSideProxy(Face):
    """Turns the device's poses into motion errors and reference forces, eq. (4).

    @ports

    In the base frame B unless said. Steps every `params.period`, with
    feedthrough. The elements of `link_status` are `LINK_STATUS_FIELDS`.

    Parameters
    ----------
    params : RobotSideProxyParams.
    """

    def __init__(self, params: _core.RobotSideProxyParams | None = None) -> None:
        super().__init__(
            _core._make_RobotSideProxy(
                _core.RobotSideProxyParams() if params is None else params
            )
        )


class HapticSideProxy(Face):
    """Turns the robot's poses and selections into the force on the hand, eq. (5).

    @ports

    In the device's frame D unless said. Steps every `params.period`, with
    feedthrough. The elements of `link_status` are `LINK_STATUS_FIELDS`.

    Parameters
    ----------
    params : HapticSideProxyParams.
    """

    def __init__(self, params: _core.HapticSideProxyParams | None = None) -> None:
        super().__init__(
            _core._make_HapticSideProxy(
                _core.HapticSideProxyParams() if params is None else params
            )
        )
