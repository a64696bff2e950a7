# SPDX-License-Identifier: BSD-3-Clause
"""Faces of the link: the sender and the channel between the two sides."""

from __future__ import annotations

from dual_proxy import _core
from dual_proxy.systems._face import Face


class PoseSender(Face):
    """Turns poses at the control rate into messages at the link's rate.

    @ports

    Steps every `params.period`; the message is that of the last step, empty
    (sequence -1) before the first.

    Parameters
    ----------
    params : PoseSenderParams.
    """

    def __init__(self, params: _core.PoseSenderParams | None = None) -> None:
        super().__init__(
            _core._make_PoseSender(
                _core.PoseSenderParams() if params is None else params
            )
        )


class CommunicationChannel(Face):
    """A link with delay, jitter, loss and reordering, one way.

    @ports

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
    rate : Hz, in (0, 1/period], how often the input is looked at: the sender's rate.
    period : s, in (0, 1e11], of the two sides' steps.
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
        kind = _core.PoseMessage() if message is None else message
        if isinstance(kind, _core.Message):
            tag = kind.tag
        elif isinstance(kind, _core.PoseMessage | _core.ForceMessage):
            tag = kind.TAG
        else:
            raise TypeError(
                "CommunicationChannel: `message` expected PoseMessage(), "
                f"ForceMessage() or a Message, got {message!r}"
            )
        params = _core.CommunicationChannelParams() if params is None else params
        super().__init__(
            _core._make_CommunicationChannel(params, seed, rate, period, counted, tag)
        )
