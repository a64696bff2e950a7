// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "dual_proxy/link/message.h"
#include "params.h"

namespace dual_proxy {

/** A message for Python: a PoseMessage or a ForceMessage if it is one, else a
Message. A copy. */
inline py::object MessageToPython(const Message& message) {
  if (message.tag == PoseMessage::kTag) {
    return py::cast(FromMessage<PoseMessage>(message));
  }
  if (message.tag == ForceMessage::kTag) {
    return py::cast(FromMessage<ForceMessage>(message));
  }
  return py::cast(message);
}

inline bool IsMessage(const py::handle& value) {
  return py::isinstance<PoseMessage>(value) ||
         py::isinstance<ForceMessage>(value) || py::isinstance<Message>(value);
}

/** The message that MessageToPython() made.
@throws TypeError if `value` is none. */
inline Message MessageFromPython(const py::handle& value) {
  if (py::isinstance<PoseMessage>(value)) {
    return ToMessage(value.cast<PoseMessage>());
  }
  if (py::isinstance<ForceMessage>(value)) {
    return ToMessage(value.cast<ForceMessage>());
  }
  if (py::isinstance<Message>(value)) return value.cast<Message>();
  ThrowExpected<py::type_error>("", "message", "a Message", value);
}

/** The PoseMessage that it is, or that a Message holds; one that holds nothing
is not valid.
@throws TypeError if it is another. */
inline PoseMessage PoseMessageFromPython(const py::handle& value) {
  const Message message = MessageFromPython(value);
  if (message.tag != PoseMessage::kTag && message.tag != Message().tag) {
    ThrowExpected<py::type_error>("", "message", "a PoseMessage", value);
  }
  return FromMessage<PoseMessage>(message);
}

}  // namespace dual_proxy
