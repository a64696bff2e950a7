# SPDX-License-Identifier: BSD-3-Clause
"""Faces of the link: the sender and the channel between the two sides."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

from pydrake.common.value import AbstractValue

from dual_proxy import _core
from dual_proxy.systems._face import (
    MESSAGES,
    Context,
    Face,
    Output,
    check_positive,
    matrix,
    message,
    pose,
    tag_of,
)

#: When the channel looks for a message, in periods after each multiple of its
#: interval: more than the half that the sender may be late, and between steps
#: for every rate in use.
_LOOK = 0.6


class PoseSender(Face):
    """Turns poses at the control rate into messages at the link's rate.

    @system
    name: PoseSender
    input_ports:
    - pose               # RigidTransform: X_DH of the device or X_BE of the robot
    - force_selection    # 9, row-major 3x3, in B (optional, zero)
    - moment_selection   # 9, row-major 3x3, in B (optional, zero)
    output_ports:
    - message            # PoseMessage
    @endsystem

    Steps every `params.period`; the message is that of the last step, empty
    (sequence -1) before the first.

    Parameters
    ----------
    params : PoseSenderParams.
    """

    def __init__(self, params: _core.PoseSenderParams | None = None) -> None:
        super().__init__(feedthrough=False)
        self._sender = _core.PoseSender(deepcopy(params or _core.PoseSenderParams()))
        self._native_arguments = {"params": self._sender.params}
        self._pose = self._declare_pose_input("pose")
        self._force_selection = self.DeclareVectorInputPort("force_selection", 9)
        self._moment_selection = self.DeclareVectorInputPort("moment_selection", 9)
        self._declare_memory(self._sender.make_state(), self._sender.params.period)
        self._declare_object_output(
            "message", _core.PoseMessage(), lambda state: state.message
        )

    def _step(self, context: Context, state: Any) -> None:
        self._sender.update(
            context.get_time(),
            *pose(self._pose, context),
            matrix(self._force_selection, context),
            matrix(self._moment_selection, context),
            state,
        )


class CommunicationChannel(Face):
    """A link with delay, jitter, loss and reordering, one way.

    @system
    name: CommunicationChannel
    input_ports:
    - message   # of the kind that it is made for
    output_ports:
    - message   # of the same kind: the newest that has arrived
    - counters  # 3, messages so far: lost on the way, pushed out of the full
                # channel, refused because not finite (only if `counted`)
    @endsystem

    A message that the sender makes in a step at t is there for the receiver's
    first step after t + delay: with the delay a multiple of the control period,
    always one step later, as if the delay were zero and the two sides were
    neighbours. For that the channel looks for a new message between two steps,
    0.6 periods after each multiple of 1/`rate`: the sender, which starts at
    time 0, has then taken its step nearest to it. What has arrived is a
    function of time, so the output needs no step in between. Before the first
    arrival it is the empty message (sequence -1).

    Parameters
    ----------
    params : CommunicationChannelParams, delay and its disturbances.
    seed : of jitter and loss.
    rate : Hz, > 0, how often the input is looked at: the sender's rate.
    period : s, > 0, of the two sides' steps.
    message : PoseMessage(), ForceMessage() or a Message, of the kind that is
        carried.
    counted : whether there is the port `counters`.
    """

    def __init__(
        self,
        params: _core.CommunicationChannelParams | None = None,
        seed: int = 0,
        rate: float = 50.0,
        period: float = 0.001,
        message: (_core.Message | _core.PoseMessage | _core.ForceMessage | None) = None,
        counted: bool = False,
    ) -> None:
        super().__init__(feedthrough=False)
        check_positive("CommunicationChannel", "rate", rate)
        check_positive("CommunicationChannel", "period", period)
        model = message if message is not None else _core.PoseMessage()
        if not isinstance(model, MESSAGES):
            raise TypeError(
                "CommunicationChannel: `message` expected PoseMessage(), "
                f"ForceMessage() or a Message, got {message!r}"
            )
        self._tag = tag_of(model)
        params = deepcopy(params or _core.CommunicationChannelParams())
        self._channel = _core.CommunicationChannel(params)
        self._native_arguments = {
            "params": params,
            "seed": seed,
            "rate": rate,
            "period": period,
            "tag": self._tag,
            "counted": counted,
        }
        self._message = self._declare_object_input("message", model)
        self._declare_memory(self._channel.make_state(seed), 1.0 / rate, _LOOK * period)
        self.DeclareAbstractOutputPort(
            "message",
            lambda: AbstractValue.Make(model),
            self._calc_message,
            {*self._prerequisites, self.time_ticket()},
        )
        if counted:
            self._declare_vector_output(
                "counters",
                3,
                lambda state: (state.lost, state.overflow, state.refused),
            )

    def _step(self, context: Context, state: Any) -> None:
        newest = message(self._message, context, self._tag)
        self._channel.send(context.get_time(), newest, state)

    def _calc_message(self, context: Context, output: Output) -> None:
        output.set_value(
            self._channel.receive(context.get_time(), self._result(context))
        )
