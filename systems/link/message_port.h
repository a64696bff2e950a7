// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <drake/systems/framework/context.h>
#include <drake/systems/framework/input_port.h>

#include "dual_proxy/link/message.h"

namespace dual_proxy {

/** The message at a port, the empty one if it is not connected.
@param tag  of the only kind that is expected there.
@throws std::logic_error naming system, port and both kinds, if the message is
of another: the diagram is wired wrong. */
const Message& EvalMessage(const drake::systems::InputPort<double>& port,
                           const drake::systems::Context<double>& context,
                           MessageTag tag);

}  // namespace dual_proxy
