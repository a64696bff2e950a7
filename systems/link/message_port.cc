// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/link/message_port.h"

#include <stdexcept>

#include <drake/systems/framework/system.h>

namespace dual_proxy {

const Message& EvalMessage(const drake::systems::InputPort<double>& port,
                           const drake::systems::Context<double>& context,
                           MessageTag tag) {
  static const Message empty;
  if (!port.HasValue(context)) return empty;
  const Message& message = port.Eval<Message>(context);
  if (message.sequence != -1 && message.tag != tag) {
    throw std::logic_error(
        port.get_system().GetSystemName() + ": input port `" + port.get_name() +
        "` expected " + DescribeTag(tag) + ", got " + DescribeTag(message.tag));
  }
  return message;
}

}  // namespace dual_proxy
