// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "dual_proxy/link/clock_offset.h"
#include "dual_proxy/link/link_end.h"
#include "dual_proxy/link/wire_format.h"
#include "messages.h"
#include "params.h"

namespace dual_proxy {
namespace {

std::span<const std::uint8_t> AsSpan(const py::bytes& bytes) {
  const std::string_view view(bytes);
  return {reinterpret_cast<const std::uint8_t*>(view.data()), view.size()};
}

py::bytes AsBytes(const FrameBytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// {name: how many} of an enum's values.
template <typename Enum, typename Counts>
py::dict CountsByName(const Counts& counts) {
  py::dict result;
  for (const auto& [value, name] : EnumStrings<Enum>::kValues) {
    result[name] = counts[static_cast<std::size_t>(value)];
  }
  return result;
}

void BindWireFormat(py::module_& m) {
  using F = LinkFrame;
  BindState<F>(m, "LinkFrame",
               "What two processes exchange: a message, and what its receiver "
               "needs to trust it\n(docs/link.md).")
      .def_constructor<>()
      .def_property(
          "direction",
          [](const F& self) { return EnumToString(self.direction); },
          [](F& self, const py::object& value) {
            self.direction = EnumFromPython<LinkDirection>(value, "direction");
          },
          "\"to_robot\" or \"to_haptic\".")
      .def_readwrite("session", &F::session, "Of a start of the sender; not 0.")
      .def_readwrite("number", &F::number, "0, 1, 2, ... in a session.")
      .def_readwrite("time", &F::time, "When it was made, sender's clock, s.")
      .def_property(
          "echo_session", [](const F& self) { return self.echo.session; },
          [](F& self, std::uint64_t value) { self.echo.session = value; },
          "Of the newest frame that the sender has; 0: it has none.")
      .def_property(
          "echo_time", [](const F& self) { return self.echo.time; },
          [](F& self, double value) { self.echo.time = value; },
          "`time` of that frame, s.")
      .def_property(
          "echo_age", [](const F& self) { return self.echo.age; },
          [](F& self, double value) { self.echo.age = value; },
          "How long ago it came, s, >= 0.")
      .def_readwrite("flags", &F::flags,
                     "1: clutch pressed, 2: holding, 4: fault; or a sum.")
      .def_property(
          "message", [](const F& self) { return self.message; },
          [](F& self, const py::object& value) {
            self.message = MessageFromPython(value);
          },
          "A Message; sequence -1: none yet. A copy.");
  m.attr("LinkFrame").attr("SIZE") = kFrameSize;
  m.attr("LinkFrame").attr("VERSION") = kWireVersion;
  m.attr("LinkFrame").attr("CLUTCH") = kLinkClutch;
  m.attr("LinkFrame").attr("HOLDING") = kLinkHolding;
  m.attr("LinkFrame").attr("FAULT") = kLinkFault;
  Def(
      &m, "encode_frame",
      [](const F& frame) { return AsBytes(EncodeFrame(frame)); },
      py::arg("frame"), "The bytes of a LinkFrame, whatever is in it.");
  Def(
      &m, "decode_frame",
      [](const py::bytes& data, const py::object& direction) {
        F frame;
        const WireError error = DecodeFrame(
            AsSpan(data), EnumFromPython<LinkDirection>(direction, "direction"),
            &frame);
        if (error != WireError::kNone) {
          throw py::value_error("decode_frame: the bytes " +
                                std::string(DescribeWireError(error)));
        }
        return frame;
      },
      py::arg("data"), py::arg("direction"),
      "The LinkFrame that came in a direction.\nRaises ValueError for bytes "
      "that are none, saying why.");
  Def(
      &m, "describe_wire_error",
      [](const py::object& name) {
        return DescribeWireError(EnumFromPython<WireError>(name, "name"));
      },
      py::arg("name"),
      "For people what a name in LinkEndState.malformed means, to complete "
      "\"the bytes ...\".");
}

void BindClockOffset(py::module_& m) {
  using P = ClockOffsetParams;
  using S = ClockOffsetState;
  BindParams<P>(m, "ClockOffsetParams", "Parameters of ClockOffset.").Fields();
  BindState<S>(m, "ClockOffsetState", "Memory of a ClockOffset.")
      .def_readonly("estimated", &S::estimated, "Whether there is an offset.")
      .def_readonly("offset", &S::offset, "Peer's clock minus own, s.")
      .def_readonly("round_trip", &S::round_trip,
                    "Mean of the shortest round trips, s.")
      .def_readonly("jumps", &S::jumps, "Times that a clock has jumped.")
      .def_readonly("bad_inputs", &S::bad_inputs, "Round trips refused.")
      .def_property_readonly("trusted", &ClockOffset::IsTrusted,
                             "Whether `offset` can be relied on.");
  BoundClass<ClockOffset>(
      m, "ClockOffset",
      "Estimates by how much a peer's clock is ahead, from round trips.")
      .def_constructor<const P&>(py::arg("params") = P{})
      .def_property_readonly("params", &ParamsOf<ClockOffset>)
      .def("make_state", &ClockOffset::MakeState)
      .def(
          "update",
          [](const ClockOffset& self, double time, double echo_time,
             double echo_age, double peer_time, S& state) {
            self.Update(time, echo_time, echo_age, peer_time, &state);
          },
          py::arg("time"), py::arg("echo_time"), py::arg("echo_age"),
          py::arg("peer_time"), py::arg("state"),
          "Takes a round trip that ends at `time` and began at `echo_time` "
          "(s, own clock); the peer\nanswered at `peer_time` (s, its clock), "
          "`echo_age` after it got what it answers.")
      .def_static("to_local", &ClockOffset::ToLocal, py::arg("peer_time"),
                  py::arg("state"),
                  "A time of the peer's by the own clock, s.");
}

void BindLinkEnd(py::module_& m) {
  using P = LinkEndParams;
  using S = LinkEndState;
  BindParams<P>(m, "LinkEndParams", "Parameters of LinkEnd.").Fields();
  BindState<S>(m, "LinkEndState", "Memory and counters of a LinkEnd.")
      .def_property_readonly(
          "message", [](const S& self) { return self.message; },
          "The newest Message that may be acted on, its send_time by this "
          "end's clock; sequence -1\nbefore the first. A copy.")
      .def_readonly("flags", &S::flags, "What the other end says of itself.")
      .def_property_readonly(
          "clock", [](const S& self) { return self.clock; },
          "ClockOffsetState of the other end. A copy.")
      .def_readonly("session", &S::session, "Of this end.")
      .def_readonly("peer", &S::peer, "Session that is heard; 0: none yet.")
      .def_readonly("heard_time", &S::heard_time,
                    "When a frame of it was accepted, s.")
      .def_readonly("sent", &S::sent, "Frames sent.")
      .def_readonly("lost", &S::lost, "Frames sent before one that came.")
      .def_property_readonly(
          "verdicts",
          [](const S& self) {
            return CountsByName<FrameVerdict>(self.verdicts);
          },
          "{what became of frames: how many}.")
      .def_property_readonly(
          "malformed",
          [](const S& self) {
            py::dict counts = CountsByName<WireError>(self.malformed);
            counts.attr("pop")("none");
            return counts;
          },
          "{why bytes were no frame: how often}; describe_wire_error() has the "
          "reasons for people.")
      .def_readonly("bad_inputs", &S::bad_inputs,
                    "Calls with a time that is not finite.");
  BoundClass<LinkEnd>(
      m, "LinkEnd",
      "One end of a link between two processes: frames of a side's messages, "
      "and of what comes only\nthe frames of one live sender, each once, in "
      "order, with times by this end's clock.")
      .def_factory(
          [](const py::object& sends, const LinkMonitorParams& monitor,
             const P& params) {
            return LinkEnd(EnumFromPython<LinkDirection>(sends, "sends"),
                           monitor, params);
          },
          py::arg("sends"), py::arg("monitor") = LinkMonitorParams{},
          py::arg("params") = P{},
          "`sends` is \"to_robot\" or \"to_haptic\"; `monitor` the side's.")
      .def_property_readonly("params", &ParamsOf<LinkEnd>)
      .def("make_state", &LinkEnd::MakeState, py::arg("session"),
           "`session`: random, 64 bits, another one at each start.")
      .def(
          "send",
          [](const LinkEnd& self, double time, const py::object& message,
             std::uint32_t flags, S& state) -> std::optional<py::bytes> {
            if (!self.Send(time, MessageFromPython(message), flags, &state)) {
              return std::nullopt;
            }
            return AsBytes(state.bytes);
          },
          py::arg("time"), py::arg("message"), py::arg("flags"),
          py::arg("state"),
          "Call it every period with the newest message. Returns the bytes to "
          "be sent now, or None.")
      .def(
          "receive",
          [](const LinkEnd& self, double time, const py::bytes& data,
             S& state) {
            return EnumToString(self.Receive(time, AsSpan(data), &state));
          },
          py::arg("time"), py::arg("data"), py::arg("state"),
          "Takes bytes that came; returns what became of them. \"accepted\": "
          "state.message may be new.")
      .def("is_connected", &LinkEnd::IsConnected, py::arg("time"),
           py::arg("state"),
           "Whether the other end has been heard within the link's timeout.");
}

}  // namespace

void BindWire(py::module_& m) {
  BindWireFormat(m);
  BindClockOffset(m);
  BindLinkEnd(m);
}

}  // namespace dual_proxy
