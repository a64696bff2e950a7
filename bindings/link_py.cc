// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <string>

#include <pybind11/native_enum.h>

#include "dual_proxy/link/communication_channel.h"
#include "dual_proxy/link/link_monitor.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/link/pose_sender.h"
#include "messages.h"
#include "params.h"

namespace dual_proxy {
namespace {

// A read-only copy: writing to an element of a message's array is an error and
// not silently lost.
template <typename Matrix>
py::array_t<double> AsReadOnlyArray(const Matrix& value) {
  return ReadOnly(py::array_t<double>(py::cast(value)));
}

// A property of a message or pose that holds an array.
template <typename T, typename Class>
void DefArray(BoundClass<Class>* cls, const char* name, T Class::* member,
              const char* doc) {
  cls->def_property(
      name,
      [member](const Class& self) { return AsReadOnlyArray(self.*member); },
      [name, member](Class& self, const py::object& value) {
        self.*member = AsFixed<T>(value, name);
      },
      doc);
}

constexpr const char* kGripperOpeningDoc =
    "m, of the device's gripper, on the way to the robot; NaN: none.";

void BindMessages(py::module_& m) {
  auto pose = BindState<Pose>(m, "Pose",
                              "A pose: X_BE of the tool point in the robot "
                              "base frame, or X_DH of the handle in the "
                              "device base frame.");
  DefArray(&pose, "p", &Pose::p, "Position, (3,), m.");
  DefArray(&pose, "R", &Pose::R, "Rotation matrix, (3, 3).");
  pose.def_factory(
          [](const py::object& p, const py::object& R) {
            return Pose{Vec3(p, "p"), Mat3(R, "R")};
          },
          py::arg("p") = AsReadOnlyArray(Pose{}.p),
          py::arg("R") = AsReadOnlyArray(Pose{}.R))
      .def("__repr__",
           [](const py::object& self) {
             return "Pose(p=" +
                    py::repr(self.attr("p").attr("tolist")())
                        .cast<std::string>() +
                    ", R=" +
                    py::repr(self.attr("R").attr("tolist")())
                        .cast<std::string>() +
                    ")";
           })
      .def_pickle(
          [](const Pose& self) { return py::make_tuple(self.p, self.R); },
          [](const py::tuple& values) {
            return Pose{Vec3(values[0], "p"), Mat3(values[1], "R")};
          });

  auto any = BindState<Message>(
      m, "Message",
      "What travels over the link, whatever the scheme: a header and up to 40 "
      "numbers, whose\nmeaning the tag tells.");
  any.def_constructor<>()
      .def_readwrite("tag", &Message::tag, "What it holds; 0: nothing.")
      .def_readwrite("sequence", &Message::sequence,
                     "0, 1, 2, ...; -1: nothing has come yet.")
      .def_readwrite("send_time", &Message::send_time, "Sender's clock, s.")
      .def_readwrite("gripper_opening", &Message::gripper_opening,
                     kGripperOpeningDoc)
      .def_property(
          "body",
          [](const Message& self) {
            return AsReadOnlyArray(
                Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(
                    self.body.data(), self.size)));
          },
          [](Message& self, const py::object& value) {
            const auto body = AsArray(value, "body", "(n,)");
            if (body.ndim() != 1 || body.size() > Message::kMaxSize) {
              ThrowShape("body", "(n,), n <= 40", body);
            }
            self.size = static_cast<std::int32_t>(body.size());
            std::copy_n(body.data(), self.size, self.body.begin());
          },
          "Its numbers, (n,), n <= 40.")
      .def(
          "describe", [](const Message& self) { return DescribeTag(self.tag); },
          "What it holds, for people.")
      .def("__repr__",
           [](const Message& self) {
             return "Message(" + DescribeTag(self.tag) +
                    ", sequence=" + std::to_string(self.sequence) + ")";
           })
      .def_pickle(
          [](const py::object& self) {
            return py::make_tuple(self.attr("tag"), self.attr("sequence"),
                                  self.attr("send_time"), self.attr("body"),
                                  self.attr("gripper_opening"));
          },
          [](const py::tuple& values) {
            Message message;
            const py::object self =
                py::cast(&message, py::return_value_policy::reference);
            self.attr("tag") = values[0];
            self.attr("sequence") = values[1];
            self.attr("send_time") = values[2];
            self.attr("body") = values[3];
            self.attr("gripper_opening") = values[4];
            return message;
          });

  using PM = PoseMessage;
  auto message = BindState<PM>(
      m, "PoseMessage",
      "What the dual proxy sends over the link, in both directions: a pose, "
      "the selections of\nforce and moment space and the contacts' normals "
      "(which stay zero from the haptic side).");
  const auto make_message =
      [](std::int64_t sequence, double send_time, const Pose& pose,
         const py::object& force_selection, const py::object& moment_selection,
         const py::object& contact_normals) {
        return PM{sequence,
                  send_time,
                  pose,
                  Mat3(force_selection, "force_selection"),
                  Mat3(moment_selection, "moment_selection"),
                  Mat3(contact_normals, "contact_normals")};
      };
  message
      .def_factory(
          make_message, py::arg("sequence") = -1, py::arg("send_time") = 0.0,
          py::arg("pose") = Pose{},
          py::arg("force_selection") = AsReadOnlyArray(PM{}.force_selection),
          py::arg("moment_selection") = AsReadOnlyArray(PM{}.moment_selection),
          py::arg("contact_normals") = AsReadOnlyArray(PM{}.contact_normals))
      .def_readwrite("sequence", &PM::sequence,
                     "0, 1, 2, ...; -1: nothing has come yet.")
      .def_readwrite("send_time", &PM::send_time, "Sender's clock, s.")
      .def_readwrite("pose", &PM::pose, "Pose: X_DH or X_BE.")
      .def_readwrite("gripper_opening", &PM::gripper_opening,
                     kGripperOpeningDoc)
      .def(
          "is_valid", [](const PM& self) { return IsValid(self); },
          "True if the message may be acted on: finite, its pose a pose, its "
          "selections projections, its normals unit vectors.")
      .def("__repr__",
           [](const PM& self) {
             return "PoseMessage(sequence=" + std::to_string(self.sequence) +
                    ", send_time=" +
                    py::repr(py::float_(self.send_time)).cast<std::string>() +
                    ", pose=" +
                    py::repr(py::cast(self.pose)).cast<std::string>() +
                    ", ...)";
           })
      .def_pickle(
          [](const PM& self) {
            return py::make_tuple(self.sequence, self.send_time, self.pose,
                                  self.force_selection, self.moment_selection,
                                  self.contact_normals, self.gripper_opening);
          },
          [make_message](const py::tuple& values) {
            PM result = make_message(
                values[0].cast<std::int64_t>(), values[1].cast<double>(),
                values[2].cast<Pose>(), values[3], values[4], values[5]);
            result.gripper_opening = values[6].cast<double>();
            return result;
          });
  message.attr("TAG") = PM::kTag;
  message.def_static(
      "from_message", [](const Message& self) { return FromMessage<PM>(self); },
      py::arg("message"),
      "The content of a Message; of another kind it is not valid.");
  DefArray(&message, "force_selection", &PM::force_selection,
           "Omega_f, (3, 3), orthogonal projection, in B.");
  DefArray(&message, "moment_selection", &PM::moment_selection,
           "Omega_tau, (3, 3), orthogonal projection, in B.");
  DefArray(&message, "contact_normals", &PM::contact_normals,
           "(3, 3), unit vectors INTO the surfaces as columns, in B; zero: "
           "none, or not known.");

  using FM = ForceMessage;
  auto force = BindState<FM>(
      m, "ForceMessage",
      "What the two-channel baseline sends from the robot to the device.");
  const auto make_force = [](std::int64_t sequence, double send_time,
                             const py::object& value) {
    return FM{sequence, send_time, Vec3(value, "force")};
  };
  force
      .def_factory(make_force, py::arg("sequence") = -1,
                   py::arg("send_time") = 0.0,
                   py::arg("force") = AsReadOnlyArray(FM{}.force))
      .def_readwrite("sequence", &FM::sequence,
                     "0, 1, 2, ...; -1: nothing has come yet.")
      .def_readwrite("send_time", &FM::send_time, "Sender's clock, s.")
      .def(
          "is_valid", [](const FM& self) { return IsValid(self); },
          "True if the message may be acted on: finite.")
      .def("__repr__",
           [](const FM& self) {
             return "ForceMessage(sequence=" + std::to_string(self.sequence) +
                    ", send_time=" +
                    py::repr(py::float_(self.send_time)).cast<std::string>() +
                    ", force=" +
                    py::repr(py::cast(self.force).attr("tolist")())
                        .cast<std::string>() +
                    ")";
           })
      .def_pickle(
          [](const FM& self) {
            return py::make_tuple(self.sequence, self.send_time, self.force);
          },
          [make_force](const py::tuple& values) {
            return make_force(values[0].cast<std::int64_t>(),
                              values[1].cast<double>(), values[2]);
          });
  force.attr("TAG") = FM::kTag;
  DefArray(&force, "force", &FM::force,
           "Robot on its environment, (3,), N, in B.");
}

template <typename Message>
BoundClass<MessageSenderState<Message>> BindSenderState(py::module_& m,
                                                        const char* name) {
  using State = MessageSenderState<Message>;
  return BindState<State>(m, name, "Memory of a sender.")
      .def_property_readonly(
          "message", [](const State& self) { return self.message; },
          "The newest message; sequence -1 before the first. A copy.")
      .def_readonly("bad_inputs", &State::bad_inputs,
                    "Samples refused: not finite, or no pose.");
}

void BindSenders(py::module_& m) {
  using P = PoseSenderParams;
  BindParams<P>(m, "PoseSenderParams", "Parameters of a sender.").Fields();
  BindSenderState<PoseMessage>(m, "PoseSenderState");
  BindSenderState<ForceMessage>(m, "ForceSenderState");
  BoundClass<PoseSender>(
      m, "PoseSender",
      "Turns poses at the control rate into messages at the link's rate: mean "
      "position and\nchordal-mean rotation since the last message, the latest "
      "selections.")
      .def_constructor<const P&>(py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<PoseSender>)
      .def("make_state", &PoseSender::MakeState)
      .def(
          "update",
          [](const PoseSender& self, double time, const py::object& position,
             const py::object& rotation, const py::object& force_selection,
             const py::object& moment_selection, PoseSenderState& state,
             const py::object& contact_normals) {
            return self.Update(
                time,
                {.pose = {Vec3(position, "position"),
                          Mat3(rotation, "rotation")},
                 .force_selection = Mat3(force_selection, "force_selection"),
                 .moment_selection = Mat3(moment_selection, "moment_selection"),
                 .contact_normals = NormalsOrNone(contact_normals)},
                &state);
          },
          py::arg("time"), py::arg("position"), py::arg("rotation"),
          py::arg("force_selection"), py::arg("moment_selection"),
          py::arg("state"), py::arg("contact_normals") = py::none(),
          "Takes one sample: time (s), position (3,) m, rotation (3, 3), "
          "selections and normals (3, 3) in B.\nReturns the newest message; it "
          "is a new "
          "one when its sequence has grown.");
  BoundClass<ForceSender>(
      m, "ForceSender",
      "Turns forces at the control rate into messages at the link's rate.")
      .def_constructor<const P&>(py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<ForceSender>)
      .def("make_state", &ForceSender::MakeState)
      .def(
          "update",
          [](const ForceSender& self, double time, const py::object& force,
             ForceSenderState& state) {
            return self.Update(time, Vec3(force, "force"), &state);
          },
          py::arg("time"), py::arg("force"), py::arg("state"),
          "Takes one sample: time (s), force (3,) N, in B. Returns the newest "
          "message.");
}

void BindChannel(py::module_& m) {
  using P = CommunicationChannelParams;
  using Channel = CommunicationChannel;
  using State = CommunicationChannelState;
  BindParams<P>(m, "CommunicationChannelParams",
                "Parameters of a simulated link, one way.")
      .Fields();
  BindState<State>(
      m, "CommunicationChannelState",
      "What is under way in a channel, its generator and counters.")
      .def_property_readonly(
          "in_flight", [](const State& self) { return self.in_flight.size(); },
          "Messages under way, as of the last send().")
      .def_readonly("sent", &State::sent, "Messages sent.")
      .def_readonly("lost", &State::lost, "Of these, lost on the way.")
      .def_readonly("overflow", &State::overflow,
                    "Of these, pushed out of a full channel.")
      .def_readonly("refused", &State::refused,
                    "Messages refused because not finite.");
  BoundClass<Channel>(
      m, "CommunicationChannel",
      "A link with delay, jitter, loss and reordering, one way.")
      .def_constructor<const P&>(py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<Channel>)
      .def("make_state", &Channel::MakeState, py::arg("seed") = 0,
           "An empty channel. The same seed gives the same bits.")
      .def(
          "send",
          [](const Channel& self, double time, const py::object& message,
             State& state) {
            self.Send(time, MessageFromPython(message), &state);
          },
          py::arg("time"), py::arg("message"), py::arg("state"),
          "Offers the sender's newest message (a Message, PoseMessage or "
          "ForceMessage) at `time`\n(s, not decreasing); one that was offered "
          "before (by its sequence) is ignored.")
      .def(
          "receive",
          [](const Channel& self, double time, const State& state) {
            return MessageToPython(self.Receive(time, state));
          },
          py::arg("time"), py::arg("state"),
          "The message that arrived last at `time` (s, not before the last "
          "send), or the empty one.");
}

void BindLinkMonitor(py::module_& m) {
  py::native_enum<LinkStatus>(m, "LinkStatus", "enum.IntEnum",
                              "What a receiver knows about its link.")
      .value("WAITING", LinkStatus::kWaiting, "No message accepted yet.")
      .value("CONNECTED", LinkStatus::kConnected, "The link is alive.")
      .value("LOST", LinkStatus::kLost, "Silent for longer than the timeout.")
      .finalize();
  using P = LinkMonitorParams;
  BindParams<P>(m, "LinkMonitorParams", "Parameters of LinkMonitor.").Fields();
  using S = LinkMonitorState;
  BindState<S>(m, "LinkMonitorState", "State and counters of LinkMonitor.")
      .def_readonly("status", &S::status, "LinkStatus.")
      .def_readonly("last_sequence", &S::last_sequence,
                    "Of the message in use; -1 before the first.")
      .def_readonly("last_send_time", &S::last_send_time,
                    "Of the message in use, s, sender's clock.")
      .def_readonly("last_arrival_time", &S::last_arrival_time,
                    "Of the message in use, s.")
      .def_readonly("age", &S::age,
                    "Now minus send time of the message in use, s.")
      .def_readonly("received", &S::received, "Messages accepted.")
      .def_readonly("dropped", &S::dropped,
                    "Messages refused: too old or out of order.")
      .def_readonly("gaps", &S::gaps, "Sequence numbers skipped.")
      .def_readonly("spikes", &S::spikes, "Messages that came unusually late.")
      .def_readonly("bad_inputs", &S::bad_inputs,
                    "Messages refused: not finite or not valid.")
      .def_readonly("losses", &S::losses, "Times the link was lost.");
  BoundClass<LinkMonitor>(
      m, "LinkMonitor",
      "Decides which messages may be acted on, and whether the link is alive.")
      .def_constructor<const P&>(py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<LinkMonitor>)
      .def("make_state", &LinkMonitor::MakeState)
      .def(
          "update",
          [](const LinkMonitor& self, double time, std::int64_t sequence,
             double send_time, bool valid, S& state) {
            return self.Update(time, sequence, send_time, valid, &state);
          },
          py::arg("time"), py::arg("sequence"), py::arg("send_time"),
          py::arg("valid"), py::arg("state"),
          "Looks at the newest message; call it every tick. Returns True if it "
          "is fresh and to be used.");
}

}  // namespace

void BindLink(py::module_& m) {
  BindMessages(m);
  BindSenders(m);
  BindChannel(m);
  BindLinkMonitor(m);
}

}  // namespace dual_proxy
