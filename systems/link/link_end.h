// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "dual_proxy/common/serialize.h"
#include "dual_proxy/link/clock_offset.h"
#include "dual_proxy/link/link_monitor.h"
#include "dual_proxy/link/message.h"
#include "dual_proxy/link/wire_format.h"

namespace dual_proxy {

struct LinkEndParams {
  double interval{0.02};
  ClockOffsetParams clock;

  /** @throws std::invalid_argument naming the field. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("interval", &interval, Above(0), "s",
                   "after which a frame goes out though nothing is new: the "
                   "newest message again, with what clocks and sessions need"));
    a->Visit(Field("clock", &clock, "estimate of the other clock"));
  }
};

/** What became of bytes that came. */
enum class FrameVerdict {
  kAccepted = 0,
  kMalformed,     ///< No frame (WireError).
  kReplayed,      ///< A number of its session that is not larger than the last.
  kOtherSession,  ///< Of another sender than the one that is heard.
  kUnproven,  ///< Does not echo this end, which may not have been heard yet.
  kStale,     ///< Echoes what was sent too long ago.
  kUntimed,   ///< Accepted, but for its message: the clocks do not agree (yet).
};

template <>
struct EnumStrings<FrameVerdict> {
  static constexpr std::pair<FrameVerdict, const char*> kValues[] = {
      {FrameVerdict::kAccepted, "accepted"},
      {FrameVerdict::kMalformed, "malformed"},
      {FrameVerdict::kReplayed, "replayed"},
      {FrameVerdict::kOtherSession, "other_session"},
      {FrameVerdict::kUnproven, "unproven"},
      {FrameVerdict::kStale, "stale"},
      {FrameVerdict::kUntimed, "untimed"}};
};

inline constexpr std::size_t kFrameVerdicts =
    std::size(EnumStrings<FrameVerdict>::kValues);

/** Memory of a LinkEnd. */
struct LinkEndState {
  /// Sessions that were replaced by another, and are never heard again.
  static constexpr std::size_t kReplaced = 16;
  static constexpr double kNever = -std::numeric_limits<double>::infinity();

  FrameBytes bytes{};              ///< The frame to be sent, after Send().
  std::uint64_t session{0};        ///< Of this end.
  std::uint64_t number{0};         ///< Of the next frame.
  double sent_time{kNever};        ///< Of the last frame, s.
  std::int64_t sent_sequence{-1};  ///< Of the message in it.
  std::uint32_t sent_flags{0};

  /** The newest message that may be acted on, with its send_time by this end's
  clock; sequence -1 before the first. */
  Message message{};
  std::uint32_t flags{0};  ///< What the other end says of itself.
  ClockOffsetState clock;  ///< Of the other end.

  std::uint64_t peer{0};         ///< Session that is heard; 0: none yet.
  std::uint64_t peer_number{0};  ///< Of the last frame of it.
  double heard_time{kNever};     ///< When a frame of it was accepted, s.
  LinkEcho heard{};              ///< Newest frame; `age` is when it came, s.
  std::array<std::uint64_t, kReplaced> replaced{};
  std::size_t replacements{0};

  std::int64_t sent{0};
  std::int64_t lost{0};  ///< Frames that were sent before one that came.
  std::array<std::int64_t, kFrameVerdicts> verdicts{};  ///< How many of each.
  std::array<std::int64_t, kWireErrors> malformed{};    ///< Of kMalformed.
  std::int64_t bad_inputs{0};  ///< Calls refused: a time that is not finite.
};

/** One end of a link between two processes: makes frames of a side's messages,
and takes of what comes only frames of one live sender, each once, in order,
with times by this end's clock. What is in a message is for the side's
LinkMonitor and IsValid().

Who sends is told by `session`, a random number of each start. A frame is proof
of a live sender if it echoes what this end sent a moment ago, which nobody can
have recorded earlier: bytes of an earlier run, of this sender or another, never
pass, whatever the clocks say. Nor does what comes from an end that has not got
anything for the link's timeout, or was under way for so much longer than the
shortest frames: a backlog. So a link takes a round trip before anything is
accepted, and fails both ways if it fails one way.

A frame of another session than the one that is heard is refused, until that has
been silent for the link's timeout; then one that is proven replaces it, and the
replaced one is never heard again (the last LinkEndState::kReplaced of them). So
of two senders the first stays, and one that was restarted comes back once its
link is lost, as LinkMonitor wants it.

Times by the other clock are translated by ClockOffset. While that is not to be
trusted no message is let through. */
class LinkEnd {
 public:
  /** @param sends  where this end's frames go; the other's go the other way.
  @param monitor  of the side: its timeout is how long a sender may be silent,
      twice its max_age how long ago an echoed frame may have been sent.
  @throws std::invalid_argument for parameters out of range. */
  LinkEnd(LinkDirection sends, const LinkMonitorParams& monitor,
          LinkEndParams params);

  const LinkEndParams& params() const { return params_; }

  /** @param session  random, another one at each start of a process; 0 is
  taken for 1. */
  LinkEndState MakeState(std::uint64_t session) const;

  /** Call it every period, with the newest message.
  @param time  own clock now, s.
  @param message  the side's newest, its send_time by that clock.
  @param flags  kLinkClutch and others; unknown ones are left out.
  @returns true if state->bytes are to be sent: there is a new message or flag,
      or `interval` has passed.  No heap, no throw. */
  bool Send(double time, const Message& message, std::uint32_t flags,
            LinkEndState* state) const noexcept;

  /** Takes what came.
  @param time  own clock now, s.
  @returns kAccepted if it may be acted on: state->message is that of the frame,
      if there is one in it.  No heap, no throw. */
  FrameVerdict Receive(double time, std::span<const std::uint8_t> bytes,
                       LinkEndState* state) const noexcept;

  /** Whether the other end has been heard within the link's timeout. */
  bool IsConnected(double time, const LinkEndState& state) const noexcept {
    return time - state.heard_time <= timeout_;
  }

 private:
  FrameVerdict Judge(double time, std::span<const std::uint8_t> bytes,
                     LinkEndState* state) const noexcept;

  LinkDirection sends_;
  LinkDirection receives_;
  double timeout_;
  double max_echo_time_;
  LinkEndParams params_;
  ClockOffset clock_;
};

}  // namespace dual_proxy
